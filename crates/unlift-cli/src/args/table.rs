//! Arguments of `unlift table`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use unlift::audit::Threshold;
use unlift_report::export;

use crate::values;

/// Options of `table`.
#[derive(Debug, Args)]
#[command(after_help = "\
csv has every row of audit.json and a column per figure. latex (for the package booktabs) and
markdown have a row per scheme and a column per share of right neighbors (oracle) and per source,
with the strongest attack tried, and the baselines beside them; several thresholds stand in one cell.

Curves are percent recovered over the share of right neighbors, of the strongest attack per scheme.
For PDF, convert them: rsvg-convert -f pdf -o curves.pdf curves.svg, or Inkscape.

Examples:
  unlift table unlift-audit/audit.json --format markdown
  unlift table unlift-audit/audit.json --format latex --threshold 0.10 --out table.tex
  unlift table unlift-audit/audit.json --format csv --out rows.csv --curves curves.svg")]
pub struct TableArgs {
    /// The figures of an audit
    #[arg(value_name = "AUDIT.json")]
    pub audit: PathBuf,
    /// How the table is written
    #[arg(long, value_enum, value_name = "csv|latex|markdown", hide_possible_values = true)]
    pub format: TableFormat,
    /// Only what is recovered within this threshold of the audit [default: all; curves: the first, in
    /// pixels the nearest to 10]
    #[arg(long, value_name = "T", value_parser = values::threshold)]
    pub threshold: Option<Threshold>,
    /// Write the table to this file in place of stdout
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Also draw the curves to this file (SVG)
    #[arg(long, value_name = "FILE")]
    pub curves: Option<PathBuf>,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
}

/// How a table is written.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum TableFormat {
    Csv,
    Latex,
    Markdown,
}

impl From<TableFormat> for export::TableFormat {
    fn from(format: TableFormat) -> Self {
        match format {
            TableFormat::Csv => Self::Csv,
            TableFormat::Latex => Self::Latex,
            TableFormat::Markdown => Self::Markdown,
        }
    }
}
