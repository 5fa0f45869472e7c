//! Arguments of `unlift compare`.

use std::path::PathBuf;

use clap::Args;

use crate::values;

/// Options of `compare`.
#[derive(Debug, Args)]
#[command(after_help = "\
Figures are compared by scheme, source of neighborhoods, noise, inlier ratio (of the oracle; of
others it is a result), K, solver and threshold, and the baselines by scheme and threshold. Rows
that only one audit has are told. A scheme or source that the new audit has nothing to compare of
fails as well: nothing says that it leaks no more.

Audits in other units or with other thresholds are refused (exit code 3).

Examples:
  unlift compare before/audit.json unlift-audit/audit.json
  unlift compare before/audit.json unlift-audit/audit.json --tolerance 2.5 --out compared
  unlift compare before/audit.json unlift-audit/audit.json --json

Exit codes: 0 nothing leaks more, 1 something does by more than the tolerance, 2 usage, 3 bad input.")]
pub struct CompareArgs {
    /// The figures of the earlier audit
    #[arg(value_name = "OLD.json")]
    pub old: PathBuf,
    /// The figures of the later audit
    #[arg(value_name = "NEW.json")]
    pub new: PathBuf,
    /// Percentage points up to which a figure counts as the same [default: twice the spread of repeats, or 2 without repeats]
    #[arg(long, value_name = "POINTS", value_parser = values::points)]
    pub tolerance: Option<f64>,
    /// Also write a page, compare.html, to this folder; whatever else is in it stays
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace a file of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
    /// Print all of it as JSON in place of the text
    #[arg(long)]
    pub json: bool,
}
