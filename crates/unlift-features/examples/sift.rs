//! Extracts features of photos and prints the time: `sift IMAGE... [--out FILE] [--threads N]
//! [--max-features N]`.
//!
//! FILE contains for each photo, in order and in little-endian: u32 n, then n times x, y, scale and
//! orientation as f32, then n descriptors of 128 bytes.

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

use unlift_features::batch::in_order;
use unlift_features::{Features, GrayImage, Sift, SiftOptions, load};

fn main() -> Result<(), Box<dyn Error>> {
    let (mut images, mut out, mut threads) = (Vec::new(), None, 0);
    let mut options = SiftOptions::default();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument}: expected a value"));
        match argument.as_str() {
            "--out" => out = Some(value()?),
            "--threads" => threads = value()?.parse()?,
            "--max-features" => options.max_features = value()?.parse()?,
            _ => images.push(load::read(Path::new(&argument))?),
        }
    }
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    let sift = Sift::try_new(options)?;
    // A warm-up run, as for the compared extractors.
    if let Some(image) = images.first() {
        sift.extract(image);
    }
    let start = Instant::now();
    let mut all: Vec<Features> = Vec::new();
    in_order(
        &images,
        |image: &GrayImage| sift.extract(image),
        |_, features| {
            all.push(features);
            Ok::<(), std::convert::Infallible>(())
        },
    )?;
    let seconds = start.elapsed().as_secs_f64();
    let total: usize = all.iter().map(|features| features.keypoints.len()).sum();
    println!("{} images, {total} features, {seconds:.4} s", images.len());
    if let Some(path) = out {
        let mut file = BufWriter::new(File::create(path)?);
        for features in &all {
            write(features, &mut file)?;
        }
        file.flush()?;
    }
    Ok(())
}

fn write(features: &Features, file: &mut impl Write) -> std::io::Result<()> {
    file.write_all(&(features.keypoints.len() as u32).to_le_bytes())?;
    for keypoint in &features.keypoints {
        for value in [keypoint.x, keypoint.y, keypoint.scale, keypoint.orientation] {
            file.write_all(&value.to_le_bytes())?;
        }
    }
    features.descriptors.iter().try_for_each(|descriptor| file.write_all(descriptor))
}
