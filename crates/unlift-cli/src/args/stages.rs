//! Arguments of the stages: from a map to lists, to what came back, to figures.

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

Writes hidden/released.parquet (what an attacker sees) and hidden/truth.parquet (keep it private).
What is drawn comes from a fresh 256-bit key that is kept nowhere. With --seed it comes from that
number, for experiments only: whoever guesses it undoes the order of the records, and cp entirely.
Release a map once: of two releases with descriptors, records of the same point meet in it.")]
pub struct ObfuscateArgs {
    /// A map as audit map reads it: a COLMAP model or project folder, a .ply, .csv or .npy file; of images hloc's features.h5, a
    /// COLMAP database.db, or a folder of photos
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
    /// The scheme, see unlift schemes; those for images take features of images
    #[arg(long, value_name = "SCHEME", value_parser = values::any_scheme)]
    pub scheme: &'static Entry,
    /// Folder for released.parquet and truth.parquet; whatever else is in it stays
    #[arg(long, value_name = "DIR", default_value = "unlift-obfuscated")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub map: MapArgs,
}

/// Sources of neighborhoods.
#[derive(Debug, Subcommand)]
#[command(after_help = "\
Examples:
  unlift neighbors oracle hidden/truth.parquet --inlier-ratio 0.5 --out lists.parquet
  unlift neighbors find hidden/released.parquet --source overlap --out lists.parquet")]
pub enum NeighborsCommand {
    /// From the truth, at a chosen inlier ratio: an attacker of stated quality
    Oracle(OracleArgs),
    /// List neighbors from a released map alone, as an attacker does
    Find(FindArgs),
}

/// Options of `neighbors find`.
#[derive(Debug, Args)]
#[command(after_help = "\
Sources: descriptors (the best that they allow without training: overlap or similarity), similarity (any descriptors),
overlap (SIFT), learned (a network; SIFT or ALIKED), geometric (no descriptors).

Examples:
  unlift neighbors find hidden/released.parquet --source overlap --out lists.parquet
  unlift neighbors find hidden/released.parquet --source geometric --k 20")]
pub struct FindArgs {
    /// A released map
    #[arg(value_name = "OBFUSCATED")]
    pub released: PathBuf,
    /// Where the lists come from, see below
    #[arg(long, value_name = "SOURCE", value_parser = values::own_source)]
    pub source: Named,
    /// Records per list [default: the source's own choice]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u16).range(1..))]
    pub k: Option<u16>,
    /// Random seed
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// Threads to use; never changes a result [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// File to write
    #[arg(long, value_name = "FILE", default_value = "neighborhoods.parquet")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
}

/// Options of `neighbors oracle`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  unlift neighbors oracle hidden/truth.parquet --inlier-ratio 0.5 --out lists.parquet")]
pub struct OracleArgs {
    /// The truth.parquet of an obfuscation
    #[arg(value_name = "TRUTH")]
    pub truth: PathBuf,
    /// The released map of the same obfuscation [default: released.parquet beside TRUTH]
    #[arg(long, value_name = "FILE")]
    pub released: Option<PathBuf>,
    /// Share of true neighbors: round(RATIO x K) are kept, the others are wrong
    #[arg(long, value_name = "RATIO", value_parser = values::ratio)]
    pub inlier_ratio: f64,
    /// The wrong ones: uniform (any record), near (the 2K-th to 10K-th nearest), clustered (wrong
    /// places that neighbors share, as of look-alike descriptors)
    #[arg(long, value_name = "MODEL", value_parser = values::noise, default_value = "uniform")]
    pub oracle_noise: Noise,
    /// Neighbors per hidden point
    #[arg(long, value_name = "K", default_value = "50",
          value_parser = clap::value_parser!(u16).range(1..))]
    pub k: u16,
    /// Random seed
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// File to write
    #[arg(long, value_name = "FILE", default_value = "neighborhoods.parquet")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
}

/// Options of `recover`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  unlift recover hidden/released.parquet --neighbors lists.parquet --out back.parquet")]
pub struct RecoverArgs {
    /// A released map
    #[arg(value_name = "OBFUSCATED")]
    pub released: PathBuf,
    /// Lists of records, one per hidden point
    #[arg(long, value_name = "FILE")]
    pub neighbors: PathBuf,
    /// Recovery method: joint, joint-start, consensus, ransac, density or tomography
    #[arg(long, value_name = "SOLVER", value_parser = values::solver, default_value = "joint")]
    pub solver: Builtin,
    /// Do not use constraints between records (cp: swaps are mutual; ray-voxel: parity)
    #[arg(long)]
    pub no_exact_constraints: bool,
    /// Distance up to which a neighbor supports a position, in the unit of the map
    #[arg(long, value_name = "auto|VALUE", value_parser = values::delta, default_value = "auto")]
    pub delta: Delta,
    /// Random seed
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// Threads to use; never changes a result [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// File to write
    #[arg(long, value_name = "FILE", default_value = "recovered.parquet")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
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
    /// Recovered points
    #[arg(value_name = "RECOVERED")]
    pub recovered: PathBuf,
    /// The truth.parquet of the obfuscation
    #[arg(long, value_name = "TRUTH")]
    pub truth: PathBuf,
    /// The released map, for the figures of a blind attacker [default: released.parquet beside TRUTH]
    #[arg(long, value_name = "FILE")]
    pub released: Option<PathBuf>,
    /// Errors that count as recovered, by commas [default: 0.10,0.25 in meters, else 1.0,2.5]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::threshold)]
    pub thresholds: Vec<Threshold>,
    /// Print a row of audit.json in place of the table
    #[arg(long)]
    pub json: bool,
}

/// Options of `split`.
#[derive(Debug, Args)]
#[command(after_help = "\
Parts are part-000000.parquet and following, in the order of the rows; _manifest.json says how many
rows and bytes each has, and what all of them are about. Every command that reads FILE reads the
folder as it does FILE, and so does any engine that reads Parquet. A folder that an engine wrote is
read too, with or without a manifest.

Examples:
  unlift split hidden/released.parquet --out hidden/released
  unlift split lists --rows 100000 --out lists-in-parts")]
pub struct SplitArgs {
    /// A stage file, or a folder of its parts
    #[arg(value_name = "FILE")]
    pub path: PathBuf,
    /// Rows of a part; an odd number is rounded up
    #[arg(long, value_name = "N", default_value_t = 1 << 20, value_parser = value_parser!(u64).range(1..=u64::from(u32::MAX)))]
    pub rows: u64,
    /// The folder for the parts
    #[arg(long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Replace files of those names that unlift did not write
    #[arg(long)]
    pub force: bool,
}

/// Options of `export`.
#[derive(Debug, Args)]
#[command(after_help = "\
The ending of --out says what is written: .ply points, .obj released lines or rays as segments,
transforms.json cameras for nerfstudio, and sparse_pc.ply beside it, none a folder with a COLMAP
model in text (cameras.txt, images.txt, points3D.txt). Whatever shows points is as private as the
map.

Examples:
  unlift export back.parquet --scale 1 --out back.ply
  unlift export hidden/released.parquet --scale 1 --out lines.obj
  unlift export back.parquet --scale 1 --cameras PROJECT --out back-model
  unlift export back.parquet --scale 1 --cameras PROJECT --out back-nerf/transforms.json")]
pub struct ExportArgs {
    /// A released, recovered or truth file of a map
    #[arg(value_name = "FILE")]
    pub path: PathBuf,
    /// File or folder to write
    #[arg(long, value_name = "PATH")]
    pub out: PathBuf,
    /// Meters per unit of the map, as obfuscate was told: what is written lies on the map [default: lengths as in FILE]
    #[arg(long, value_name = "METERS", value_parser = values::scale)]
    pub scale: Option<f64>,
    /// A COLMAP model or project of the same map, whose cameras and images the model gets, or transforms.json
    #[arg(long, value_name = "PROJECT")]
    pub cameras: Option<PathBuf>,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
}
