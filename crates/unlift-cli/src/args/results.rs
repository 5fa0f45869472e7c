//! Arguments of `table` and `compare`.

use std::path::PathBuf;

use clap::Args;
use unlift::audit::Threshold;
use unlift_report::export::TableFormat;

use crate::values;

/// Options of `table`.
#[derive(Debug, Args)]
#[command(after_help = "\
csv has every row of audit.json, and a column per value. latex (for the package booktabs) and
markdown have a row per scheme. Their columns are the inlier ratios of the oracle (the fraction of
true neighbors in its lists), the other sources of neighbors, and the two baselines. A cell has the
percentage that the strongest attack recovers, at each threshold.

For each scheme, a curve shows the percentage that the strongest attack recovers, against the inlier
ratio. To convert curves to PDF, use rsvg-convert -f pdf -o curves.pdf curves.svg, or Inkscape.

Examples:
  unlift table unlift-audit/audit.json --format markdown
  unlift table unlift-audit/audit.json --format latex --threshold 0.10 --out table.tex
  unlift table unlift-audit/audit.json --format csv --out rows.csv --curves curves.svg")]
pub struct TableArgs {
    /// The audit.json of an audit
    #[arg(value_name = "AUDIT.json")]
    pub audit: PathBuf,
    /// Format of the table
    #[arg(long, value_name = "csv|latex|markdown", hide_possible_values = true, value_parser = values::one_of([
        ("csv", TableFormat::Csv),
        ("latex", TableFormat::Latex),
        ("markdown", TableFormat::Markdown),
    ]))]
    pub format: TableFormat,
    /// Show only this threshold (the error up to which a point counts as recovered), one of the
    /// audit's --thresholds. By default, tables show all thresholds, and curves show one: the first
    /// or, for images, the one nearest to 10 pixels
    #[arg(long, value_name = "T", value_parser = values::threshold)]
    pub threshold: Option<Threshold>,
    /// Write the table to this file in place of stdout
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Also draw curves to this file (SVG)
    #[arg(long, value_name = "FILE")]
    pub curves: Option<PathBuf>,
    /// Replace files of the same name that unlift did not write
    #[arg(long)]
    pub force: bool,
}

/// Options of `compare`.
#[derive(Debug, Args)]
#[command(after_help = "\
Two results are compared if they have the same scheme, source of neighbors, noise (--oracle-noise),
number of neighbors K, solver and threshold and, for the oracle, the same inlier ratio. Baselines
are compared by scheme and threshold. Rows that only one of the audits has are listed.

The comparison fails if a result of the later audit is larger by more than --tolerance. It also
fails if a scheme of the earlier audit has no comparable result in the later one, or if a source of
the earlier audit could not be used in the later one.

Audits in different units or with different thresholds are refused (exit code 3).

Examples:
  unlift compare before/audit.json unlift-audit/audit.json
  unlift compare before/audit.json unlift-audit/audit.json --tolerance 2.5 --out compared
  unlift compare before/audit.json unlift-audit/audit.json --json

Exit codes: 0 nothing leaks more, 1 something leaks more or can no longer be compared, 2 wrong
usage, 3 bad input.")]
pub struct CompareArgs {
    /// The audit.json of the earlier audit
    #[arg(value_name = "OLD.json")]
    pub old: PathBuf,
    /// The audit.json of the later audit
    #[arg(value_name = "NEW.json")]
    pub new: PathBuf,
    /// Difference up to which two results count as equal, in percentage points [default: twice the
    /// standard deviation over --repeats, or 2 without --repeats]
    #[arg(long, value_name = "POINTS", value_parser = values::points)]
    pub tolerance: Option<f64>,
    /// Also write a page, compare.html, to this folder; other files in it stay
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace a file of the same name that unlift did not write
    #[arg(long)]
    pub force: bool,
    /// Print the comparison as JSON in place of the text
    #[arg(long)]
    pub json: bool,
}
