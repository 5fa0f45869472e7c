//! The datasets of the paper: their names, scenes and web sites.

use super::{cambridge, seven_scenes, twelve_scenes};

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

impl Dataset {
    /// All datasets.
    pub const ALL: [Self; 3] = [Self::SevenScenes, Self::TwelveScenes, Self::Cambridge];

    /// Returns the name that users type.
    pub fn name(self) -> &'static str {
        match self {
            Self::SevenScenes => "7scenes",
            Self::TwelveScenes => "12scenes",
            Self::Cambridge => "cambridge",
        }
    }

    /// Returns the name in the published tables.
    pub fn published(self) -> &'static str {
        match self {
            Self::SevenScenes => "7-scenes",
            Self::TwelveScenes => "12-scenes",
            Self::Cambridge => "cambridge",
        }
    }

    /// Returns the names of its scenes, which are those of their folders.
    pub fn scenes(self) -> &'static [&'static str] {
        match self {
            Self::SevenScenes => &seven_scenes::SCENES,
            Self::TwelveScenes => &twelve_scenes::SCENES,
            Self::Cambridge => &cambridge::SCENES,
        }
    }

    /// Returns the web site of its photos and poses.
    pub fn owner(self) -> &'static str {
        match self {
            Self::SevenScenes => {
                "https://www.microsoft.com/en-us/research/project/rgb-d-dataset-7-scenes/"
            }
            Self::TwelveScenes => "http://graphics.stanford.edu/projects/reloc/",
            Self::Cambridge => "http://mi.eng.cam.ac.uk/projects/relocalisation/",
        }
    }

    /// Returns where its maps are published, or how to make one.
    pub fn maps(self) -> &'static str {
        match self {
            Self::SevenScenes => {
                "7scenes_sfm_triangulated.zip, \
                 https://github.com/cvg/Hierarchical-Localization/tree/master/hloc/pipelines/7Scenes"
            }
            Self::TwelveScenes => "none is published with it: make one from its photos with COLMAP",
            Self::Cambridge => {
                "CambridgeLandmarks_Colmap_Retriangulated_1024px.zip, \
                 https://github.com/cvg/Hierarchical-Localization/tree/master/hloc/pipelines/Cambridge, \
                 or reconstruction.nvm of the dataset itself"
            }
        }
    }

    /// Returns the longest side in pixels to which the paper downsized photos, if it did.
    pub fn shrunk_to(self) -> Option<u32> {
        match self {
            Self::SevenScenes | Self::TwelveScenes => None,
            Self::Cambridge => Some(1024),
        }
    }
}
