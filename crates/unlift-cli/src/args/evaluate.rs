//! Arguments of `unlift evaluate`.

use crate::values;
use clap::Args;
use std::path::PathBuf;
use unlift::audit::Threshold;

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
