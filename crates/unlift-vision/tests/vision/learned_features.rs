//! ALIKED and SuperPoint, compared with the authors' code, and on synthetic images.

use std::path::Path;
use std::process::Command;

use image::Rgb;
use safetensors::SafeTensors;
use serde_json::Value;
use sha2::{Digest, Sha256};
use unlift_vision::features::photo::{Turn, read_color};
use unlift_vision::features::{
    ColorImage, Extraction, Extractor, LearnedFeatures, aliked, superpoint,
};
use unlift_vision::network::{Entry, Network, Port, entry};

use crate::{assert_close, floats, shared};

fn network() -> Network {
    Network::load("aliked-n16rot").unwrap()
}

fn waves(width: u32, height: u32) -> ColorImage {
    ColorImage::from_fn(width, height, |x, y| {
        let (x, y) = (x as f32, y as f32);
        Rgb([0.0, 1.0, 2.0].map(|channel: f32| {
            let wave = (x / 5.0 + channel).sin() * (y / 7.0).cos() + (x * y / 90.0).sin();
            (127.0 + 60.0 * wave) as u8
        }))
    })
}

/// Returns the share of the reference's keypoints that are found within 0.05 pixels, and the share
/// of these whose descriptor has a cosine above 0.999 and whose score is the same.
fn parity(found: &LearnedFeatures, reference: [&[f32]; 3]) -> (f64, f64) {
    let [places, descriptors, scores] = reference;
    let (mut near, mut alike) = (0, 0);
    let expected = places.as_chunks::<2>().0.iter().zip(descriptors.chunks_exact(found.dim));
    for (([x, y], descriptor), score) in expected.zip(scores) {
        let distance =
            |at: &usize| (found.keypoints[*at][0] - x).hypot(found.keypoints[*at][1] - y);
        let nearest = (0..found.keypoints.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let Some(at) = nearest.filter(|at| distance(at) < 0.05) else { continue };
        near += 1;
        let own = &found.descriptors[at * found.dim..(at + 1) * found.dim];
        let cosine: f32 = own.iter().zip(descriptor).map(|(a, b)| a * b).sum();
        alike += u32::from(cosine > 0.999 && (found.scores[at] - score).abs() < 1e-3);
    }
    let n = places.len() as f64 / 2.0;
    (f64::from(near) / n, f64::from(alike) / f64::from(near.max(1)))
}

/// Decodes the photo with Pillow, as for the reference; `None` if Python or Pillow is missing.
fn by_pillow(path: &Path) -> Option<ColorImage> {
    let program = "import sys; from PIL import Image; \
                   Image.open(sys.argv[1]).convert('RGB').save(sys.stdout.buffer, 'PPM')";
    let run = Command::new("python3").args(["-c", program]).arg(path).output().ok()?;
    let mut lines = run.stdout.splitn(4, |&byte| byte == b'\n');
    let (_, size, _) = (lines.next()?, lines.next()?, lines.next()?);
    let sides = str::from_utf8(size).ok()?.split(' ').map(|side| side.parse().ok());
    let sides: Vec<u32> = sides.collect::<Option<_>>()?;
    ColorImage::from_raw(sides[0], sides[1], lines.next()?.to_vec())
}

#[test]
fn features_of_aliked_are_those_of_the_authors_code() {
    let Some(path) = shared("reference/aliked_n16rot.safetensors") else { return };
    let bytes = std::fs::read(path).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let (_, header) = SafeTensors::read_metadata(&bytes).unwrap();
    let meta: Value = serde_json::from_str(&header.metadata().as_ref().unwrap()["meta"]).unwrap();
    let network = network();
    let options = Extraction { max_features: 5000, ..Extraction::ALIKED };
    for (at, image) in meta["images"].as_array().unwrap().iter().enumerate() {
        let path = shared(image["path"].as_str().unwrap()).unwrap();
        let [places, descriptors, scores] = ["keypoints", "descriptors", "scores"]
            .map(|name| floats(&file, &format!("{at}.{name}")));
        let reference = [&places[..], &descriptors, &scores];
        let own = read_color(&path, Turn::Upright).unwrap();
        let pixels = file.tensor(&format!("{at}.pixels_sha")).unwrap();
        let same = |image: &ColorImage| Sha256::digest(image.as_raw())[..] == *pixels.data();
        let exact = if same(&own) { Some(own.clone()) } else { by_pillow(&path).filter(same) };
        match exact {
            Some(exact) => {
                let found = aliked(&network, &options, &exact).unwrap();
                let n = image["n_keypoints"].as_u64().unwrap() as usize;
                // A score at the threshold may be above it after rounding.
                assert!(found.keypoints.len().abs_diff(n) <= 1, "{at}: {n} keypoints expected");
                let (near, alike) = parity(&found, reference);
                assert!(near >= 0.99 && alike >= 0.99, "{at}: {near}, {alike}");
            }
            None => eprintln!("image {at}: Pillow, which has the reference's pixels, is missing"),
        }
        // Another decoder's pixels differ slightly, and more where colors are subsampled.
        let (near, _) = parity(&aliked(&network, &options, &own).unwrap(), reference);
        assert!(near >= 0.8, "{at}: {near}");
    }
}

#[test]
fn options_choose_the_best_and_sizes_are_undone() {
    let (network, image) = (network(), waves(200, 136));
    let low = Extraction { min_score: 0.05, ..Extraction::ALIKED };
    let all = aliked(&network, &low, &image).unwrap();
    let n = all.keypoints.len();
    assert!(n > 30, "{n}");
    assert_eq!((all.scores.len(), all.descriptors.len()), (n, n * 128));
    for descriptor in all.descriptors.chunks_exact(128) {
        let length: f32 = descriptor.iter().map(|value| value * value).sum();
        assert!((length - 1.0).abs() < 1e-4);
    }
    let few = aliked(&network, &Extraction { max_features: 7, ..low }, &image).unwrap();
    assert_eq!(few.keypoints, all.keypoints[..7]);
    let half = Extraction { max_image_size: 100, ..low };
    let half = aliked(&network, &half, &image).unwrap();
    let right = half.keypoints.iter().filter(|[x, _]| *x > 110.0).count();
    assert!(right > 0, "keypoints are in pixels of the image as it was given");
}

#[test]
fn images_without_structure_have_no_features() {
    let (network, narrow) = (network(), narrow_superpoint());
    for (width, height) in [(1, 1), (5, 3), (7, 100), (1, 200), (8, 8), (64, 64), (97, 33)] {
        for level in [0, 128, 255] {
            let flat = ColorImage::from_pixel(width, height, Rgb([level; 3]));
            let n = aliked(&network, &Extraction::ALIKED, &flat).unwrap().keypoints.len();
            assert_eq!(n, 0, "{width} x {height}, {level}");
        }
        // Random weights find something in large flat images.
        if width.min(height) <= 8 {
            let black = ColorImage::new(width, height);
            let n = superpoint(&narrow, &Extraction::SUPERPOINT, &black).unwrap().keypoints.len();
            assert_eq!(n, 0, "{width} x {height}");
        }
    }
}

#[test]
fn options_out_of_range_are_named() {
    let error = |options: Extraction| Extractor::try_new(&options).err().unwrap().to_string();
    let none = Extraction { max_features: 0, ..Extraction::ALIKED };
    assert_eq!(error(none), "max_features: expected at least 1, found 0");
    let unknown = Extraction { min_score: f32::NAN, ..Extraction::ALIKED };
    assert_eq!(error(unknown), "min_score: expected 0 to below 1, found NaN");
}

/// Loads a network with seeded random weights, whose descriptors have 16 values.
/// `python export/superpoint.py --random FOLDER` makes the folder of data.
fn narrow_superpoint() -> Network {
    const OUTPUTS: &[Port] = &[
        Port { name: "score", shape: &[Some(1), None, None] },
        Port { name: "coarse", shape: &[Some(1), None, None, Some(16)] },
    ];
    let narrow = Entry { outputs: OUTPUTS, ..*entry("superpoint").unwrap() };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/superpoint-random");
    Network::read(&path.join("superpoint.onnx"), &narrow).unwrap()
}

#[test]
fn features_of_superpoint_are_those_of_the_export_script() {
    let golden = include_bytes!("../data/superpoint-random/golden.safetensors");
    let golden = SafeTensors::deserialize(golden).unwrap();
    let image = golden.tensor("image").unwrap();
    let (height, width) = (image.shape()[0] as u32, image.shape()[1] as u32);
    let colors = image.data().iter().flat_map(|&gray| [gray; 3]).collect();
    let image = ColorImage::from_raw(width, height, colors).unwrap();
    let found = superpoint(&narrow_superpoint(), &Extraction::SUPERPOINT, &image).unwrap();
    let keypoints = floats(&golden, "keypoints");
    assert!(keypoints.len() > 100, "{}", keypoints.len());
    assert_eq!(found.keypoints.as_flattened(), keypoints, "pixels, so exactly the same");
    assert_close("scores", &found.scores, &floats(&golden, "scores"), 1e-5);
    assert_close("descriptors", &found.descriptors, &floats(&golden, "descriptors"), 1e-4);
}
