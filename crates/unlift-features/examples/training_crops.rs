//! Makes what networks of neighborhoods are trained on, from photos: `training_crops OUT LIST [--seed N]
//! [--sizes 128,256,384] [--share 1.0] [--max-image-size 3200] [--whole N]`.
//!
//! LIST names a photo per line. A crop is `n` keypoints of one photo, near each other; OUT gets a folder per `n` with
//! files that go on from crop to crop, little-endian: `descriptors.u8` `(crops, n, 128)`, `places.f32` `(crops, n, 2)`
//! in pixels, `pairs.i16` `(crops, 3, n, n)` (`neighbors::dense`, in 1/1024) and `photos.u32` `(crops,)`, the line of
//! LIST. `--share` is how many of a photo's keypoints stand in its crops, on average. `--whole N`: one crop per photo,
//! the N keypoints nearest the middle, or all; a folder per photo, named by its line.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs::{File, OpenOptions, create_dir_all};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use unlift::descriptors::Values;
use unlift::neighbors::dense;
use unlift::seed::{Draws, Stage};
use unlift_features::batch::in_order;
use unlift_features::{Features, Sift, SiftOptions, load};

/// Steps of a pair score per standard deviation.
const STEPS: f32 = 1024.0;

struct Options {
    seed: u64,
    sizes: Vec<usize>,
    share: f64,
    whole: Option<usize>,
}

struct Crop {
    photo: u32,
    places: Vec<[f32; 2]>,
    descriptors: Vec<u8>,
    pairs: Vec<f32>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut options = Options { seed: 0, sizes: vec![128, 256, 384], share: 1.0, whole: None };
    let (mut sift, mut paths) = (SiftOptions::default(), Vec::new());
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument}: expected a value"));
        match argument.as_str() {
            "--seed" => options.seed = value()?.parse()?,
            "--sizes" => {
                options.sizes = value()?.split(',').map(str::parse).collect::<Result<_, _>>()?;
            }
            "--share" => options.share = value()?.parse()?,
            "--max-image-size" => sift.max_image_size = value()?.parse()?,
            "--whole" => options.whole = Some(value()?.parse()?),
            _ => paths.push(PathBuf::from(argument)),
        }
    }
    let [out, list] = paths.as_slice() else { return Err("expected OUT and LIST".into()) };
    let photos = std::fs::read_to_string(list)?;
    let photos: Vec<(u32, &str)> = (0..).zip(photos.lines()).collect();
    let sift = Sift::try_new(sift)?;
    let mut folders = BTreeMap::new();
    let mut n_keypoints = 0;
    let crops = |&(photo, path): &(u32, &str)| -> Result<Vec<Crop>, unlift::Error> {
        let features = sift.extract(&load::read(Path::new(path))?);
        chosen(&features, photo, &options).iter().map(|rows| crop(&features, photo, rows)).collect()
    };
    in_order(&photos, crops, |_, crops| -> Result<(), Box<dyn Error>> {
        for crop in crops? {
            let n = crop.places.len();
            let name = options.whole.map_or(n.to_string(), |_| format!("{:04}", crop.photo));
            if !folders.contains_key(&name) {
                folders.insert(name.clone(), Folder::new(&out.join(&name))?);
            }
            folders.get_mut(&name).ok_or("no folder")?.add(&crop)?;
            n_keypoints += n;
        }
        if options.whole.is_some() {
            folders.clear();
        }
        Ok(())
    })?;
    println!("{} photos, {n_keypoints} keypoints in crops", photos.len());
    Ok(())
}

/// The rows of each crop of a photo.
fn chosen(features: &Features, photo: u32, options: &Options) -> Vec<Vec<u32>> {
    let n = features.keypoints.len();
    if let Some(most) = options.whole {
        let extent = |of: fn(&unlift_features::Keypoint) -> f32| {
            let values = features.keypoints.iter().map(of);
            values.fold((f32::MAX, f32::MIN), |(low, high), x| (low.min(x), high.max(x)))
        };
        let (x, y) = (extent(|k| k.x), extent(|k| k.y));
        let middle = [(x.0 + x.1) / 2.0, (y.0 + y.1) / 2.0];
        return if n < 64 { Vec::new() } else { vec![nearest(features, middle, 1.0, most.min(n))] };
    }
    let mut draws = Draws::new(options.seed, Stage::Subset, u64::from(photo));
    let mut crops = Vec::new();
    // Every size gets its part of the photo; the last crop by chance.
    for &size in options.sizes.iter().filter(|&&size| size <= n) {
        let wanted = options.share * n as f64 / size as f64 / options.sizes.len() as f64;
        for _ in 0..(wanted + draws.unit()).floor() as usize {
            let anchor = features.keypoints[draws.below(n as u64) as usize];
            let stretch = libm::exp(draws.between(-0.7, 0.7)) as f32;
            crops.push(nearest(features, [anchor.x, anchor.y], stretch, size));
        }
    }
    crops
}

/// The `most` keypoints nearest `place`, by the larger of the distances along the axes, of which that along y is
/// stretched.
fn nearest(features: &Features, place: [f32; 2], stretch: f32, most: usize) -> Vec<u32> {
    let distance = |row: &u32| {
        let keypoint = features.keypoints[*row as usize];
        (keypoint.x - place[0]).abs().max((keypoint.y - place[1]).abs() * stretch)
    };
    let mut rows: Vec<u32> = (0..features.keypoints.len() as u32).collect();
    rows.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    rows.truncate(most);
    rows
}

fn crop(features: &Features, photo: u32, rows: &[u32]) -> Result<Crop, unlift::Error> {
    let place = |&row: &u32| features.keypoints[row as usize];
    let places = rows.iter().map(|row| [place(row).x, place(row).y]).collect();
    let descriptors: Vec<u8> =
        rows.iter().flat_map(|&row| features.descriptors[row as usize]).collect();
    let matrix = unlift::Descriptors::try_new(Values::U8(descriptors.clone()), 128)?;
    Ok(Crop { photo, places, descriptors, pairs: dense(&matrix)?.into_scores() })
}

/// Files of crops of one size.
struct Folder {
    files: [BufWriter<File>; 4],
}

impl Folder {
    fn new(path: &Path) -> std::io::Result<Self> {
        create_dir_all(path)?;
        let open = |name: &str| {
            let file = OpenOptions::new().create(true).append(true).open(path.join(name))?;
            Ok::<_, std::io::Error>(BufWriter::new(file))
        };
        let files =
            [open("descriptors.u8")?, open("places.f32")?, open("pairs.i16")?, open("photos.u32")?];
        Ok(Self { files })
    }

    fn add(&mut self, crop: &Crop) -> std::io::Result<()> {
        let [descriptors, places, pairs, photos] = &mut self.files;
        descriptors.write_all(&crop.descriptors)?;
        for value in crop.places.iter().flatten() {
            places.write_all(&value.to_le_bytes())?;
        }
        for score in &crop.pairs {
            pairs.write_all(&((score * STEPS).round() as i16).to_le_bytes())?;
        }
        photos.write_all(&crop.photo.to_le_bytes())
    }
}
