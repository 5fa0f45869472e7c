//! Arguments of the stages, and of `split` and `export`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, Subcommand, value_parser};
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

released.parquet is what an attacker sees: a record (such as a line) in place of each point.
truth.parquet holds the original points; keep it private.

A fresh 256-bit key draws what hides the points, and is kept nowhere. With --seed that number
replaces it, for experiments only: whoever guesses the number undoes the order of the records, and
cp entirely. Release a map once: in two releases with descriptors, the records of a point can be
matched, and they meet in it.")]
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
    /// Make lists of neighbors from the truth, with a chosen share of true neighbors
    Oracle(OracleArgs),
    /// Make lists of neighbors from a released file alone, as an attacker does
    Find(FindArgs),
}

/// Options of `neighbors find`.
#[derive(Debug, Args)]
#[command(after_help = "\
Sources:
  descriptors  overlap or similarity, whichever suits the descriptors; no training
  similarity   similar descriptors, of any kind
  overlap      overlapping patches, for SIFT
  learned      a network, for SIFT or ALIKED
  geometric    places where many records meet; no descriptors; for maps only

Examples:
  unlift neighbors find hidden/released.parquet --source overlap --out lists.parquet
  unlift neighbors find hidden/released.parquet --source geometric --k 20")]
pub struct FindArgs {
    /// The released.parquet of a map or of images
    #[arg(value_name = "OBFUSCATED")]
    pub released: PathBuf,
    /// Method that makes the lists, see below
    #[arg(long, value_name = "SOURCE", value_parser = values::own_source)]
    pub source: Named,
    /// Records per list; a record is what a scheme publishes in place of a point [default: chosen
    /// by the source]
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
    /// The released.parquet of the same run [default: the one beside TRUTH]
    #[arg(long, value_name = "FILE")]
    pub released: Option<PathBuf>,
    /// Share of each list that are true nearest neighbors, from 0 to 1: round(RATIO x K) of K
    /// entries
    #[arg(long, value_name = "RATIO", value_parser = values::ratio)]
    pub inlier_ratio: f64,
    /// Where the wrong entries lie: uniform (anywhere), near (a little too far: the 2K-th to 10K-th
    /// nearest), clustered (at wrong places that neighbors share, as with look-alike descriptors)
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
    /// File with the lists of neighbors, as unlift neighbors writes it
    #[arg(long, value_name = "FILE")]
    pub neighbors: PathBuf,
    /// Recovery method. From lists of neighbors: joint (usually the strongest), joint-start (its
    /// first pass), consensus (each point by its own list), ransac (that of the paper). From the
    /// released records alone: density (published attacks), tomography (stronger)
    #[arg(long, value_name = "SOLVER", value_parser = values::solver, default_value = "joint")]
    pub solver: Builtin,
    /// Do not use rules of schemes that fix coordinates exactly (cp: coordinates are swapped in
    /// pairs; ray-voxel: a checkerboard of voxels picks the center)
    #[arg(long)]
    pub no_exact_constraints: bool,
    /// Distance within which a listed record (what replaces a point) supports a position, in the
    /// unit of the map; auto computes it from the released records and the lists
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
    /// Recovered points, as unlift recover writes them
    #[arg(value_name = "RECOVERED")]
    pub recovered: PathBuf,
    /// The truth.parquet that unlift obfuscate wrote
    #[arg(long, value_name = "TRUTH")]
    pub truth: PathBuf,
    /// The released.parquet, for the baseline that guesses from one record at a time [default: the
    /// one beside TRUTH]
    #[arg(long, value_name = "FILE")]
    pub released: Option<PathBuf>,
    /// Errors up to which a point counts as recovered, separated by commas [default: 0.10,0.25 in
    /// meters, 1,5,10,25 in pixels, else 1.0,2.5]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::threshold)]
    pub thresholds: Vec<Threshold>,
    /// Print the results as JSON, like a row of audit.json
    #[arg(long)]
    pub json: bool,
}

/// Options of `split`.
#[derive(Debug, Args)]
#[command(after_help = "\
Parts are called part-000000.parquet and so on, in the order of the rows. _manifest.json holds the
rows and bytes of each part, and which map they belong to. Commands that read FILE also read the
folder, and so do engines that read Parquet. unlift also reads a folder that an engine wrote, with
or without a manifest.

Examples:
  unlift split hidden/released.parquet --out hidden/released
  unlift split lists --rows 100000 --out lists-in-parts")]
pub struct SplitArgs {
    /// A Parquet file that obfuscate, neighbors or recover wrote, or a folder of its parts
    #[arg(value_name = "FILE")]
    pub path: PathBuf,
    /// Rows per part; an odd number is rounded up
    #[arg(long, value_name = "N", default_value_t = 1 << 20, value_parser = value_parser!(u64).range(1..=u64::from(u32::MAX)))]
    pub rows: u64,
    /// Folder for the parts
    #[arg(long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Replace files of the same names that unlift did not write
    #[arg(long)]
    pub force: bool,
}

/// Options of `export`.
#[derive(Debug, Args)]
#[command(after_help = "\
The ending of --out decides what is written:
  .ply             points
  .obj             released lines or rays, as segments
  transforms.json  cameras for nerfstudio, and the points in sparse_pc.ply beside it
  no ending        a folder with a COLMAP model in text (cameras.txt, images.txt, points3D.txt)

Every file that shows points is as private as the map.

Examples:
  unlift export back.parquet --scale 1 --out back.ply
  unlift export hidden/released.parquet --scale 1 --out lines.obj
  unlift export back.parquet --scale 1 --cameras PROJECT --out back-model
  unlift export back.parquet --scale 1 --cameras PROJECT --out back-nerf/transforms.json")]
pub struct ExportArgs {
    /// A released, recovered or truth file of a map
    #[arg(value_name = "FILE")]
    pub path: PathBuf,
    /// File or folder to write; its ending decides the format, see below
    #[arg(long, value_name = "PATH")]
    pub out: PathBuf,
    /// Meters per unit of the map, as given to unlift obfuscate: the output then fits the map
    /// [default: lengths as in FILE]
    #[arg(long, value_name = "METERS", value_parser = values::scale)]
    pub scale: Option<f64>,
    /// A COLMAP model or project of the same map; its cameras and images go into the exported model
    /// or transforms.json
    #[arg(long, value_name = "PROJECT")]
    pub cameras: Option<PathBuf>,
    /// Replace files of the same name that unlift did not write
    #[arg(long)]
    pub force: bool,
}
