//! Where the datasets of the paper have their photos, poses, splits and maps, as their owners publish them.

mod cambridge;
mod maps;
mod poses;
mod seven_scenes;
mod text;
mod twelve_scenes;

use std::path::{Path, PathBuf};

use unlift_io::Error;

pub use maps::looked_in;
pub use poses::Poses;

/// A dataset of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dataset {
    /// 7-Scenes: Shotton et al., CVPR 2013.
    SevenScenes,
    /// 12-Scenes: Valentin et al., 3DV 2016.
    TwelveScenes,
    /// Cambridge Landmarks: Kendall et al., ICCV 2015.
    Cambridge,
}

/// A scene of a dataset, as it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Its name, which is that of its folder: `chess`, `apt1/kitchen`.
    pub name: String,
    /// Its folder.
    pub root: PathBuf,
    /// The folder by which photos are named.
    pub photos: PathBuf,
    /// Names of the photos of the test split that are there, sorted.
    pub test: Vec<String>,
    /// Why there are fewer than the split has, or none.
    pub lacking: Option<String>,
    /// The map, as [`unlift_io::read::open`] takes it.
    pub map: Option<PathBuf>,
    /// Where the cameras stood.
    pub poses: Poses,
}

impl Dataset {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::SevenScenes, Self::TwelveScenes, Self::Cambridge];

    /// The name that users type.
    pub fn name(self) -> &'static str {
        match self {
            Self::SevenScenes => "7scenes",
            Self::TwelveScenes => "12scenes",
            Self::Cambridge => "cambridge",
        }
    }

    /// The name in the published tables.
    pub fn published(self) -> &'static str {
        match self {
            Self::SevenScenes => "7-scenes",
            Self::TwelveScenes => "12-scenes",
            Self::Cambridge => "cambridge",
        }
    }

    /// Names of its scenes, which are those of their folders.
    pub fn scenes(self) -> &'static [&'static str] {
        match self {
            Self::SevenScenes => &seven_scenes::SCENES,
            Self::TwelveScenes => &twelve_scenes::SCENES,
            Self::Cambridge => &cambridge::SCENES,
        }
    }

    /// Where its owners publish photos and poses.
    pub fn owner(self) -> &'static str {
        match self {
            Self::SevenScenes => {
                "https://www.microsoft.com/en-us/research/project/rgb-d-dataset-7-scenes/"
            }
            Self::TwelveScenes => "http://graphics.stanford.edu/projects/reloc/",
            Self::Cambridge => "http://mi.eng.cam.ac.uk/projects/relocalisation/",
        }
    }

    /// Where maps of it are published, or how one is made.
    pub fn maps(self) -> &'static str {
        match self {
            Self::SevenScenes => {
                "7scenes_sfm_triangulated.zip, \
                 https://github.com/cvg/Hierarchical-Localization/tree/master/hloc/pipelines/7Scenes"
            }
            Self::TwelveScenes => "none is published with it: COLMAP makes one of its photos",
            Self::Cambridge => {
                "CambridgeLandmarks_Colmap_Retriangulated_1024px.zip, \
                 https://github.com/cvg/Hierarchical-Localization/tree/master/hloc/pipelines/Cambridge, \
                 or reconstruction.nvm of the dataset itself"
            }
        }
    }

    /// Longest side in pixels to which the paper shrank photos, where it did.
    pub fn shrunk_to(self) -> Option<u32> {
        match self {
            Self::SevenScenes | Self::TwelveScenes => None,
            Self::Cambridge => Some(1024),
        }
    }

    /// The scenes below `root`, in the paper's order; `models` is a folder with a map per scene, in place of those that
    /// lie in the dataset.
    ///
    /// # Errors
    /// When there is none, or a list of photos or poses is malformed.
    pub fn open(self, root: &Path, models: Option<&Path>) -> Result<Vec<Scene>, Error> {
        let there = self.scenes().iter().filter(|name| root.join(name).is_dir());
        let mut scenes = Vec::new();
        for name in there {
            let mut scene = match self {
                Self::SevenScenes => seven_scenes::open(root, name)?,
                Self::TwelveScenes => twelve_scenes::open(root, name)?,
                Self::Cambridge => cambridge::open(root, name)?,
            };
            scene.map = maps::find(self, root, name, models);
            scenes.push(scene);
        }
        if scenes.is_empty() {
            std::fs::read_dir(root).map_err(|source| Error::read(root, source))?;
            let expected = format!("a folder of {}", self.scenes().join(", "));
            return Err(Error::new(root, "", expected, "none of them"));
        }
        Ok(scenes)
    }
}
