//! Finds the map of a scene: beside its photos, where hloc unpacks the published maps, or where
//! hloc and COLMAP write their own.

use std::path::{Path, PathBuf};

use unlift_io::read;

use super::dataset::Dataset;

/// Folders of a map inside the folder of the scene. [`read::open`] finds `sparse/0` and similar
/// folders itself.
const INSIDE: [&str; 5] = ["", "triangulated", "model_train", "sfm", "sfm_sift"];
const NVM: &str = "reconstruction.nvm";

/// Returns the folder beside the scenes into which hloc unpacks published maps.
fn beside(dataset: Dataset) -> Option<&'static str> {
    match dataset {
        Dataset::SevenScenes => Some("7scenes_sfm_triangulated"),
        Dataset::TwelveScenes => None,
        Dataset::Cambridge => Some("CambridgeLandmarks_Colmap_Retriangulated_1024px"),
    }
}

/// Returns the first existing map of the scene `name`, in the dataset at `root` or in `models`.
pub fn find(dataset: Dataset, root: &Path, name: &str, models: Option<&Path>) -> Option<PathBuf> {
    let places = match models {
        Some(models) => vec![models.join(name)],
        None => {
            let beside = beside(dataset).map(|folder| root.join(folder).join(name));
            [root.join(name)].into_iter().chain(beside).collect()
        }
    };
    let inside = places.iter().flat_map(|place| INSIDE.map(|folder| place.join(folder)));
    let nvm = places.iter().map(|place| place.join(NVM));
    inside.filter(|folder| read::is_project(folder)).chain(nvm.filter(|file| file.is_file())).next()
}

/// Describes the places that [`find`] checks.
pub fn looked_in(dataset: Dataset, models: Option<&Path>) -> String {
    let inside = "itself, sparse, triangulated, model_train, sfm, sfm_sift";
    match (models, beside(dataset)) {
        (Some(models), _) => format!("{}/SCENE ({inside})", models.display()),
        (None, Some(folder)) => format!("SCENE and {folder}/SCENE ({inside})"),
        (None, None) => format!("SCENE ({inside})"),
    }
}
