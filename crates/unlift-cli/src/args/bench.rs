//! Arguments of `unlift bench`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use unlift::obfuscate::Entry;
use unlift::recover::{Builtin, Delta};

use crate::values;

/// Options of `bench recover`.
#[derive(Debug, Args)]
#[command(after_help = "\
Seconds are those of positions alone, as the paper's are; an audit also finds out how sure each of them
is, which --confidence adds.

Examples:
  unlift bench recover --points 700000 --scheme ppl
  unlift bench recover --points 100000 --scheme plane --map PROJECT --solver joint,ransac --json

The paper's seconds (64 cores) are shown where it measured the same scheme, K, inlier ratio and
number of points: ppl, 50, and 100000, 300000 or 700000.")]
pub struct BenchRecoverArgs {
    /// Points of the map
    #[arg(long, value_parser = values::made_points, value_name = "N", default_value = "700000")]
    pub points: NonZeroUsize,
    /// Map to thin out, or to repeat side by side with a jitter [default: the room of the demo]
    #[arg(long, value_name = "PATH")]
    pub map: Option<PathBuf>,
    /// The scheme, see unlift schemes
    #[arg(long, value_name = "SCHEME", value_parser = values::scheme, default_value = "ppl")]
    pub scheme: &'static Entry,
    /// Neighbors per hidden point
    #[arg(long, value_name = "K", default_value = "50",
          value_parser = clap::value_parser!(u16).range(1..))]
    pub k: u16,
    /// Shares of true neighbors to try, by commas
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::ratio,
          default_value = "1,0.5,0.3,0.2,0.1")]
    pub inlier_ratios: Vec<f64>,
    /// Recovery methods, by commas or repeated: joint, joint-start, consensus, ransac, density,
    /// tomography
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::solver,
          default_value = "joint")]
    pub solver: Vec<Builtin>,
    /// Distance up to which a neighbor supports a position, in the unit of the map
    #[arg(long, value_name = "auto|VALUE", value_parser = values::delta, default_value = "auto")]
    pub delta: Delta,
    /// Also find out how sure every position is, as an audit does
    #[arg(long)]
    pub confidence: bool,
    /// The integer that all randomness comes from
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// Threads to use [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// Print JSON in place of the table
    #[arg(long)]
    pub json: bool,
}
