//! The first stage: a map in somebody else's format becomes positions, ids and camera centers.

pub(crate) mod bytes;
pub mod colmap;
mod database;
mod descriptors;
pub(crate) mod lines;
mod models;
mod npy;
mod others;
mod ply;
mod scalar;
mod scans;
mod table;
mod undeclared;

use std::path::{Path, PathBuf};

pub use descriptors::descriptors;

use crate::error::Error;
use crate::seen::Seen;
use models::Model;

/// A map as it was read, in the units of its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Input {
    /// Points `(n, 3)`, all finite, at least one. COLMAP's are in ascending order of their ids,
    /// others in the order of the file.
    pub positions: Vec<[f64; 3]>,
    /// Ids `(n,)`, ascending: those of COLMAP's points, else the row, from 0.
    pub ids: Vec<u64>,
    /// Camera centers `(m, 3)`; empty when the format has none.
    pub cameras: Vec<[f64; 3]>,
    /// The mean of what is up in the photos, of unit length: up in the world, as people hold cameras;
    /// `None` without cameras.
    pub up: Option<[f64; 3]>,
    /// Every file that was read, for hashes in a report.
    pub files: Vec<PathBuf>,
    /// The same before anything was read of them, but for files that one of them names.
    pub seen: Seen,
    /// The name of the format, for people: `COLMAP binary`, `ply ascii`.
    pub format: &'static str,
    /// What was found but not used, one line each.
    pub skipped: Vec<String>,
    /// Why figures of the points may be too small, one line each: no gate holds then.
    pub doubts: Vec<String>,
    /// The folder of the COLMAP model, when the input is one: descriptors are found through its tracks.
    pub model: Option<PathBuf>,
    /// The COLMAP database of the project, if there is one where such projects have it.
    pub database: Option<PathBuf>,
}

fn mean_direction(directions: impl Iterator<Item = [f64; 3]>) -> Option<[f64; 3]> {
    let sum = directions.fold([0.0; 3], |s, d| std::array::from_fn(|c| s[c] + d[c]));
    let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
    (length > 1e-9).then(|| sum.map(|x| x / length))
}

/// Reads the map at `path`: a COLMAP model folder or a project folder that holds one (of several, the
/// one with the most points; `skipped` says which), a map of OpenSfM, nerfstudio, Bundler or VisualSFM (NVM), or a point
/// cloud as `.ply`, `.csv`, `.xyz`, `.txt`, `.npy`, `.las`, `.pcd` or `.e57`.
///
/// # Errors
/// When nothing readable is there, a file is malformed, a coordinate is not finite, or there is no point.
pub fn open(path: &Path) -> Result<Input, Error> {
    let metadata = std::fs::metadata(path).map_err(|e| Error::read(path, e))?;
    let input = if metadata.is_dir() {
        folder(path)?
    } else {
        let seen = Seen::new([path]);
        Input { seen, ..file(path)? }
    };
    if input.positions.is_empty() {
        let file = input.files.last().map_or(path, PathBuf::as_path);
        return Err(Error::new(file, "", "at least one point", "none"));
    }
    Ok(input)
}

/// Whether `path` is a folder in which [`open`] finds a map.
pub fn is_project(path: &Path) -> bool {
    path.is_dir() && (matches!(Model::find(path), Ok(Some(_))) || others::in_folder(path).is_some())
}

const EXPECTED: &str = "a COLMAP folder, a map of OpenSfM, nerfstudio, Bundler or NVM, or a .ply, .csv, .xyz, .txt, .npy, \
                        .las, .pcd or .e57 file";

/// What makes a point cloud that is read of a file that is not.
fn converter(extension: &str) -> &'static str {
    match extension {
        "laz" => " (pdal translate IN.laz OUT.las makes one that is read)",
        _ => "",
    }
}

fn file(path: &Path) -> Result<Input, Error> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let (positions, format) = match (&*stem, &*extension.to_ascii_lowercase()) {
        ("points3D", "bin" | "txt") => return colmap_points(path),
        ("cameras" | "images" | "rigs" | "frames", "bin" | "txt") => {
            let found = "another file of a COLMAP model (give its folder)";
            return Err(Error::new(path, "", "a file with points", found));
        }
        (_, "ply") => {
            let (positions, format, doubts) = ply::read(path)?;
            return Ok(Input { doubts, ..alone(path, positions, format) });
        }
        (_, "csv" | "xyz" | "txt") => (table::read(path)?, "table"),
        (_, "npy") => (npy::positions(path)?, "npy"),
        (_, other) => {
            if let Some(scan) = scans::file(path, other) {
                let scans::Scan { positions, format, notes, doubts } = scan?;
                return Ok(Input { skipped: notes, doubts, ..alone(path, positions, format) });
            }
            if let Some(found) = others::file(path) {
                return found.map(|(format, found)| of_another_program(path, format, found));
            }
            let found = match other {
                "" => "a file without extension".to_owned(),
                other => format!("a .{other} file{}", converter(other)),
            };
            return Err(Error::new(path, "", EXPECTED, found));
        }
    };
    Ok(alone(path, positions, format))
}

/// Points of one file, of which nothing else is known.
fn alone(path: &Path, positions: Vec<[f64; 3]>, format: &'static str) -> Input {
    Input {
        ids: (0..positions.len() as u64).collect(),
        positions,
        files: vec![path.to_owned()],
        format,
        ..Input::default()
    }
}

fn of_another_program(path: &Path, format: &'static str, found: others::Found) -> Input {
    Input {
        ids: (0..found.positions.len() as u64).collect(),
        positions: found.positions,
        cameras: found.cameras,
        up: mean_direction(found.up.into_iter()),
        files: std::iter::once(path.to_owned()).chain(found.more).collect(),
        format,
        skipped: found.notes,
        doubts: found.doubts,
        ..Input::default()
    }
}

/// `points3D` given by itself.
fn colmap_points(path: &Path) -> Result<Input, Error> {
    let points = colmap::read_points(path, false)?;
    Ok(Input {
        positions: points.positions,
        ids: points.ids,
        files: vec![path.to_owned()],
        format: "COLMAP points",
        skipped: vec!["camera centers: give the folder of the model to have them".to_owned()],
        ..Input::default()
    })
}

fn folder(path: &Path) -> Result<Input, Error> {
    let Some(model) = Model::find(path)? else {
        return match others::in_folder(path) {
            Some(other) => {
                let seen = Seen::new([&other]);
                Ok(Input { seen, ..file(&other)? })
            }
            None => Err(Error::new(path, "", models::EXPECTED, "none")),
        };
    };
    let mut input = colmap_model(&model.folder, model.extension)?;
    input.format = if model.extension == "bin" { "COLMAP binary" } else { "COLMAP text" };
    input.database = models::database(path, &model.folder);
    input.skipped.extend(model.notes);
    Ok(input)
}

fn colmap_model(model: &Path, extension: &str) -> Result<Input, Error> {
    let mut input = Input { model: Some(model.to_owned()), ..Input::default() };
    let path = |name: &str| model.join(format!("{name}.{extension}"));
    let mut present = |name: &str| {
        let path = path(name);
        let there = path.is_file();
        if there {
            input.files.push(path.clone());
        }
        there.then_some(path)
    };
    let cameras = present("cameras");
    let images = present("images");
    let rigs = present("rigs");
    let frames = present("frames");
    let points = present("points3D").expect("found by the caller");
    input.seen = Seen::new(&input.files);

    let cameras = cameras.map(|path| colmap::read_cameras(&path)).transpose()?;
    if let Some(path) = images {
        let images = colmap::read_images(&path)?;
        if let Some(cameras) = &cameras {
            images.iter().try_for_each(|image| colmap::check_camera(&path, image, cameras))?;
        }
        input.cameras = images.iter().map(|image| image.center).collect();
        input.up = mean_direction(images.iter().map(colmap::Image::up));
    } else {
        let note = format!("camera centers: there is no images.{extension}");
        input.skipped.push(note);
    }
    // Nothing an audit needs is in these two, so that a fault in them is told but not fatal.
    for check in
        [rigs.map(|path| colmap::check_rigs(&path)), frames.map(|path| colmap::check_frames(&path))]
    {
        if let Some(Err(error)) = check {
            input.skipped.push(error.to_string());
        }
    }
    let points = colmap::read_points(&points, false)?;
    input.ids = points.ids;
    input.positions = points.positions;
    Ok(input)
}
