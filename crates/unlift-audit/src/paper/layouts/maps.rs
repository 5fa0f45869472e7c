//! Where the map of a scene lies: beside its photos, where hloc unpacks the published ones, or where hloc and COLMAP
//! leave their own.

use std::path::{Path, PathBuf};

use unlift_io::read;

use super::dataset::Dataset;

/// Folders of a scene's map inside the place of the scene; [`read::open`] finds `sparse/0` and its like by itself.
const INSIDE: [&str; 5] = ["", "triangulated", "model_train", "sfm", "sfm_sift"];
/// The file of Cambridge Landmarks.
const NVM: &str = "reconstruction.nvm";

/// The folder beside the scenes into which hloc unpacks published maps.
fn beside(dataset: Dataset) -> Option<&'static str> {
    match dataset {
        Dataset::SevenScenes => Some("7scenes_sfm_triangulated"),
        Dataset::TwelveScenes => None,
        Dataset::Cambridge => Some("CambridgeLandmarks_Colmap_Retriangulated_1024px"),
    }
}

/// The map of the scene `name` of the dataset in `root`, or of the scene in `models`; the first that is there.
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

/// Where [`find`] looks, for people.
pub fn looked_in(dataset: Dataset, models: Option<&Path>) -> String {
    let inside = "itself, sparse, triangulated, model_train, sfm, sfm_sift";
    match (models, beside(dataset)) {
        (Some(models), _) => format!("{}/SCENE ({inside})", models.display()),
        (None, Some(folder)) => format!("SCENE and {folder}/SCENE ({inside})"),
        (None, None) => format!("SCENE ({inside})"),
    }
}
