//! Extracts features of photos and prints the time: `features IMAGE... [--type sift|aliked] [--out FILE] [--threads N] [--max-features N]`.
//!
//! FILE contains for each photo, in order and in little-endian: u32 n, u32 bytes per descriptor,
//! then n times x, y, scale and orientation as f32, then n descriptors. The corner of the first
//! pixel is at (0, 0). A SIFT descriptor is 128 bytes. An ALIKED descriptor is 128 f32, and scale and orientation are 0.

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

use unlift_vision::features::photo::{self, Turn};
use unlift_vision::features::{Extraction, Sift, aliked, in_order};
use unlift_vision::network::Network;

/// The rows of keypoints of a photo, the size of a descriptor, and the bytes of descriptors.
type Raw = (Vec<[f32; 4]>, u32, Vec<u8>);

fn main() -> Result<(), Box<dyn Error>> {
    let (mut images, mut out, mut kind) = (Vec::new(), None, "sift".to_owned());
    let (mut threads, mut max_features) = (0, None);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument}: expected a value"));
        match argument.as_str() {
            "--threads" => threads = value()?.parse()?,
            "--max-features" => max_features = Some(value()?.parse()?),
            "--type" => kind = value()?,
            "--out" => out = Some(value()?),
            _ => images.push(argument),
        }
    }
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    let with_options = |usual: Extraction| Extraction {
        max_features: max_features.unwrap_or(usual.max_features),
        ..usual
    };
    let all = match kind.as_str() {
        "sift" => {
            let sift = Sift::try_new(with_options(Extraction::SIFT))?;
            extract(&images, photo::read, |image| {
                let all = sift.extract(image);
                let rows = all.keypoints.iter().map(|at| [at.x, at.y, at.scale, at.orientation]);
                Ok((rows.collect(), 128, all.descriptors.concat()))
            })?
        }
        "aliked" => {
            let options = with_options(Extraction::ALIKED);
            let network = Network::load("aliked-n16rot")?;
            extract(&images, photo::read_color, |image| {
                let all = aliked(&network, &options, image)?;
                // From the middle of the first pixel to its corner.
                let rows = all.keypoints.iter().map(|[x, y]| [x + 0.5, y + 0.5, 0.0, 0.0]);
                let bytes = all.descriptors.iter().flat_map(|value| value.to_le_bytes());
                Ok((rows.collect(), 4 * all.dim as u32, bytes.collect()))
            })?
        }
        _ => return Err(format!("--type: expected sift or aliked, found {kind:?}").into()),
    };
    let Some(out) = out else { return Ok(()) };
    let mut file = BufWriter::new(File::create(out)?);
    for (keypoints, bytes_per_descriptor, descriptors) in &all {
        file.write_all(&(keypoints.len() as u32).to_le_bytes())?;
        file.write_all(&bytes_per_descriptor.to_le_bytes())?;
        for value in keypoints.iter().flatten() {
            file.write_all(&value.to_le_bytes())?;
        }
        file.write_all(descriptors)?;
    }
    Ok(file.flush()?)
}

/// Extracts the features of all photos, and prints the time of extraction alone.
fn extract<Image: Sync>(
    images: &[String],
    read: impl Fn(&Path, Turn) -> Result<Image, unlift::Error>,
    extract: impl Fn(&Image) -> Result<Raw, unlift::Error> + Sync,
) -> Result<Vec<Raw>, unlift::Error> {
    let images = images.iter().map(|image| read(Path::new(image), Turn::Upright));
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
    let total: usize = all.iter().map(|(keypoints, ..)| keypoints.len()).sum();
    println!("{} images, {total} features, {seconds:.4} s", images.len());
    Ok(all)
}
