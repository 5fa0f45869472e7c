//! Arguments of `table`, `compare` and `paper`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use unlift::audit::Threshold;
use unlift_audit::paper::{Dataset, Part};
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

/// Options of `paper`.
#[derive(Debug, Args)]
#[command(after_help = "\
The paper is Chelani et al., Obfuscation Based Privacy Preserving Representations are Recoverable
Using Neighborhood Information, 3DV 2025.

PATH is the folder of the scenes, with the files that the dataset publishes:

  7scenes    chess/TestSplit.txt, chess/seq-01/frame-000000.color.png and .pose.txt
  12scenes   apt1/kitchen/split.txt, apt1/kitchen/data/frame-000000.color.jpg and .pose.txt
  cambridge  ShopFacade/dataset_test.txt, dataset_train.txt, seq1/frame00001.png and
             reconstruction.nvm

unlift looks for maps in the folder of a scene, in its subfolders sparse, triangulated, model_train,
sfm and sfm_sift, and where hloc unpacks published maps (7scenes_sfm_triangulated and
CambridgeLandmarks_Colmap_Retriangulated_1024px). The scale of a map is computed from the camera
poses of the dataset.

unlift audits each scene like unlift audit map and unlift audit images, and writes one folder per
scene into the folder of --out. paper.json and paper.csv hold every number of the paper's tables
and, next to it, the number for the strongest attack of unlift. Missing data is listed with the web
page that publishes it.

Examples:
  unlift paper --dataset 7scenes datasets/7scenes
  unlift paper --dataset cambridge datasets/cambridge --scenes ShopFacade --parts maps
  unlift paper --dataset 12scenes datasets/12scenes --models outputs/12scenes --images 100

Exit codes: 0 done, 2 wrong usage, 3 bad input (at least one scene or photo; the others are
audited).")]
pub struct PaperArgs {
    /// Folder of the dataset
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
    /// Name of the dataset
    #[arg(long, value_name = "7scenes|12scenes|cambridge", hide_possible_values = true, value_parser = values::one_of([
        ("7scenes", Dataset::SevenScenes),
        ("12scenes", Dataset::TwelveScenes),
        ("cambridge", Dataset::Cambridge),
    ]))]
    pub dataset: Dataset,
    /// Folder with a map per scene (DIR/chess, DIR/apt1/kitchen), to use in place of the maps in
    /// PATH
    #[arg(long, value_name = "DIR")]
    pub models: Option<PathBuf>,
    /// Meters per unit of all maps [default: computed from the camera poses of the dataset]
    #[arg(long, value_name = "METERS", value_parser = values::scale)]
    pub scale: Option<f64>,
    /// Audit only these scenes, separated by commas [default: all in PATH]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub scenes: Vec<String>,
    /// Reproduce only these parts of the tables, separated by commas: maps (points of maps, lists
    /// by the oracle), images (keypoints, lists by the oracle), estimated (keypoints, lists made
    /// from descriptors), pictures (painted from recovered points) [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',', hide_possible_values = true,
          value_parser = values::one_of(Part::ALL.map(|part| (part.name(), part))))]
    pub parts: Vec<Part>,
    /// Number of test photos per scene, evenly spaced by name
    #[arg(long, value_parser = values::count, value_name = "N", default_value = "20")]
    pub images: NonZeroUsize,
    /// Use a random subset of at most N points per map. This makes the attack weaker: it recovers a
    /// smaller percentage than on the full map [default: all]
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_points: Option<NonZeroUsize>,
    /// Random seed
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// Folder for paper.json, paper.csv and the audits of the scenes; other files in it stay
    #[arg(long, value_name = "DIR", default_value = "unlift-paper")]
    pub out: PathBuf,
    /// Replace files of the same name that unlift did not write
    #[arg(long)]
    pub force: bool,
    /// Print paper.json in place of the tables
    #[arg(long)]
    pub json: bool,
    /// Number of threads; results do not depend on it [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// Show no progress on stderr
    #[arg(long)]
    pub quiet: bool,
}
