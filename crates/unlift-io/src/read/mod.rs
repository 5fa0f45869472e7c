//! Reads maps in many formats as positions, ids and camera centers.

pub(crate) mod archive;
mod bundler;
pub(crate) mod bytes;
mod cameras;
pub mod colmap;
mod descriptors;
mod json;
pub(crate) mod lines;
mod map_input;
mod models;
pub(crate) mod npy;
mod nvm;
mod ply;
mod table;

use std::path::{Path, PathBuf};

pub use cameras::Cameras;
pub use descriptors::{Alike, descriptors};
pub use map_input::Input;

use crate::error::Error;
use crate::input;
use models::Model;

/// Reads the map at `path`.
///
/// `path` is a COLMAP model folder, a project folder that contains one (of several, the one with the most points), a map of
/// OpenSfM, nerfstudio, Bundler or VisualSFM (NVM), or a point cloud; `EXPECTED` lists the extensions. Points whose coordinates are
/// not finite are left out and counted.
///
/// # Errors
/// When nothing readable is there, a file is malformed, or no point has finite coordinates.
pub fn open(path: &Path) -> Result<Input, Error> {
    let metadata = std::fs::metadata(path).map_err(|e| Error::read(path, e))?;
    let input = if metadata.is_dir() { folder(path)? } else { file(path)? };
    let input = input.settle();
    if input.positions.is_empty() {
        let file = input.files.last().map_or(path, PathBuf::as_path);
        let (expected, found) = match input.left_out.len() {
            0 => ("at least one point", "none".to_owned()),
            n => ("a point with a place", format!("{n} without one")),
        };
        return Err(Error::new(file, "", expected, found));
    }
    Ok(input)
}

/// Returns true if `path` is a folder in which [`open`] finds a map.
pub fn is_project(path: &Path) -> bool {
    path.is_dir() && (matches!(Model::find(path), Ok(Some(_))) || other_in_folder(path).is_some())
}

const EXPECTED: &str = "a COLMAP folder, a map of OpenSfM, nerfstudio, Bundler or NVM, or a .ply, .csv, .xyz, \
                        .txt, .asc, .pts, .npy, .npz or .splat file";

/// Names or extensions of files that are not read, and what to do. `EXT` stands for the extension.
#[rustfmt::skip] // One row per line.
const CONVERSIONS: [(&str, &str); 15] = [
    ("predictions.npz", "predictions of VGGT: give its COLMAP folder, which demo_colmap.py writes"),
    ("sfm_data.json", "export the map of OpenMVG to COLMAP: openMVG_main_openMVG2Colmap"),
    ("las laz e57", "convert it: CloudCompare -O in.EXT -SAVE_CLOUDS, or pdal translate in.EXT out.ply"),
    ("pcd", "convert it: CloudCompare -O in.EXT -SAVE_CLOUDS, or Open3D"),
    ("ptx", "a grid of a scanner; convert it: CloudCompare -O in.EXT -SAVE_CLOUDS"),
    ("obj", "a mesh; convert it: CloudCompare -O in.EXT -SAVE_CLOUDS"),
    ("glb", "a mesh or cloud as DUSt3R and MASt3R write it; convert it: trimesh or Blender, to .ply"),
    ("gltf", "convert it: trimesh or Blender, to .ply"),
    ("gz", "unpack it: gunzip"),
    ("zip", "unpack it"),
    ("xyzrgb", "name it .xyz"),
    ("jpg jpeg png webp", "a photo: give its folder to unlift audit images"),
    ("sfm abc", "export the map of Meshroom to COLMAP: aliceVision_exportColmap"),
    ("spz ksplat sog", "export it as .ply"),
    ("h5 hdf5", "features of images: use unlift audit images, or --descriptors with a COLMAP model"),
];

/// Returns the error for a file of a format that is not read.
fn not_read(path: &Path) -> Error {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let (mut found, kind) = match &*extension {
        "" => ("a file without extension".to_owned(), &name),
        _ => (format!("a .{extension} file"), &extension),
    };
    let is_it = |names: &str| names.split(' ').any(|its| its == name || its == kind);
    if let Some((_, how)) = CONVERSIONS.iter().find(|(names, _)| is_it(names)) {
        found += &format!(" ({})", how.replace("EXT", kind));
    }
    Error::new(path, "", EXPECTED, found)
}

/// The files to look for in a folder without a COLMAP model, in this order.
const OTHERS_IN_FOLDERS: [&str; 5] = [
    "reconstruction.json",
    "opensfm/reconstruction.json",
    "transforms.json",
    "bundle.out",
    "bundle/bundle.out",
];

/// Folders in folders of other programs, and what to do.
const FOLDERS: [(&str, &str); 3] = [
    ("point_cloud", "3D Gaussian splats (give point_cloud/iteration_*/point_cloud.ply)"),
    ("MeshroomCache", "a project of Meshroom (export it: aliceVision_exportColmap)"),
    ("StructureFromMotion", "a cache of Meshroom (export it: aliceVision_exportColmap)"),
];

fn other_in_folder(path: &Path) -> Option<PathBuf> {
    OTHERS_IN_FOLDERS.map(|name| path.join(name)).into_iter().find(|file| file.is_file())
}

fn file(path: &Path) -> Result<Input, Error> {
    const POINTER: &[u8] = b"version https://git-lfs";
    if input::head(path, POINTER.len() as u64)?.0 == POINTER {
        return Err(Error::new(path, "", "a map", "a pointer of Git LFS (run git lfs pull)"));
    }
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut input = match (&*stem, &*extension.to_ascii_lowercase()) {
        ("points3D", "bin") => colmap_points(path)?,
        ("points3D", "txt") if !table::has_three_columns(path)? => colmap_points(path)?,
        ("cameras" | "images" | "rigs" | "frames", "bin" | "txt") => {
            let found = "another file of a COLMAP model (give its folder)";
            return Err(Error::new(path, "", "a file with points", found));
        }
        (_, "ply") => ply::read(path)?,
        (_, "splat") => ply::splats(path)?,
        (_, "csv" | "xyz" | "txt" | "asc" | "pts") => match table::read(path)? {
            Some(input) => input,
            None => colmap_points(path)?,
        },
        (_, "npy") => npy::positions(path)?,
        ("predictions", "npz") | ("sfm_data", "json") => return Err(not_read(path)),
        (_, "npz") => npy::archived_positions(path)?,
        (_, "json") => json::read(path)?,
        (_, "out") => bundler::read(path)?,
        (_, "nvm") => nvm::read(path)?,
        _ => return Err(not_read(path)),
    };
    input.files.insert(0, path.to_owned());
    Ok(input)
}

fn colmap_points(path: &Path) -> Result<Input, Error> {
    let points = colmap::read_points(path, false)?;
    Ok(Input {
        positions: points.positions,
        ids: points.ids,
        format: "COLMAP points",
        notes: vec!["camera centers: not read (give the folder of the model)".to_owned()],
        ..Input::default()
    })
}

fn folder(path: &Path) -> Result<Input, Error> {
    let Some(model) = Model::find(path)? else {
        if let Some(other) = other_in_folder(path) {
            return file(&other);
        }
        let is_there = |(inside, _): &&(&str, &str)| path.join(inside).is_dir();
        let found = FOLDERS.iter().find(is_there).map_or("none", |(_, found)| found);
        return Err(Error::new(path, "", models::EXPECTED, found));
    };
    let mut input = colmap_model(&model)?;
    input.beside = models::beside(path, &model.folder);
    input.notes.extend(model.notes);
    Ok(input)
}

fn colmap_model(model: &Model) -> Result<Input, Error> {
    let mut input = Input { model: Some(model.folder.clone()), ..Input::default() };
    let extension = model.extension;
    let file = |name: &str| model.folder.join(format!("{name}.{extension}"));
    let [cameras, images] =
        ["cameras", "images"].map(|name| Some(file(name)).filter(|path| path.is_file()));
    input.files.extend([&cameras, &images].into_iter().flatten().cloned());
    input.files.push(model.points.clone());

    // An audit of points needs nothing from the cameras, so their errors are notes.
    let note = |error: Error| input.notes.push(error.to_string());
    let cameras = cameras.and_then(|path| colmap::read_cameras(&path).map_err(note).ok());
    if let Some(path) = images {
        let images = colmap::read_images(&path)?;
        let without = |image: &&colmap::Image| {
            cameras.as_ref().is_some_and(|cameras| image.camera(cameras).is_none())
        };
        let n = images.iter().filter(without).count();
        if n > 0 {
            let of = images.len();
            input.notes.push(format!(
                "{n} of {of} images name a camera that is not in cameras.{extension}"
            ));
        }
        images.iter().for_each(|image| input.camera(Some((image.pose.center, image.up()))));
    } else {
        input.notes.push(format!("camera centers: there is no images.{extension}"));
    }
    if model.points.extension().is_some_and(|extension| extension == "ply") {
        let points = ply::read(&model.points)?;
        (input.positions, input.format) = (points.positions, points.format);
        input.notes.push("points3D.ply: read (no points3D.bin, no points3D.txt)".to_owned());
        return Ok(input);
    }
    let points = colmap::read_points(&model.points, false)?;
    (input.ids, input.positions) = (points.ids, points.positions);
    input.format = if extension == "bin" { "COLMAP binary" } else { "COLMAP text" };
    Ok(input)
}
