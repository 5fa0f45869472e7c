//! Time and memory of each stage from a photo to a compared picture: milliseconds on one thread,
//! and peak memory.
//!
//! `cargo bench -p unlift-vision --bench stages [-- FOLDER]` uses the first eight photos of a
//! folder, by default those of RedKitchen beside the repository, else a synthetic one. Times are
//! medians without a warm-up run. Memory is the largest increase by one photo.

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift_vision::features::{Aliked, AlikedOptions, ColorImage, Sift, SiftOptions, photo};
use unlift_vision::network::DescriptorKind;
use unlift_vision::pictures::{Detector, Inverter, Lpips, Points, feature_image, psnr, ssim};

const PHOTOS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/redkitchen/images");
const MOST: usize = 8;

fn main() {
    // `cargo test --benches` passes `--test`: one synthetic photo is enough.
    let quick = std::env::args().any(|a| a == "--test");
    let folder = std::env::args().skip(1).find(|a| !a.starts_with("--"));
    let photos = match quick {
        true => vec![waves()],
        false => photos(Path::new(folder.as_deref().unwrap_or(PHOTOS))),
    };
    let size = |photo: &ColorImage| format!("{} x {}", photo.width(), photo.height());
    println!("{} photos, the first one of {}\n", photos.len(), size(&photos[0]));
    println!("| stage | ms an image | MiB |\n| --- | --- | --- |");
    let (lpips, detector) = (Lpips::try_new().unwrap(), Detector::try_new().unwrap());
    for kind in [DescriptorKind::Sift, DescriptorKind::Aliked] {
        let name = kind.name();
        let extract = extractor(kind);
        let found = stage(&format!("keypoints, {name}"), &photos, &extract);
        let n = found.iter().map(|found| found.places.len()).sum::<usize>() / photos.len();
        let seen: Vec<(&ColorImage, Keypoints)> = photos.iter().zip(found).collect();
        stage(&format!("feature image, {name} ({n} keypoints)"), &seen, |(photo, found)| {
            feature_image(&found.points(), size_of(photo), kind == DescriptorKind::Sift).unwrap()
        });
        let inverter = Inverter::of(kind).unwrap();
        let painted = stage(&format!("picture, {name}"), &seen, |(photo, found)| {
            inverter.invert(&found.points(), size_of(photo)).unwrap()
        });
        if kind == DescriptorKind::Aliked {
            let pairs: Vec<(ColorImage, ColorImage)> =
                painted.into_iter().zip(&photos).map(|(a, b)| (a, b.halved().unwrap())).collect();
            stage("SSIM", &pairs, |(a, b)| ssim(a, b).unwrap());
            stage("PSNR", &pairs, |(a, b)| psnr(a, b).unwrap());
            stage("LPIPS", &pairs, |(a, b)| lpips.distance(a, b).unwrap());
            stage("objects", &pairs, |(a, _)| detector.find(a, 0.3).unwrap());
        }
    }
}

/// Runs `work` on each of `items`, one after the other, prints time and memory, and returns the
/// results.
fn stage<T, R>(name: &str, items: &[T], work: impl Fn(&T) -> R) -> Vec<R> {
    let (mut times, mut made, mut most) = (Vec::new(), Vec::new(), Some(0));
    // The first item runs twice: its first run allocates memory that later runs reuse.
    for (at, item) in items[..1].iter().chain(items).enumerate() {
        let is_reset = std::fs::write("/proc/self/clear_refs", "5").is_ok();
        let before = kib("VmRSS:").filter(|_| is_reset);
        let started = Instant::now();
        let result = black_box(work(item));
        if at > 0 {
            times.push(started.elapsed().as_secs_f64() * 1e3);
            made.push(result);
        }
        let grown = before.zip(kib("VmHWM:")).map(|(before, peak)| peak.saturating_sub(before));
        most = most.zip(grown).map(|(most, grown)| grown.max(most));
    }
    times.sort_by(f64::total_cmp);
    let memory = most.map_or("unknown".to_owned(), |kib| format!("{:.0}", kib as f64 / 1024.0));
    println!("| {name} | {:.1} | {memory} |", times[times.len() / 2]);
    made
}

/// Reads the entry `name` of this process in kibibytes (Linux).
fn kib(name: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with(name))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// Keypoints of a photo, all with weight 1.
struct Keypoints {
    places: Vec<[f32; 2]>,
    descriptors: Descriptors,
    weights: Vec<f32>,
}

impl Keypoints {
    fn points(&self) -> Points<'_> {
        let Self { places, descriptors, weights } = self;
        Points { places, descriptors, weights, depths: None }
    }
}

fn extractor(kind: DescriptorKind) -> Box<dyn Fn(&ColorImage) -> Keypoints> {
    let keypoints = |places: Vec<[f32; 2]>, descriptors| {
        let weights = vec![1.0; places.len()];
        Keypoints { places, descriptors, weights }
    };
    match kind {
        DescriptorKind::Sift => {
            let sift = Sift::try_new(SiftOptions::default()).unwrap();
            Box::new(move |photo| {
                let found = sift.extract(&photo.gray().unwrap());
                let places = found.keypoints.iter().map(|one| [one.x - 0.5, one.y - 0.5]).collect();
                let values = found.descriptors.iter().flatten().copied().collect();
                keypoints(places, Descriptors::try_new(Values::U8(values), 128).unwrap())
            })
        }
        _ => {
            let aliked = Aliked::try_new(AlikedOptions::default()).unwrap();
            Box::new(move |photo| {
                let found = aliked.extract(photo).unwrap();
                let values = Values::F32(found.descriptors);
                keypoints(found.keypoints, Descriptors::try_new(values, found.dim).unwrap())
            })
        }
    }
}

fn size_of(photo: &ColorImage) -> [usize; 2] {
    [photo.width(), photo.height()]
}

fn photos(folder: &Path) -> Vec<ColorImage> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        println!("no photos in {}: a made-up one", folder.display());
        return vec![waves()];
    };
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    if paths.is_empty() {
        return vec![waves()];
    }
    paths.iter().take(MOST).map(|path| photo::read_color(path).unwrap()).collect()
}

/// Creates a synthetic photo with keypoints.
fn waves() -> ColorImage {
    let pixel = |x: usize, y: usize| {
        let (x, y) = (x as f32, y as f32);
        let wave = (x / 5.0).sin() * (y / 7.0).cos() + (x * y / 900.0).sin();
        [0.0, 20.0, 40.0].map(|more| (107.0 + more + 40.0 * wave) as u8)
    };
    let pixels = (0..480).flat_map(|y| (0..640).flat_map(move |x| pixel(x, y))).collect();
    ColorImage::try_new(640, 480, pixels).unwrap()
}
