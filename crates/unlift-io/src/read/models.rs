//! Finds the COLMAP model of a folder.

use std::fs;
use std::path::{Path, PathBuf};

use super::lines::Lines;
use super::{descriptors, ply};
use crate::error::Error;
use crate::input;

/// Places of models, themselves or in numbered subfolders: COLMAP's `sparse`, hloc's `models` (its
/// best model is in the folder itself), nerfstudio's `colmap/sparse`, ETH3D's.
const PLACES: [&str; 8] = [
    "",
    "sparse",
    "model",
    "models",
    "colmap",
    "colmap/sparse",
    "dslr_calibration_undistorted",
    "rig_calibration_undistorted",
];
/// The place of undistorted models: `sparse` in it or in its numbered subfolders. They are read only if there is no other model.
const UNDISTORTED: &str = "dense";
const DATABASES: [&str; 2] = ["database.db", "colmap/database.db"];
/// Places of a database if the folder that was given is the model itself.
const DATABASES_ABOVE: [&str; 2] = ["../database.db", "../../database.db"];

pub(super) struct Model {
    /// Relative to the folder that was given, with slashes. Empty for that folder.
    name: String,
    pub folder: PathBuf,
    /// `bin` or `txt`.
    pub extension: &'static str,
    /// The file of its points, which may be a PLY.
    pub points: PathBuf,
    pub notes: Vec<String>,
}

impl Model {
    /// Finds the model in `path`: the one in the folder itself, else the one with the most points.
    /// Ties go to the first in the order of [`PLACES`] and of numbers.
    pub fn find(path: &Path) -> Result<Option<Self>, Error> {
        let mut models = models(path);
        if models.len() < 2 {
            return Ok(models.pop());
        }
        let counts = models.iter().map(Self::n_points).collect::<Result<Vec<_>, _>>()?;
        let title = |model: &Self| match &*model.name {
            "" => "the model of the folder itself".to_owned(),
            name => name.to_owned(),
        };
        // Of equal ones, `max_by_key` returns the last.
        let largest = (0..models.len()).rev().max_by_key(|&at| counts[at]).unwrap_or_default();
        let (chosen, why) =
            if models[0].name.is_empty() { (0, "first") } else { (largest, "largest") };
        let mut notes = vec![format!(
            "{}: read, the {why} of {} models ({} points)",
            title(&models[chosen]),
            models.len(),
            counts[chosen]
        )];
        for at in (0..models.len()).filter(|&at| at != chosen) {
            let (title, n) = (title(&models[at]), counts[at]);
            notes.push(format!("{title}: another model ({n} points), give its path to read it"));
        }
        let mut model = models.swap_remove(chosen);
        model.notes.append(&mut notes);
        Ok(Some(model))
    }

    fn in_folder(name: String, folder: PathBuf) -> Option<Self> {
        let file = |stem: &str, extension: &str| folder.join(format!("{stem}.{extension}"));
        let has_points = |extension: &&str| file("points3D", extension).is_file();
        let form = ["bin", "txt", "ply"].into_iter().find(has_points)?;
        let points = file("points3D", form);
        // Beside a PLY, cameras may be in either form.
        let is_text = form == "txt" || (form == "ply" && !file("images", "bin").is_file());
        let extension = if is_text { "txt" } else { "bin" };
        let mut notes = Vec::new();
        if form == "bin" && has_points(&"txt") {
            notes.push("points3D.txt: not read, because points3D.bin exists".to_owned());
        }
        Some(Self { name, folder, extension, points, notes })
    }

    /// Returns the number of points that the file declares.
    fn n_points(&self) -> Result<u64, Error> {
        let path = &self.points;
        let has_extension = |name: &str| path.extension().is_some_and(|its| its == name);
        if has_extension("ply") {
            return Ok(ply::read(path)?.positions.len() as u64);
        }
        if has_extension("bin") {
            // A truncated file counts as empty. If it is chosen, its reader returns the error.
            let (count, _) = input::head(path, 8)?;
            return Ok(count.try_into().map_or(0, u64::from_le_bytes));
        }
        let (mut lines, mut n) = (Lines::open(path)?, 0);
        while lines.advance_to_data()? {
            n += 1;
        }
        Ok(n)
    }
}

/// Finds the files beside the model `model` in `path` that may have its descriptors.
pub(super) fn beside(path: &Path, model: &Path) -> Vec<PathBuf> {
    let above: &[&str] = if model == path { &DATABASES_ABOVE } else { &[] };
    let places = DATABASES.iter().chain(above);
    let database = places.map(|place| path.join(place)).find(|file| file.is_file());
    // hloc writes the features of a run beside the folder of its model.
    let features = [path.to_owned(), path.join("..")].into_iter().flat_map(|folder| {
        let files = fs::read_dir(folder).into_iter().flatten().flatten().map(|file| file.path());
        let mut files: Vec<PathBuf> = files.filter(|file| is_features(file)).collect();
        files.sort();
        files
    });
    database.into_iter().chain(features).collect()
}

/// Returns true for descriptors of points in our format, `descriptors.bin`, and for local features of hloc: `features.h5` or
/// `feats-TYPE.h5`, but no matches of them.
fn is_features(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let is_named = name == "features.h5" || (name.starts_with("feats-") && name.ends_with(".h5"));
    let is_ours = || input::head(path, 8).is_ok_and(|(head, _)| head == *descriptors::MAGIC);
    (is_named && !name.contains("matches")) || (name == "descriptors.bin" && is_ours())
}

pub(super) const EXPECTED: &str = "points3D.bin or points3D.txt in it, or in sparse, model, models, colmap/sparse \
                                   or a numbered folder of these";

/// Lists all models in `path` without repetition, in the order of search.
fn models(path: &Path) -> Vec<Model> {
    let mut models: Vec<Model> = Vec::new();
    let mut known = Vec::new();
    let places = PLACES.map(|place| (place, "")).into_iter().chain([(UNDISTORTED, "/sparse")]);
    for (place, inside) in places {
        if place == UNDISTORTED && !models.is_empty() {
            break;
        }
        let within = |number| if place.is_empty() { number } else { format!("{place}/{number}") };
        let numbers =
            numbered(&path.join(place)).into_iter().map(|number| within(number.to_string()));
        for name in std::iter::once(place.to_owned()).chain(numbers) {
            let name = name + inside;
            let folder = if name.is_empty() { path.to_owned() } else { path.join(&name) };
            let Some(model) = Model::in_folder(name, folder) else { continue };
            // Links can make one model appear twice.
            let real = fs::canonicalize(&model.folder).unwrap_or_else(|_| model.folder.clone());
            if !known.contains(&real) {
                known.push(real);
                models.push(model);
            }
        }
    }
    models
}

fn numbered(parent: &Path) -> Vec<u32> {
    let Ok(entries) = fs::read_dir(parent) else { return Vec::new() };
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    // Names like 007 are skipped, because the number does not give the name back.
    let number = |name: String| name.parse::<u32>().ok().filter(|n| n.to_string() == name);
    let mut numbers: Vec<u32> = names.filter_map(number).collect();
    numbers.sort_unstable();
    numbers
}
