//! File layouts of the paper's datasets: photos, poses, splits and maps, as their owners publish
//! them.

mod cambridge;
mod dataset;
mod maps;
mod poses;
mod scene;
mod seven_scenes;
mod text;
mod twelve_scenes;

use std::path::Path;

use unlift_io::Error;

pub use dataset::Dataset;
pub use maps::looked_in;
pub use poses::Poses;
pub use scene::Scene;

/// Opens the scenes of `dataset` below `root`, in the paper's order. `models` is a folder with a
/// map per scene, which replaces the maps of the dataset.
///
/// # Errors
/// If there is no scene, or a list of photos or poses is malformed.
pub fn open(dataset: Dataset, root: &Path, models: Option<&Path>) -> Result<Vec<Scene>, Error> {
    let there = dataset.scenes().iter().filter(|name| root.join(name).is_dir());
    let mut scenes = Vec::new();
    for name in there {
        let mut scene = match dataset {
            Dataset::SevenScenes => seven_scenes::open(root, name)?,
            Dataset::TwelveScenes => twelve_scenes::open(root, name)?,
            Dataset::Cambridge => cambridge::open(root, name)?,
        };
        scene.map = maps::find(dataset, root, name, models);
        scenes.push(scene);
    }
    if scenes.is_empty() {
        std::fs::read_dir(root).map_err(|source| Error::read(root, source))?;
        let expected = format!("a folder of {}", dataset.scenes().join(", "));
        return Err(Error::new(root, "", expected, "none of them"));
    }
    Ok(scenes)
}
