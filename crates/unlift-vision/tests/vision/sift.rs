//! SIFT on synthetic images with known keypoints.

use std::f32::consts::{FRAC_PI_2, TAU};

use rayon::prelude::*;
use unlift_vision::features::{Extraction, Features, GrayImage, Keypoint, Sift};

/// An image of Gaussian blobs `(x, y, sigma, height)`, in COLMAP's pixel convention.
fn blobs(width: usize, height: usize, blobs: &[(f32, f32, f32, f32)]) -> GrayImage {
    let value = |i: usize| {
        let (x, y) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        let blob = |&(at_x, at_y, sigma, height): &(f32, f32, f32, f32)| {
            let (dx, dy) = ((x - at_x) / sigma, (y - at_y) / sigma);
            height * (-0.5 * (dx * dx + dy * dy)).exp()
        };
        0.4 + blobs.iter().map(blob).sum::<f32>()
    };
    GrayImage::try_new(width, height, (0..width * height).map(value).collect()).unwrap()
}

/// Creates a substitute for a photo: many blobs of all sizes, the same on every machine.
fn scene(width: usize, height: usize) -> GrayImage {
    let spots: Vec<_> = (0..width * height / 150)
        .map(|i| {
            // Fractional parts of multiples of irrational numbers are evenly distributed.
            let part = |by: f64| (i as f64 * by).fract() as f32;
            let (x, y) = (part(0.754_877_666_2), part(0.569_840_290_9));
            let sigma = 1.0 + 5.0 * part(0.618_033_988_7) * part(0.414_213_562_4);
            (x * width as f32, y * height as f32, sigma, 0.6 * part(0.302_775_637_7) - 0.3)
        })
        .collect();
    blobs(width, height, &spots)
}

/// Rotates the image by 90 degrees so that `(x, y)` moves to `(height - y, x)`.
fn turned(image: &GrayImage) -> GrayImage {
    let (width, height) = (image.height(), image.width());
    let value = |i: usize| image.row(width - 1 - i % width)[i / width];
    GrayImage::try_new(width, height, (0..width * height).map(value).collect()).unwrap()
}

type Row<'a> = (&'a Keypoint, &'a [u8; 128]);

fn rows(features: &Features) -> impl Iterator<Item = Row<'_>> {
    features.keypoints.iter().zip(&features.descriptors)
}

/// Returns true if features agree within half a pixel, 5 % of scale, 5 degrees and 0.1.
fn alike((a, of_a): Row<'_>, (b, of_b): Row<'_>) -> bool {
    let length =
        |bytes: &[u8; 128]| bytes.iter().map(|&x| f32::from(x).powi(2)).sum::<f32>().sqrt();
    let (length_a, length_b) = (length(of_a), length(of_b));
    let apart = |(&a, &b): (&u8, &u8)| f32::from(a) / length_a - f32::from(b) / length_b;
    let distance = of_a.iter().zip(of_b).map(|pair| apart(pair).powi(2)).sum::<f32>().sqrt();
    let turn = (a.orientation - b.orientation).rem_euclid(TAU);
    (a.x - b.x).hypot(a.y - b.y) < 0.5
        && (a.scale / b.scale).ln().abs() < 0.05
        && turn.min(TAU - turn) < 5_f32.to_radians()
        && distance < 0.1
}

#[test]
fn a_blob_gives_a_keypoint_at_its_center_with_its_scale() {
    // At smoothing s the middle of the blob has 1 / (sigma^2 + s^2 - 0.25) of its height times
    // sigma^2, because photos are assumed to be smoothed by 0.5. The difference to k s, where k is
    // the step of levels, is largest at s^2 = (sigma^2 - 0.25) / k.
    let step = 2_f32.powf(1.0 / 3.0);
    for (sigma, contrast) in [(1.5, 0.4_f32), (2.6, -0.35), (4.0, 0.4), (7.0, -0.3), (10.0, 0.4)] {
        // Not midway between pixels of any octave, where two are equally high.
        for (x, y) in [(60.3, 70.1), (63.2, 57.9)] {
            let image = blobs(128, 128, &[(x, y, sigma, contrast)]);
            let features = Sift::default().extract(&image);
            let best = features
                .keypoints
                .iter()
                .min_by(|a, b| (a.x - x).hypot(a.y - y).total_cmp(&(b.x - x).hypot(b.y - y)))
                .unwrap_or_else(|| panic!("nothing at sigma {sigma}"));
            assert!((best.x - x).hypot(best.y - y) < 0.03 * sigma, "sigma {sigma}: {best:?}");
            let expected = ((sigma * sigma - 0.25) / step).sqrt();
            assert!((best.scale / expected - 1.0).abs() < 0.05, "sigma {sigma}: {best:?}");
        }
    }
}

#[test]
fn turning_the_image_turns_keypoints_and_keeps_descriptors() {
    // Halving keeps every second pixel: the same ones of the rotated image if sides are 8 n + 1.
    let image = scene(321, 241);
    let sift = Sift::default();
    let (upright, mut expected) = (sift.extract(&image), sift.extract(&turned(&image)));
    assert!(upright.keypoints.len() > 100, "{}", upright.keypoints.len());
    // Inverse: (x', y') = (height - y, x), and directions by a quarter turn.
    for keypoint in &mut expected.keypoints {
        (keypoint.x, keypoint.y) = (keypoint.y, image.height() as f32 - keypoint.x);
        keypoint.orientation -= FRAC_PI_2;
    }
    // Doubling repeats the last pixel, so borders differ.
    let is_kept = |keypoint: &Keypoint| {
        let rim = 12.0 * keypoint.scale;
        // Which two of several orientations are kept depends on where directions are counted from.
        let twins = expected.keypoints.iter().filter(|other| other.x == keypoint.x).count();
        let inside = keypoint.x.min(321.0 - keypoint.x).min(keypoint.y).min(241.0 - keypoint.y);
        inside > rim && twins == 1
    };
    let kept: Vec<Row<'_>> = rows(&expected).filter(|row| is_kept(row.0)).collect();
    let n_alike = kept.iter().filter(|&&a| rows(&upright).any(|b| alike(a, b))).count();
    assert!(kept.len() > 50 && n_alike as f64 > 0.99 * kept.len() as f64, "{n_alike}");
}

#[test]
fn images_without_structure_have_no_features() {
    let sift = Sift::default();
    for (width, height) in [(1, 1), (1, 40), (2, 2), (3, 3), (5, 7), (16, 9), (64, 64)] {
        let flat = GrayImage::try_new(width, height, vec![0.5; width * height]).unwrap();
        assert_eq!(sift.extract(&flat), Features::default(), "{width} x {height}");
        // Noise in an image of any size must not fail.
        let value = |i: usize| ((i * 7919) % 13) as f32 / 13.0;
        let noise = (0..width * height).map(value).collect();
        let features = sift.extract(&GrayImage::try_new(width, height, noise).unwrap());
        assert_eq!(features.keypoints.len(), features.descriptors.len());
    }
}

#[test]
fn features_are_kept_from_the_coarsest_level_on_and_levels_whole() {
    let image = scene(256, 256);
    let all = Sift::default().extract(&image);
    let mut last = all.keypoints.len();
    let mut fewer = 0;
    for max_features in [400, 200, 100, 50, 10, 1] {
        let options = Extraction { max_features, ..Extraction::SIFT };
        let some = Sift::try_new(options).unwrap().extract(&image);
        let n = some.keypoints.len();
        // The coarsest features, unchanged, in the same order, and at least the requested number.
        assert_eq!(some.keypoints, all.keypoints[all.keypoints.len() - n..]);
        assert_eq!(some.descriptors, all.descriptors[all.descriptors.len() - n..]);
        assert!(n > max_features && n <= last, "{max_features}: {n}");
        fewer += usize::from(n < last);
        last = n;
    }
    assert!(fewer >= 3, "levels are dropped one by one");
}

#[test]
fn an_image_that_is_too_large_is_shrunk_and_keypoints_are_not() {
    let image = blobs(200, 150, &[(80.5, 70.5, 8.0, 0.4)]);
    let options = Extraction { max_image_size: 100, ..Extraction::SIFT };
    let features = Sift::try_new(options).unwrap().extract(&image);
    let best = features.keypoints[0];
    assert!((best.x - 80.5).hypot(best.y - 70.5) < 0.5, "{best:?}");
    assert!((best.scale / 8.0 - 1.0).abs() < 0.15, "{best:?}");
}

#[test]
fn used_buffers_and_threads_do_not_change_a_byte() {
    let sizes = [(90, 70), (64, 100), (33, 31), (120, 80)];
    let images: Vec<_> = sizes.repeat(3).into_iter().map(|(x, y)| scene(x, y)).collect();
    let sift = Sift::default();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(4).build().unwrap();
    pool.install(|| {
        images.par_iter().for_each(|image| {
            assert_eq!(sift.extract(image), Sift::default().extract(image));
        });
    });
}

#[test]
fn features_are_the_same_bits_everywhere() {
    // Values that are exact on every machine: discs on a checkerboard.
    let value = |i: usize| {
        let (x, y) = (i % 150, i / 150);
        let (dx, dy) = ((x % 29).abs_diff(14), (y % 23).abs_diff(11));
        let disc = dx * dx + dy * dy < 20 + (x / 29) * 9 + (y / 23) * 5;
        u8::from(disc) * 90 + 60 + ((x * x / 70 + y * 3) % 64) as u8
    };
    let bytes: Vec<u8> = (0..150 * 110).map(value).collect();
    let image = GrayImage::from_bytes(150, 110, &bytes).unwrap();
    let features = Sift::default().extract(&image);
    // FNV-1a over all bytes.
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut mix = |byte: u8| hash = (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
    for keypoint in &features.keypoints {
        for value in [keypoint.x, keypoint.y, keypoint.scale, keypoint.orientation] {
            value.to_le_bytes().into_iter().for_each(&mut mix);
        }
    }
    features.descriptors.iter().flatten().for_each(|&byte| mix(byte));
    assert_eq!((features.keypoints.len(), hash), (117, 15_136_636_572_972_869_078));
}
