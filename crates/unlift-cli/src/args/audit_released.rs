//! Arguments of `unlift audit released`.

use std::path::PathBuf;

use clap::Args;
use unlift::audit::Threshold;

use super::audit::{AttackArgs, ResultArgs, RunArgs, SolverArgs};
use crate::values::{self, NeighborSource};

/// Options of `audit released`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift audit released mine.parquet --truth truth.parquet --name mine
  unlift audit released mine.parquet --truth truth.parquet --neighbors oracle --neighbors geometric
  unlift audit released mine.parquet --truth truth.parquet --gate 'all@0.5:0.10<=20' --json

For schemes of your own: make the records with any program and write two Parquet files, of what an
attacker sees and of what is hidden where (docs/formats.md says how, with pyarrow). Every record must
be a line, a ray, an axis-parallel plane, or a point with one foreign coordinate.

Gates are those of unlift audit map, by the name of the scheme, or all.

Exit codes: 0 done, 1 a gate failed, 2 usage, 3 bad input.")]
pub struct AuditReleasedArgs {
    /// A released map
    #[arg(value_name = "RELEASED")]
    pub released: PathBuf,
    /// Its truth: the originals, and the slot that hides each
    #[arg(long, value_name = "TRUTH", help_heading = "Input")]
    pub truth: PathBuf,
    /// What the scheme is called [default: scheme in the metadata of RELEASED, else released]
    #[arg(long, value_name = "NAME", value_parser = values::scheme_name, help_heading = "Input")]
    pub name: Option<String>,
    /// Descriptors of the originals, where RELEASED has none: a .npy array with a row per original, or a file
    /// that begins with P3DESC01
    #[arg(long, value_name = "FILE", help_heading = "Input")]
    pub descriptors: Option<PathBuf>,
    /// True neighbors per point
    #[arg(long, value_name = "K", default_value = "50", help_heading = "Input",
          value_parser = clap::value_parser!(u16).range(1..))]
    pub k: u16,
    /// The integer that the oracle and the attacker draw from
    #[arg(long, value_name = "INTEGER", default_value_t = 0, help_heading = "Input")]
    pub seed: u64,
    #[command(flatten)]
    pub solvers: SolverArgs,
    /// Where neighborhoods come from, repeatable: oracle (made from the truth); what an attacker makes
    /// from the released map: descriptors (the best that they allow without training), similarity, overlap (SIFT),
    /// learned (a network; SIFT or ALIKED), geometric (no descriptors); or a file of lists by original
    #[arg(long, value_name = "oracle|SOURCE|FILE", value_parser = values::neighbor_source,
          default_value = "oracle", help_heading = "Attack")]
    pub neighbors: Vec<NeighborSource>,
    #[command(flatten)]
    pub attack: AttackArgs,
    /// Errors up to which a point counts as recovered, by commas; kept as typed
    /// [default: 0.10,0.25 in meters, else 1.0,2.5]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::threshold,
          help_heading = "Result")]
    pub thresholds: Vec<Threshold>,
    /// Also write original, obfuscated and recovered clouds (PLY, OBJ)
    #[arg(long, help_heading = "Result", conflicts_with = "share_safe")]
    pub write_clouds: bool,
    #[command(flatten)]
    pub result: ResultArgs,
    #[command(flatten)]
    pub run: RunArgs,
}
