//! ALIKED, compared with the authors' code on real photos, and tests on synthetic images.

use std::path::{Path, PathBuf};
use std::process::Command;

use safetensors::SafeTensors;
use serde_json::Value;
use sha2::{Digest, Sha256};
use unlift_vision::features::{Aliked, AlikedOptions, ColorImage, LearnedFeatures, load};

/// Returns the folder of evaluation data beside the repository, if it exists.
fn shared() -> Option<PathBuf> {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared"));
    Some(folder).filter(|path| path.join("reference/aliked_n16rot.safetensors").is_file())
}

fn aliked(options: AlikedOptions) -> Aliked {
    Aliked::try_new(options).unwrap()
}

fn waves(width: usize, height: usize) -> ColorImage {
    let value = |at: usize| {
        let (x, y, channel) = ((at / 3 % width) as f32, (at / 3 / width) as f32, (at % 3) as f32);
        let wave = (x / 5.0 + channel).sin() * (y / 7.0).cos() + (x * y / 90.0).sin();
        (127.0 + 60.0 * wave) as u8
    };
    ColorImage::try_new(width, height, (0..3 * width * height).map(value).collect()).unwrap()
}

fn floats(file: &SafeTensors, name: &str) -> Vec<f32> {
    let data = file.tensor(name).unwrap().data().as_chunks::<4>().0;
    data.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

/// Returns the share of the reference's keypoints that are found within 0.05 pixels, and the share
/// of these whose descriptor has a cosine above 0.999.
fn parity(found: &LearnedFeatures, places: &[f32], descriptors: &[f32]) -> (f64, f64) {
    let (mut near, mut alike) = (0, 0);
    let expected = places.as_chunks::<2>().0.iter().zip(descriptors.chunks_exact(found.dim));
    for ([x, y], descriptor) in expected {
        let distance = |[a, b]: [f32; 2]| (a - x).hypot(b - y);
        let nearest = (0..found.keypoints.len())
            .min_by(|&a, &b| distance(found.keypoints[a]).total_cmp(&distance(found.keypoints[b])));
        let Some(at) = nearest.filter(|&at| distance(found.keypoints[at]) < 0.05) else { continue };
        near += 1;
        let own = &found.descriptors[at * found.dim..(at + 1) * found.dim];
        let cosine: f32 = own.iter().zip(descriptor).map(|(a, b)| a * b).sum();
        alike += u32::from(cosine > 0.999);
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
    let sides: Vec<usize> = sides.collect::<Option<_>>()?;
    ColorImage::try_new(sides[0], sides[1], lines.next()?.to_vec()).ok()
}

fn hash(image: &ColorImage) -> Vec<u8> {
    let mut hash = Sha256::new();
    for y in 0..image.height() {
        (0..image.width()).for_each(|x| hash.update(image.pixel(x, y)));
    }
    hash.finalize().to_vec()
}

#[test]
fn features_are_those_of_the_authors_code() {
    let Some(shared) = shared() else {
        return eprintln!("skipped: no ../shared with the reference of ALIKED");
    };
    let bytes = std::fs::read(shared.join("reference/aliked_n16rot.safetensors")).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let (_, header) = SafeTensors::read_metadata(&bytes).unwrap();
    let meta = header.metadata().as_ref().unwrap()["meta"].clone();
    let meta: Value = serde_json::from_str(&meta).unwrap();
    let aliked = aliked(AlikedOptions { max_features: 5000, ..AlikedOptions::default() });
    for (at, image) in meta["images"].as_array().unwrap().iter().enumerate() {
        let path = shared.join(image["path"].as_str().unwrap());
        let places = floats(&file, &format!("{at}.keypoints"));
        let descriptors = floats(&file, &format!("{at}.descriptors"));
        let own = load::read_color(&path).unwrap();
        let pixels = file.tensor(&format!("{at}.pixels_sha")).unwrap();
        let same = |image: &ColorImage| hash(image) == pixels.data();
        let exact = if same(&own) { Some(own.clone()) } else { by_pillow(&path).filter(same) };
        match exact {
            Some(image_of_reference) => {
                let found = aliked.extract(&image_of_reference).unwrap();
                let n = image["n_keypoints"].as_u64().unwrap() as usize;
                // A score at the threshold may be above it after rounding.
                assert!(found.keypoints.len().abs_diff(n) <= 1, "{at}: {n} keypoints expected");
                let (near, alike) = parity(&found, &places, &descriptors);
                eprintln!("image {at}, the same pixels: {near:.4} near, {alike:.4} of them alike");
                assert!(near >= 0.99 && alike >= 0.99, "{at}: {near}, {alike}");
                scores_are_those(&found, &places, &floats(&file, &format!("{at}.scores")));
            }
            None => eprintln!(
                "image {at}: skipped: Pillow, which has the reference's pixels, is missing"
            ),
        }
        // Another decoder's pixels differ slightly, and more where colors are subsampled.
        let (near, alike) = parity(&aliked.extract(&own).unwrap(), &places, &descriptors);
        eprintln!("image {at}, own decoder: {near:.4} near, {alike:.4} of them alike");
        assert!(near >= 0.8, "{at}: {near}");
    }
}

fn scores_are_those(found: &LearnedFeatures, places: &[f32], scores: &[f32]) {
    for ([x, y], score) in places.as_chunks::<2>().0.iter().zip(scores) {
        let near = |&at: &usize| {
            let [a, b] = found.keypoints[at];
            (a - x).hypot(b - y) < 0.05
        };
        if let Some(at) = (0..found.keypoints.len()).find(near) {
            assert!((found.scores[at] - score).abs() < 1e-3, "{} and {score}", found.scores[at]);
        }
    }
}

#[test]
fn options_choose_the_best_and_sizes_are_undone() {
    let image = waves(200, 136);
    let every = aliked(AlikedOptions { min_score: 0.05, ..AlikedOptions::default() });
    let all = every.extract(&image).unwrap();
    let n = all.keypoints.len();
    assert!(n > 30, "{n}");
    assert_eq!((all.scores.len(), all.descriptors.len()), (n, n * 128));
    for descriptor in all.descriptors.chunks_exact(128) {
        let length: f32 = descriptor.iter().map(|value| value * value).sum();
        assert!((length - 1.0).abs() < 1e-4);
    }
    for &[x, y] in &all.keypoints {
        assert!((0.0..=199.0).contains(&x) && (0.0..=135.0).contains(&y));
    }
    let few =
        aliked(AlikedOptions { min_score: 0.05, max_features: 7, ..AlikedOptions::default() });
    let few = few.extract(&image).unwrap();
    assert_eq!(few.keypoints, all.keypoints[..7]);
    let half = AlikedOptions { min_score: 0.05, max_image_size: 100, ..AlikedOptions::default() };
    let half = aliked(half).extract(&image).unwrap();
    let right = half.keypoints.iter().filter(|[x, _]| *x > 110.0).count();
    assert!(right > 0, "keypoints are in pixels of the image as it was given");
}

#[test]
fn images_without_anything_to_see_have_no_features() {
    let aliked = aliked(AlikedOptions::default());
    for (width, height) in [(1, 1), (5, 3), (1, 200), (64, 64), (97, 33)] {
        for level in [0, 128, 255] {
            let pixels = vec![level; 3 * width * height];
            let flat = ColorImage::try_new(width, height, pixels).unwrap();
            let found = aliked.extract(&flat).unwrap();
            assert_eq!(found.keypoints.len(), 0, "{width} x {height}, {level}");
        }
    }
}

#[test]
fn threads_do_not_change_a_byte() {
    let image = waves(96, 64);
    let aliked = aliked(AlikedOptions { min_score: 0.05, ..AlikedOptions::default() });
    let alone = aliked.extract(&image).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    pool.scope(|scope| {
        for _ in 0..6 {
            scope.spawn(|_| assert_eq!(aliked.extract(&image).unwrap(), alone));
        }
    });
}

#[test]
fn options_out_of_range_are_named() {
    let usual = AlikedOptions::default;
    for (options, expected) in [
        (
            AlikedOptions { max_features: 0, ..usual() },
            "max_features: expected at least 1, found 0",
        ),
        (
            AlikedOptions { min_score: f32::NAN, ..usual() },
            "min_score: expected 0 to below 1, found NaN",
        ),
        (
            AlikedOptions { max_image_size: 0, ..usual() },
            "max_image_size: expected 1 to 65536, found 0",
        ),
    ] {
        assert_eq!(Aliked::try_new(options).err().unwrap().to_string(), expected);
    }
}
