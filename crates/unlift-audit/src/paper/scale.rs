//! Computes meters per unit of a map from the poses that its dataset publishes.

use std::path::{Path, PathBuf};

use unlift_io::Error;
use unlift_io::read::colmap::{Image, read_images};

use super::layouts::Scene;

/// Maximum number of compared cameras, evenly spaced over the map's.
const MOST: usize = 400;
/// Minimum number of pairs of cameras.
const LEAST_PAIRS: usize = 2;
/// A scale this near to 1 is treated as 1: such maps are in the frame of the dataset, up to bundle
/// adjustment.
const SAME: f64 = 0.02;
/// The outer tenths of the ratios of lengths may differ from the median by this share.
const SPREAD: f64 = 0.1;

/// Reads the images of the COLMAP model in `model`; none if the file is missing.
///
/// # Errors
/// If the file cannot be read.
pub fn images(model: &Path) -> Result<(PathBuf, Vec<Image>), Error> {
    let extension = if model.join("points3D.bin").is_file() { "bin" } else { "txt" };
    let path = model.join(format!("images.{extension}"));
    let images = if path.is_file() { read_images(&path)? } else { Vec::new() };
    Ok((path, images))
}

/// Returns the folder that names of a map's images are relative to: that of the scene's photos, or
/// of the scene.
pub fn photos<'a>(images: &[Image], scene: &'a Scene) -> &'a Path {
    let is_root = |root: &&Path| images.iter().any(|image| root.join(name(image)).is_file());
    [&*scene.photos, &*scene.root].into_iter().find(is_root).unwrap_or(&scene.photos)
}

/// Returns meters per unit of the map with these `images` of the file `path`: the ratio of
/// distances between cameras in the dataset and in the map. `None` if fewer than four images have a
/// pose in the dataset.
///
/// # Errors
/// If a pose cannot be read, or the ratios do not agree because the poses are of another scene.
pub fn scale((path, images): &(PathBuf, Vec<Image>), scene: &Scene) -> Result<Option<f64>, Error> {
    let below = scene.photos.strip_prefix(photos(images, scene)).unwrap_or(Path::new(""));
    let mut both = Vec::new();
    let n = images.len().min(MOST);
    for image in (0..n).map(|at| &images[(2 * at + 1) * images.len() / (2 * n)]) {
        let name = name(image);
        let name = Path::new(&name).strip_prefix(below).unwrap_or(Path::new(&name));
        if let Some(center) = scene.poses.center(&name.to_string_lossy())? {
            both.push((image.center, center));
        }
    }
    let mut ratios = ratios(&both);
    if ratios.len() < LEAST_PAIRS {
        return Ok(None);
    }
    ratios.sort_by(f64::total_cmp);
    let at = |share: f64| ratios[(share * (ratios.len() - 1) as f64).round() as usize];
    let (low, middle, high) = (at(0.1), at(0.5), at(0.9));
    if high > (1.0 + SPREAD) * middle || low < (1.0 - SPREAD) * middle {
        let found = format!("ratios from {low:.3} to {high:.3}");
        let expected = "camera distances that have one ratio to those in the dataset";
        return Err(Error::new(path, "", expected, found));
    }
    Ok(Some(if (middle - 1.0).abs() <= SAME { 1.0 } else { middle }))
}

fn name(image: &Image) -> String {
    String::from_utf8_lossy(&image.name).into_owned()
}

type Twice = ([f64; 3], [f64; 3]);

/// Returns ratios of camera distances, dataset to map. Each camera is paired with the one half of
/// all cameras later, because distances of consecutive hand-held frames are too small.
fn ratios(both: &[Twice]) -> Vec<f64> {
    let distance = |a: &[f64; 3], b: &[f64; 3]| {
        a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    };
    let half = both.len() / 2;
    let pairs = both.iter().zip(both.iter().skip(half)).filter(|_| half > 0);
    let ratio = |((a, a_m), (b, b_m)): (&Twice, &Twice)| {
        let (in_map, in_meters) = (distance(a, b), distance(a_m, b_m));
        (in_map > 0.0 && in_meters > 0.0).then(|| in_meters / in_map)
    };
    pairs.filter_map(ratio).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_between_cameras_have_one_ratio() {
        let places = [[0.0, 0.0, 0.0], [1.0, 0.0, 2.0], [0.5, 3.0, 0.0], [4.0, 1.0, 1.0]];
        // Rotated, moved and scaled by three.
        let meters = |[x, y, z]: [f64; 3]| [3.0 * y + 7.0, -3.0 * x, 3.0 * z - 1.0];
        let both: Vec<_> = places.iter().map(|place| (*place, meters(*place))).collect();
        let found = ratios(&both);
        assert_eq!(found.len(), 2);
        assert!(found.iter().all(|ratio| (ratio - 3.0).abs() < 1e-12), "{found:?}");
        assert!(ratios(&both[..1]).is_empty());
        assert!(ratios(&[(places[0], places[1]), (places[0], places[2])]).is_empty());
    }
}
