//! The first stage: a map in somebody else's format becomes positions, ids and camera centers.

pub(crate) mod bytes;
pub mod colmap;
mod columns;
mod database;
mod descriptors;
pub(crate) mod lines;
mod models;
mod npy;
mod npz;
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
    /// Ids `(n,)`, ascending: those of COLMAP's points, else the row in the file, from 0.
    pub ids: Vec<u64>,
    /// Rows of points that are left out as they have no place: a coordinate is not finite. Ascending, among all points
    /// in the order of `positions`.
    pub left_out: Vec<u64>,
    /// Camera centers `(m, 3)`; empty when the format has none.
    pub cameras: Vec<[f64; 3]>,
    /// Cameras that are left out as they have no place.
    pub n_unplaced: usize,
    /// The mean of what is up in the photos, of unit length: up in the world, as people hold cameras;
    /// `None` without cameras.
    pub up: Option<[f64; 3]>,
    /// Every file that was read, for hashes in a report.
    pub files: Vec<PathBuf>,
    /// The same before anything was read of them, but for files that one of them names.
    pub seen: Seen,
    /// The name of the format, for people: `COLMAP binary`, `ply ascii`.
    pub format: &'static str,
    /// What was found but not used, and what else whoever reads figures must know, one line each.
    pub notes: Vec<String>,
    /// Why figures may be wrong: no gate holds on them.
    pub doubts: Vec<String>,
    /// Coordinates are degrees of longitude and latitude, which are no lengths, as the file says.
    pub is_geographic: bool,
    /// The folder of the COLMAP model, when the input is one: descriptors are found through its tracks.
    pub model: Option<PathBuf>,
    /// The COLMAP database of the project, if there is one where such projects have it.
    pub database: Option<PathBuf>,
}

/// The largest share of points without a place with which a map is still taken for whole.
const MOST_LEFT_OUT: f64 = 0.05;
/// Points at one place that are told: so many, and at least this share.
const MANY: usize = 10;
const MANY_SHARE: f64 = 0.01;

impl Input {
    /// How many points its files have, with those that are left out.
    pub fn n_rows(&self) -> usize {
        self.positions.len() + self.left_out.len()
    }

    /// Adds a camera: its center and what is up in its photo; `None` if it was not placed.
    fn camera(&mut self, pose: Option<([f64; 3], [f64; 3])>) {
        let is_finite = |x: &[f64; 3]| x.iter().all(|x| x.is_finite());
        match pose.filter(|(center, up)| is_finite(center) && is_finite(up)) {
            Some((center, up)) => {
                self.cameras.push(center);
                let sum = self.up.unwrap_or_default();
                self.up = Some(std::array::from_fn(|c| sum[c] + up[c]));
            }
            None => self.n_unplaced += 1,
        }
    }

    /// What holds for all formats: points without a place are left out, and counted.
    fn settle(mut self) -> Self {
        let n = self.positions.len();
        if self.ids.is_empty() {
            self.ids = (0..n as u64).collect();
        }
        let is_left = |row: &usize| self.positions[*row].iter().any(|x| !x.is_finite());
        self.left_out = (0..n).filter(is_left).map(|row| row as u64).collect();
        let mut notes = Vec::new();
        if !self.left_out.is_empty() {
            let mut left_out = self.left_out.iter().copied().peekable();
            let mut row = 0..;
            self.ids.retain(|_| left_out.next_if_eq(&row.next().unwrap_or(0)).is_none());
            self.positions.retain(|position| position.iter().all(|x| x.is_finite()));
            let note = format!("{} of {n} points have no place", self.left_out.len());
            if self.left_out.len() as f64 > MOST_LEFT_OUT * n as f64 {
                self.doubts.push(format!("{note}: what is audited is not the whole map"));
            } else {
                notes.push(note);
            }
        }
        if self.n_unplaced > 0 {
            let n = self.n_unplaced + self.cameras.len();
            notes.push(format!("{} of {n} cameras have no place", self.n_unplaced));
        }
        if let Some((n, place)) = most_at_one_place(&self.positions)
            && n >= MANY
            && n as f64 >= MANY_SHARE * self.positions.len() as f64
        {
            let of = self.positions.len();
            notes.push(format!("{n} of {of} points are at exactly one place, {place:?}"));
        }
        if self.is_geographic {
            self.doubts.push(
                "coordinates are degrees, which are no lengths: project them first".to_owned(),
            );
        }
        notes.append(&mut self.notes);
        self.notes = notes;
        self.up = self.up.and_then(|sum| {
            let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
            (length > 1e-9).then(|| sum.map(|x| x / length))
        });
        self
    }
}

/// The place at which most points are, and how many.
fn most_at_one_place(positions: &[[f64; 3]]) -> Option<(usize, [f64; 3])> {
    // Zeros of either sign are the same place.
    let bits = |position: &[f64; 3]| position.map(|x| (x + 0.0).to_bits());
    let mix = |[x, y, z]: [u64; 3]| {
        let step = |hash: u64, bits: u64| (hash ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let hash = step(step(step(0, x).rotate_left(23), y).rotate_left(23), z);
        hash ^ hash >> 29
    };
    let mut hashes: Vec<u64> = positions.iter().map(|position| mix(bits(position))).collect();
    hashes.sort_unstable();
    let most = hashes.chunk_by(|a, b| a == b).max_by_key(|same| same.len())?[0];
    let place = *positions.iter().find(|position| mix(bits(position)) == most)?;
    // By the bits: two places may have one hash.
    let n = positions.iter().filter(|position| bits(position) == bits(&place)).count();
    Some((n, place))
}

/// Reads the map at `path`: a COLMAP model folder or a project folder that holds one (of several, the
/// one with the most points; `notes` says which), a map of OpenSfM, OpenMVG, Meshroom, nerfstudio, Bundler or VisualSFM (NVM),
/// or a point cloud: see [`EXPECTED`] for the endings.
///
/// Points whose coordinates are not finite are left out and counted.
///
/// # Errors
/// When nothing readable is there, a file is malformed, or no point has a place.
pub fn open(path: &Path) -> Result<Input, Error> {
    let metadata = std::fs::metadata(path).map_err(|e| Error::read(path, e))?;
    let input = if metadata.is_dir() {
        folder(path)?
    } else {
        let seen = Seen::new([path]);
        Input { seen, ..file(path)? }
    };
    let input = input.settle();
    if input.positions.is_empty() {
        let file = input.files.last().map_or(path, PathBuf::as_path);
        let found = match input.left_out.len() {
            0 => "none".to_owned(),
            n => format!("{n} without one"),
        };
        let expected = if found == "none" { "at least one point" } else { "a point with a place" };
        return Err(Error::new(file, "", expected, found));
    }
    Ok(input)
}

/// Whether `path` is a folder in which [`open`] finds a map.
pub fn is_project(path: &Path) -> bool {
    path.is_dir() && (matches!(Model::find(path), Ok(Some(_))) || others::in_folder(path).is_some())
}

/// What is read, for people.
const EXPECTED: &str = "a COLMAP folder, a map of OpenSfM, OpenMVG, Meshroom, nerfstudio, Bundler or NVM, or a .ply, \
                        .csv, .xyz, .txt, .asc, .pts, .npy, .npz, .las, .pcd, .e57 or .splat file";

/// What a file is that is not read, and what makes one of it that is.
fn not_read(extension: &str) -> String {
    let more = match extension {
        "" => return "a file without extension".to_owned(),
        "laz" => " (pdal translate IN.laz OUT.las makes one that is read)",
        "h5" | "hdf5" => {
            " (features of images: unlift audit images, or --descriptors of a COLMAP model)"
        }
        "spz" | "ksplat" | "sog" => " (export it as .ply)",
        "abc" => " (in Meshroom, ConvertSfMFormat makes an .sfm)",
        _ => "",
    };
    format!("a .{extension} file{more}")
}

fn file(path: &Path) -> Result<Input, Error> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut input = match (&*stem, &*extension.to_ascii_lowercase()) {
        ("points3D", "bin" | "txt") => colmap_points(path)?,
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
        (_, "npz") => npz::positions(path)?,
        (_, "las") => scans::las::read(path)?,
        (_, "pcd") => scans::pcd::read(path)?,
        (_, "e57") => scans::e57::read(path)?,
        (_, "json" | "sfm") => others::json::read(path)?,
        (_, "out") => others::bundler::read(path)?,
        (_, "nvm") => others::nvm::read(path)?,
        (_, other) => return Err(Error::new(path, "", EXPECTED, not_read(other))),
    };
    input.files.insert(0, path.to_owned());
    Ok(input)
}

/// The points of a COLMAP model given by themselves.
fn colmap_points(path: &Path) -> Result<Input, Error> {
    let points = colmap::read_points(path, false)?;
    Ok(Input {
        positions: points.positions,
        ids: points.ids,
        format: "COLMAP points",
        notes: vec!["camera centers: give the folder of the model to have them".to_owned()],
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
    let mut input = colmap_model(&model)?;
    input.database = models::database(path, &model.folder);
    input.notes.extend(model.notes);
    Ok(input)
}

fn colmap_model(model: &Model) -> Result<Input, Error> {
    let mut input = Input { model: Some(model.folder.clone()), ..Input::default() };
    let extension = model.extension;
    let mut present = |name: &str| {
        let path = model.folder.join(format!("{name}.{extension}"));
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
    input.files.push(model.points.clone());
    input.seen = Seen::new(&input.files);

    // Nothing an audit needs is in cameras, rigs and frames, so that a fault in them is told but not fatal.
    let mut told = |error: Error| input.notes.push(error.to_string());
    let cameras = cameras.and_then(|path| colmap::read_cameras(&path).map_err(&mut told).ok());
    for check in
        [rigs.map(|path| colmap::check_rigs(&path)), frames.map(|path| colmap::check_frames(&path))]
    {
        if let Some(Err(error)) = check {
            told(error);
        }
    }
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
        images.iter().for_each(|image| input.camera(Some((image.center, image.up()))));
    } else {
        input.notes.push(format!("camera centers: there is no images.{extension}"));
    }
    if model.points.extension().is_some_and(|extension| extension == "ply") {
        let points = ply::read(&model.points)?;
        (input.positions, input.format) = (points.positions, points.format);
        input
            .notes
            .push("points3D.ply: read, as there are no points3D.bin and points3D.txt".to_owned());
        return Ok(input);
    }
    let points = colmap::read_points(&model.points, false)?;
    (input.ids, input.positions) = (points.ids, points.positions);
    input.format = if extension == "bin" { "COLMAP binary" } else { "COLMAP text" };
    Ok(input)
}
