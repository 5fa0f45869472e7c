//! Arguments of the stages, and of `export`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use unlift::audit::Threshold;
use unlift::neighbors::oracle::Noise;
use unlift::neighbors::sources::Named;
use unlift::obfuscate::Entry;
use unlift::recover::{Builtin, Delta};

use super::audits::MapArgs;
use crate::values;

/// Options of `obfuscate`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift obfuscate PROJECT --scheme ppl --scale 1 --out hidden
  unlift obfuscate PROJECT --scheme olc --descriptors PROJECT/database.db --out hidden
  unlift obfuscate features.h5 --scheme dcl2d --out hidden-images

released.parquet is what an attacker sees: records (such as lines) in place of points. truth.parquet
holds the original points; keep it private.

All random choices come from a fresh 256-bit key, which unlift does not store. --seed replaces this
key, for experiments. Never release a map made with --seed: whoever guesses the seed can restore the
order of the records and, under cp, the points.

Release a map only once. From two releases with descriptors, an attacker can match the two records
of each point, which intersect in the point.")]
pub struct ObfuscateArgs {
    /// A map: a COLMAP model or project folder, a .ply, .csv or .npy file, or another format of
    /// unlift audit map. Or images: a folder of photos, hloc's features.h5, or a COLMAP database.db
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
    /// Scheme that hides the points (unlift schemes lists them). Schemes for images need images
    #[arg(long, value_name = "SCHEME", value_parser = values::any_scheme)]
    pub scheme: &'static Entry,
    /// Folder for released.parquet and truth.parquet; other files in it stay
    #[arg(long, value_name = "DIR", default_value = "unlift-obfuscated")]
    pub out: PathBuf,
    /// Replace files of the same name that unlift did not write
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub map: MapArgs,
}

/// Ways to make lists of neighbors.
#[derive(Debug, Subcommand)]
#[command(after_help = "\
Examples:
  unlift neighbors oracle hidden/truth.parquet --inlier-ratio 0.5 --out lists.parquet
  unlift neighbors find hidden/released.parquet --source overlap --out lists.parquet")]
pub enum NeighborsCommand {
    /// Make lists of neighbors from the original points, with a chosen fraction of true neighbors
    Oracle(OracleArgs),
    /// Make lists of neighbors from a released file alone, as an attacker can
    Find(FindArgs),
}

/// Options of `neighbors find`.
#[derive(Debug, Args)]
#[command(after_help = "\
Sources:
  descriptors  the best of the others for the descriptors: learned, overlap or similarity
  similarity   points with similar descriptors of any kind
  overlap      points whose patches overlap, according to their SIFT descriptors
  learned      points that a network finds, from SIFT or ALIKED descriptors
  geometric    points near places where many records meet; maps only; needs no descriptors

Examples:
  unlift neighbors find hidden/released.parquet --source overlap --out lists.parquet
  unlift neighbors find hidden/released.parquet --source geometric --k 20")]
pub struct FindArgs {
    /// The released.parquet of a map or of images
    #[arg(value_name = "OBFUSCATED")]
    pub released: PathBuf,
    /// Method that makes the lists, see Sources below
    #[arg(long, value_name = "SOURCE", value_parser = values::own_source)]
    pub source: Named,
    /// Number of records per list; a record is what a scheme publishes in place of points [default:
    /// chosen by the source]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u16).range(1..))]
    pub k: Option<u16>,
    /// Random seed
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// Number of threads; results do not depend on it [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// File to write
    #[arg(long, value_name = "FILE", default_value = "neighborhoods.parquet")]
    pub out: PathBuf,
    /// Replace files of the same name that unlift did not write
    #[arg(long)]
    pub force: bool,
}

/// Options of `neighbors oracle`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  unlift neighbors oracle hidden/truth.parquet --inlier-ratio 0.5 --out lists.parquet")]
pub struct OracleArgs {
    /// The truth.parquet that unlift obfuscate wrote
    #[arg(value_name = "TRUTH")]
    pub truth: PathBuf,
    /// The released.parquet that belongs to TRUTH [default: the one in the folder of TRUTH]
    #[arg(long, value_name = "FILE")]
    pub released: Option<PathBuf>,
    /// Fraction of each list that consists of true nearest neighbors, from 0 to 1: round(RATIO x K)
    /// of K entries
    #[arg(long, value_name = "RATIO", value_parser = values::ratio)]
    pub inlier_ratio: f64,
    /// Wrong entries of the lists: uniform (random records), near (random records between the (2 x
    /// K)-th and the (10 x K)-th nearest), clustered (nearby points share the same few wrong
    /// places, as happens where descriptors look alike)
    #[arg(long, value_name = "MODEL", value_parser = values::noise, default_value = "uniform")]
    pub oracle_noise: Noise,
    /// Entries per list (K); there is a list per hidden point
    #[arg(long, value_name = "K", default_value = "50",
          value_parser = clap::value_parser!(u16).range(1..))]
    pub k: u16,
    /// Random seed
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// File to write
    #[arg(long, value_name = "FILE", default_value = "neighborhoods.parquet")]
    pub out: PathBuf,
    /// Replace files of the same name that unlift did not write
    #[arg(long)]
    pub force: bool,
}

/// Options of `recover`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  unlift recover hidden/released.parquet --neighbors lists.parquet --out back.parquet")]
pub struct RecoverArgs {
    /// The released.parquet of a map or of images
    #[arg(value_name = "OBFUSCATED")]
    pub released: PathBuf,
    /// File with lists of neighbors, written by unlift neighbors find, unlift neighbors oracle or
    /// your own program (docs/formats.md). density and tomography compute positions without the
    /// lists and need them only to tell apart the two points of a line
    #[arg(long, value_name = "FILE")]
    pub neighbors: PathBuf,
    /// Recovery method. With lists of neighbors: joint, ranking (stronger and slower: also uses
    /// which points are not in a list), joint-start (the first pass of joint), consensus (each
    /// point from its own list), ransac (the attack of Chelani et al. 2025). Without lists, from
    /// the records alone (what a scheme releases in place of points): density (published attacks),
    /// tomography (stronger)
    #[arg(long, value_name = "SOLVER", value_parser = values::solver, default_value = "joint")]
    pub solver: Builtin,
    /// A listed record supports a position if it passes within this distance of it, in the unit of
    /// the map; auto computes the distance from the released records and the lists
    #[arg(long, value_name = "auto|VALUE", value_parser = values::delta, default_value = "auto")]
    pub delta: Delta,
    /// Random seed
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// Number of threads; results do not depend on it [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// File to write
    #[arg(long, value_name = "FILE", default_value = "recovered.parquet")]
    pub out: PathBuf,
    /// Replace files of the same name that unlift did not write
    #[arg(long)]
    pub force: bool,
}

/// Options of `evaluate`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift evaluate back.parquet --truth hidden/truth.parquet
  unlift evaluate back.parquet --truth hidden/truth.parquet --thresholds 0.05,0.10 --json")]
pub struct EvaluateArgs {
    /// Recovered points that unlift recover wrote
    #[arg(value_name = "RECOVERED")]
    pub recovered: PathBuf,
    /// The truth.parquet that unlift obfuscate wrote
    #[arg(long, value_name = "TRUTH")]
    pub truth: PathBuf,
    /// The released.parquet that belongs to TRUTH, for the baseline that guesses from one record at
    /// a time [default: the one in the folder of TRUTH]
    #[arg(long, value_name = "FILE")]
    pub released: Option<PathBuf>,
    /// Largest errors at which a point counts as recovered, separated by commas [default: 0.10,0.25
    /// in meters, 1,5,10,25 in pixels, 1.0,2.5 in other units]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::threshold)]
    pub thresholds: Vec<Threshold>,
    /// Print the results as JSON, with the fields of a row of audit.json
    #[arg(long)]
    pub json: bool,
}

/// Options of `export`.
#[derive(Debug, Args)]
#[command(after_help = "\
The ending of --out decides the format:
  .ply       points
  .obj       released lines or rays, drawn as segments
  no ending  a folder with a COLMAP model in text (cameras.txt, images.txt, points3D.txt)

A file that shows points is as private as the map.

Examples:
  unlift export back.parquet --scale 1 --out back.ply
  unlift export hidden/released.parquet --scale 1 --out lines.obj
  unlift export back.parquet --scale 1 --cameras PROJECT --out back-model")]
pub struct ExportArgs {
    /// A released, recovered or truth file of a map (Parquet)
    #[arg(value_name = "FILE")]
    pub path: PathBuf,
    /// File or folder to write; its ending decides the format, see below
    #[arg(long, value_name = "PATH")]
    pub out: PathBuf,
    /// Meters per unit of the map, as given to unlift obfuscate. The output then has the
    /// coordinates of the map [default: coordinates as in FILE]
    #[arg(long, value_name = "METERS", value_parser = values::scale)]
    pub scale: Option<f64>,
    /// A COLMAP model or project of the same map. Its cameras and images are copied to the exported
    /// model
    #[arg(long, value_name = "PROJECT")]
    pub cameras: Option<PathBuf>,
    /// Replace files of the same name that unlift did not write
    #[arg(long)]
    pub force: bool,
}
