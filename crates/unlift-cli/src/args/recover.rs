//! Arguments of `unlift recover`.

use crate::values;
use clap::Args;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use unlift::recover::Builtin;
use unlift::recover::Delta;

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
    /// Do not use rules that tie records together (cp: swaps are mutual; ray-voxel: parity)
    #[arg(long)]
    pub no_exact_constraints: bool,
    /// Distance up to which a neighbor supports a position, in the unit of the map
    #[arg(long, value_name = "auto|VALUE", value_parser = values::delta, default_value = "auto")]
    pub delta: Delta,
    /// The integer that all randomness comes from
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
