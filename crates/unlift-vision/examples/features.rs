//! Extracts features of photos and prints the time: `features IMAGE... [--type sift|aliked]
//! [--out FILE] [--threads N] [--max-features N]`.
//!
//! FILE contains for each photo, in order and in little-endian: u32 n, u32 bytes per descriptor,
//! then n times x, y, scale and orientation as f32, then n descriptors. The corner of the first
//! pixel is at (0, 0). A SIFT descriptor is 128 bytes. An ALIKED descriptor is 128 f32, and scale
//! and orientation are 0.

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use unlift_vision::features::in_order;
use unlift_vision::features::{
    Aliked, Features, LearnedFeatures, LearnedOptions, Sift, SiftOptions, photo,
};

#[derive(Default)]
struct Options {
    images: Vec<String>,
    out: Option<String>,
    threads: usize,
    max_features: Option<usize>,
}

/// The features of a photo.
struct Raw {
    keypoints: Vec<[f32; 4]>,
    bytes_per_descriptor: u32,
    descriptors: Vec<u8>,
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let (mut options, mut kind) = (Options::default(), "sift".to_owned());
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument}: expected a value"));
        let mut number = || -> Result<usize, String> {
            let value = value()?;
            value.parse().map_err(|_| format!("{argument}: expected a number, found {value:?}"))
        };
        match argument.as_str() {
            "--threads" => options.threads = number()?,
            "--max-features" => options.max_features = Some(number()?),
            "--type" => kind = value()?,
            "--out" => options.out = Some(value()?),
            _ => options.images.push(argument),
        }
    }
    rayon::ThreadPoolBuilder::new().num_threads(options.threads).build_global()?;
    match kind.as_str() {
        "sift" => {
            let mut of = SiftOptions::default();
            of.max_features = options.max_features.unwrap_or(of.max_features);
            let sift = Sift::try_new(of)?;
            extract(&options, photo::read, |image| Ok(raw(&sift.extract(image))))
        }
        "aliked" => {
            let mut of = LearnedOptions::ALIKED;
            of.max_features = options.max_features.unwrap_or(of.max_features);
            let aliked = Aliked::try_new(of)?;
            extract(&options, photo::read_color, |image| Ok(raw_learned(&aliked.extract(image)?)))
        }
        _ => Err(format!("--type: expected sift or aliked, found {kind:?}").into()),
    }
}

/// Extracts the features of all photos, prints the time of extraction alone, and writes FILE.
fn extract<Image: Sync>(
    options: &Options,
    read: impl Fn(&Path) -> Result<Image, unlift::Error>,
    extract: impl Fn(&Image) -> Result<Raw, unlift::Error> + Sync,
) -> Result<(), Box<dyn Error>> {
    let images = options.images.iter().map(|image| read(Path::new(image)));
    let images: Vec<Image> = images.collect::<Result<_, _>>()?;
    // A warm-up run, as for the compared extractors.
    images.first().map(&extract).transpose()?;
    let start = Instant::now();
    let mut all = Vec::new();
    in_order(&images, &extract, |_, raw| {
        all.push(raw?);
        Ok::<(), unlift::Error>(())
    })?;
    let seconds = start.elapsed().as_secs_f64();
    let total: usize = all.iter().map(|raw| raw.keypoints.len()).sum();
    println!("{} images, {total} features, {seconds:.4} s", images.len());
    if let Some(path) = &options.out {
        let mut file = BufWriter::new(File::create(path)?);
        for raw in &all {
            file.write_all(&(raw.keypoints.len() as u32).to_le_bytes())?;
            file.write_all(&raw.bytes_per_descriptor.to_le_bytes())?;
            for value in raw.keypoints.iter().flatten() {
                file.write_all(&value.to_le_bytes())?;
            }
            file.write_all(&raw.descriptors)?;
        }
        file.flush()?;
    }
    Ok(())
}

fn raw(found: &Features) -> Raw {
    let keypoints = found.keypoints.iter().map(|at| [at.x, at.y, at.scale, at.orientation]);
    Raw {
        keypoints: keypoints.collect(),
        bytes_per_descriptor: 128,
        descriptors: found.descriptors.concat(),
    }
}

/// Converts positions from the middle of the first pixel to its corner.
fn raw_learned(found: &LearnedFeatures) -> Raw {
    let keypoints = found.keypoints.iter().map(|[x, y]| [x + 0.5, y + 0.5, 0.0, 0.0]);
    Raw {
        keypoints: keypoints.collect(),
        bytes_per_descriptor: 4 * found.dim as u32,
        descriptors: found.descriptors.iter().flat_map(|value| value.to_le_bytes()).collect(),
    }
}
