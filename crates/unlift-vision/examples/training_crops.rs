//! Makes the training data of the networks of `learned` from photos: `training_crops OUT LIST
//! [--type sift|aliked|superpoint] [--seed N] [--sizes 128,256,384] [--share 1.0] [--max-image-size N] [--whole N]`.
//!
//! LIST names a photo per line. A crop is `n` neighboring keypoints of one photo. OUT gets a folder
//! per `n` with files to which crops are appended, little-endian: `descriptors.u8`
//! `(crops, n, dim)` of SIFT, `descriptors.f32` of others, `places.f32` `(crops, n, 2)` in pixels,
//! `pairs.i16` `(crops, reaches, n, n)` (`neighbors::dense`, in 1/1024; except for SIFT in standard
//! deviations of the whole photo) and `photos.u32` `(crops,)`, the line of LIST. `--share` is the
//! average number of crops that contain a keypoint. `--whole N`: one crop per photo, the N
//! keypoints nearest the middle, or all; a folder per photo, named by its line.

use std::error::Error;
use std::fs::{OpenOptions, create_dir_all};
use std::io::Write;
use std::path::{Path, PathBuf};

use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift::neighbors::{dense, usual};
use unlift::seed::{Draws, Stage};
use unlift_vision::features::{Extraction, Extractor, Photo, in_order};

/// Steps of a pair score per standard deviation.
const STEPS: f32 = 1024.0;

struct Options {
    seed: u64,
    sizes: Vec<usize>,
    share: f64,
    whole: Option<usize>,
}

struct Features {
    places: Vec<[f32; 2]>,
    descriptors: Descriptors,
    /// Except for SIFT: the statistics of each keypoint's scores with all others of the photo.
    usual: Option<Vec<(f64, f64)>>,
}

struct Crop {
    photo: u32,
    places: Vec<[f32; 2]>,
    descriptors: Descriptors,
    pairs: Vec<f32>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut options = Options { seed: 0, sizes: vec![128, 256, 384], share: 1.0, whole: None };
    let (mut kind, mut max_image_size, mut paths) = ("sift".to_owned(), None, Vec::new());
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument}: expected a value"));
        match argument.as_str() {
            "--seed" => options.seed = value()?.parse()?,
            "--sizes" => {
                options.sizes = value()?.split(',').map(str::parse).collect::<Result<_, _>>()?;
            }
            "--share" => options.share = value()?.parse()?,
            "--type" => kind = value()?,
            "--max-image-size" => max_image_size = Some(value()?.parse()?),
            "--whole" => options.whole = Some(value()?.parse()?),
            _ => paths.push(PathBuf::from(argument)),
        }
    }
    let [out, list] = paths.as_slice() else { return Err("expected OUT and LIST".into()) };
    let photos = std::fs::read_to_string(list)?;
    let photos: Vec<(u32, &str)> = (0..).zip(photos.lines()).collect();
    let extractor = Extractor::try_new(&extraction(&kind, max_image_size)?)?;
    let mut n_keypoints = 0;
    let crops = |&(photo, path): &(u32, &str)| -> Result<Vec<Crop>, Box<dyn Error + Send + Sync>> {
        let extracted = extractor.read(Path::new(path))?;
        let Some(features) = features(extracted)? else { return Ok(Vec::new()) };
        let rows = chosen(&features, photo, &options);
        Ok(rows.iter().map(|rows| crop(&features, photo, rows)).collect::<Result<_, _>>()?)
    };
    in_order(&photos, crops, |_, crops| -> Result<(), Box<dyn Error>> {
        for crop in crops.map_err(|error| error.to_string())? {
            let n = crop.places.len();
            let name = options.whole.map_or(n.to_string(), |_| format!("{:04}", crop.photo));
            append(&out.join(name), &crop)?;
            n_keypoints += n;
        }
        Ok(())
    })?;
    println!("{} photos, {n_keypoints} keypoints in crops", photos.len());
    Ok(())
}

fn extraction(kind: &str, max_image_size: Option<usize>) -> Result<Extraction, String> {
    let usual = match kind {
        "sift" => Extraction::SIFT,
        "aliked" => Extraction { min_score: 0.0, ..Extraction::ALIKED },
        "superpoint" => Extraction::SUPERPOINT,
        _ => return Err(format!("--type: expected sift, aliked or superpoint, found {kind:?}")),
    };
    Ok(Extraction { max_image_size: max_image_size.unwrap_or(usual.max_image_size), ..usual })
}

/// Converts the features of a photo; `None` if there are too few.
fn features(photo: Photo) -> Result<Option<Features>, unlift::Error> {
    let places = photo.keypoints;
    if places.len() < 64 {
        return Ok(None);
    }
    let descriptors = Descriptors::try_new(photo.descriptors, photo.dim)?;
    let is_sift = matches!(descriptors.values(), Values::U8(_));
    let usual = if is_sift { None } else { Some(usual(&descriptors)?) };
    Ok(Some(Features { places, descriptors, usual }))
}

/// Chooses the rows of each crop of a photo.
fn chosen(features: &Features, photo: u32, options: &Options) -> Vec<Vec<u32>> {
    let n = features.places.len();
    if let Some(n_points) = options.whole {
        let extent = |axis: usize| {
            let values = features.places.iter().map(|place| place[axis]);
            values.fold((f32::MAX, f32::MIN), |(low, high), x| (low.min(x), high.max(x)))
        };
        let middle = [0, 1].map(extent).map(|(low, high)| (low + high) / 2.0);
        return vec![nearest(features, middle, 1.0, n_points.min(n))];
    }
    let mut draws = Draws::new(options.seed, Stage::Subset, u64::from(photo));
    let mut crops = Vec::new();
    // All sizes get equal parts of the photo; chance rounds the number of crops.
    for &size in options.sizes.iter().filter(|&&size| size <= n) {
        let wanted = options.share * n as f64 / size as f64 / options.sizes.len() as f64;
        for _ in 0..(wanted + draws.unit()).floor() as usize {
            let anchor = features.places[draws.below(n as u64) as usize];
            let stretch = libm::exp(draws.between(-0.7, 0.7)) as f32;
            crops.push(nearest(features, anchor, stretch, size));
        }
    }
    crops
}

/// Returns the `n` keypoints nearest `place` in the larger of x and y times `stretch`.
fn nearest(features: &Features, place: [f32; 2], stretch: f32, n: usize) -> Vec<u32> {
    let distance = |row: &u32| {
        let [x, y] = features.places[*row as usize];
        (x - place[0]).abs().max((y - place[1]).abs() * stretch)
    };
    let mut rows: Vec<u32> = (0..features.places.len() as u32).collect();
    rows.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    rows.truncate(n);
    rows
}

fn crop(features: &Features, photo: u32, rows: &[u32]) -> Result<Crop, unlift::Error> {
    let of_rows =
        |all: &Vec<(f64, f64)>| -> Vec<_> { rows.iter().map(|&row| all[row as usize]).collect() };
    let usual = features.usual.as_ref().map(of_rows);
    let descriptors = features.descriptors.select(rows);
    let pairs = dense(&descriptors, usual.as_deref())?;
    let places = rows.iter().map(|&row| features.places[row as usize]).collect();
    Ok(Crop { photo, places, descriptors, pairs })
}

/// Appends a crop to the files in `folder`.
fn append(folder: &Path, crop: &Crop) -> std::io::Result<()> {
    create_dir_all(folder)?;
    let write = |name: &str, bytes: &[u8]| {
        OpenOptions::new().create(true).append(true).open(folder.join(name))?.write_all(bytes)
    };
    let floats = |values: &[f32]| -> Vec<u8> {
        values.iter().flat_map(|value| value.to_le_bytes()).collect()
    };
    match crop.descriptors.values() {
        Values::U8(values) => write("descriptors.u8", values)?,
        Values::F32(values) => write("descriptors.f32", &floats(values))?,
    }
    let steps = crop.pairs.iter().map(|score| (score * STEPS).round() as i16);
    write("places.f32", &floats(crop.places.as_flattened()))?;
    write("pairs.i16", &steps.flat_map(i16::to_le_bytes).collect::<Vec<u8>>())?;
    write("photos.u32", &crop.photo.to_le_bytes())
}
