//! Arguments of `unlift neighbors`.

use crate::values;
use clap::Args;
use clap::Subcommand;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use unlift::neighbors::oracle::Noise;
use unlift::neighbors::sources::Named;

/// Sources of neighborhoods.
#[derive(Debug, Subcommand)]
#[command(after_help = "\
Examples:
  unlift neighbors oracle hidden/truth.parquet --inlier-ratio 0.5 --out lists.parquet
  unlift neighbors find hidden/released.parquet --source overlap --out lists.parquet")]
pub enum NeighborsCommand {
    /// From the truth, at a chosen inlier ratio: an attacker of stated quality
    Oracle(OracleArgs),
    /// From a released map alone, as an attacker would
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
    /// The integer that all randomness comes from
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
    /// The integer that all randomness comes from
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// File to write
    #[arg(long, value_name = "FILE", default_value = "neighborhoods.parquet")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
}
