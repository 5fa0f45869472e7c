//! Arguments of `unlift paper`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use unlift_audit::paper;

use crate::values;

/// Options of `paper`.
#[derive(Debug, Args)]
#[command(after_help = "\
PATH is the folder of the scenes, as the dataset's owners pack them:

  7scenes    chess/TestSplit.txt, chess/seq-01/frame-000000.color.png and .pose.txt
  12scenes   apt1/kitchen/split.txt, apt1/kitchen/data/frame-000000.color.jpg and .pose.txt
  cambridge  ShopFacade/dataset_test.txt, dataset_train.txt, seq1/frame00001.png and
             reconstruction.nvm

Maps are looked for in SCENE and its folders sparse, triangulated, model_train, sfm and
sfm_sift, and where hloc unpacks published ones (7scenes_sfm_triangulated and
CambridgeLandmarks_Colmap_Retriangulated_1024px); --models names another folder with one per
scene. How long their unit is, the poses of the dataset say.

Every scene that is there is audited as unlift audit map and unlift audit images do, into a
folder of its own below DIR; DIR has paper.json and paper.csv: every number of the paper's
tables and ours, of the strongest attack that was tried. What is missing is told, with where
its owners publish it.

Examples:
  unlift paper --dataset 7scenes datasets/7scenes
  unlift paper --dataset cambridge datasets/cambridge --scenes ShopFacade --parts maps
  unlift paper --dataset 12scenes datasets/12scenes --models outputs/12scenes --images 100

Exit codes: 0 done, 2 usage, 3 bad input, be it a single scene or photo; the others are audited.")]
pub struct PaperArgs {
    /// The folder of the dataset
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
    /// Which dataset
    #[arg(
        long,
        value_enum,
        value_name = "7scenes|12scenes|cambridge",
        hide_possible_values = true
    )]
    pub dataset: Dataset,
    /// A folder with a map per scene (DIR/chess, DIR/apt1/kitchen), in place of those in PATH
    #[arg(long, value_name = "DIR")]
    pub models: Option<PathBuf>,
    /// Meters per unit of all maps [default: what the poses of the dataset say]
    #[arg(long, value_name = "METERS", value_parser = values::scale)]
    pub scale: Option<f64>,
    /// Only these scenes, by commas [default: all that are there]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub scenes: Vec<String>,
    /// Only these parts of the tables, by commas: maps, images (both by an oracle), estimated (neighbors
    /// from descriptors), pictures [default: all]
    #[arg(
        long,
        value_enum,
        value_name = "LIST",
        value_delimiter = ',',
        hide_possible_values = true
    )]
    pub parts: Vec<Part>,
    /// Photos of the test split per scene, evenly spaced over their names
    #[arg(long, value_parser = values::count, value_name = "N", default_value = "20")]
    pub images: NonZeroUsize,
    /// Points per map, a random subset, of which less comes back than of all [default: all]
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_points: Option<NonZeroUsize>,
    /// The integer that all randomness comes from
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// Folder for paper.json, paper.csv and the audits of scenes; whatever else is in it stays
    #[arg(long, value_name = "DIR", default_value = "unlift-paper")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
    /// Print paper.json in place of the tables
    #[arg(long)]
    pub json: bool,
    /// Threads to use; never changes a figure [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

/// The datasets of the paper.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Dataset {
    #[value(name = "7scenes")]
    SevenScenes,
    #[value(name = "12scenes")]
    TwelveScenes,
    Cambridge,
}

impl From<Dataset> for paper::Dataset {
    fn from(dataset: Dataset) -> Self {
        match dataset {
            Dataset::SevenScenes => Self::SevenScenes,
            Dataset::TwelveScenes => Self::TwelveScenes,
            Dataset::Cambridge => Self::Cambridge,
        }
    }
}

/// What of the tables.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Part {
    Maps,
    Images,
    Estimated,
    Pictures,
}

impl From<Part> for paper::Part {
    fn from(part: Part) -> Self {
        match part {
            Part::Maps => Self::Maps,
            Part::Images => Self::Images,
            Part::Estimated => Self::Estimated,
            Part::Pictures => Self::Pictures,
        }
    }
}
