//! Arguments of what sets figures beside each other.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use unlift::audit::Threshold;
use unlift::obfuscate::Entry;
use unlift::recover::{Builtin, Delta};
use unlift_audit::paper::{Dataset, Part};
use unlift_report::export::TableFormat;

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
    #[arg(long, value_name = "csv|latex|markdown", hide_possible_values = true, value_parser = values::one_of([
        ("csv", TableFormat::Csv),
        ("latex", TableFormat::Latex),
        ("markdown", TableFormat::Markdown),
    ]))]
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

/// Options of `paper`.
#[derive(Debug, Args)]
#[command(after_help = "\
PATH is the folder of the scenes, as the dataset's owners pack them:

  7scenes    chess/TestSplit.txt, chess/seq-01/frame-000000.color.png and .pose.txt
  12scenes   apt1/kitchen/split.txt, apt1/kitchen/data/frame-000000.color.jpg and .pose.txt
  cambridge  ShopFacade/dataset_test.txt, dataset_train.txt, seq1/frame00001.png and
             reconstruction.nvm

Maps are looked for in SCENE and its folders sparse, triangulated, model_train, sfm and
sfm_sift, and where hloc unpacks published ones (7scenes_sfm_triangulated and
CambridgeLandmarks_Colmap_Retriangulated_1024px); --models names another folder with one per
scene. How long their unit is, the poses of the dataset say.

Every scene that is there is audited as unlift audit map and unlift audit images do, into a
folder of its own below DIR; DIR has paper.json and paper.csv: every number of the paper's
tables and ours, of the strongest attack that was tried. What is missing is told, with where
its owners publish it.

Examples:
  unlift paper --dataset 7scenes datasets/7scenes
  unlift paper --dataset cambridge datasets/cambridge --scenes ShopFacade --parts maps
  unlift paper --dataset 12scenes datasets/12scenes --models outputs/12scenes --images 100

Exit codes: 0 done, 2 usage, 3 bad input, be it a single scene or photo; the others are audited.")]
pub struct PaperArgs {
    /// The folder of the dataset
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
    /// Which dataset
    #[arg(long, value_name = "7scenes|12scenes|cambridge", hide_possible_values = true, value_parser = values::one_of([
        ("7scenes", Dataset::SevenScenes),
        ("12scenes", Dataset::TwelveScenes),
        ("cambridge", Dataset::Cambridge),
    ]))]
    pub dataset: Dataset,
    /// A folder with a map per scene (DIR/chess, DIR/apt1/kitchen), in place of those in PATH
    #[arg(long, value_name = "DIR")]
    pub models: Option<PathBuf>,
    /// Meters per unit of all maps [default: what the poses of the dataset say]
    #[arg(long, value_name = "METERS", value_parser = values::scale)]
    pub scale: Option<f64>,
    /// Only these scenes, by commas [default: all that are there]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub scenes: Vec<String>,
    /// Only these parts of the tables, by commas: maps, images (both by an oracle), estimated (neighbors
    /// from descriptors), pictures [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',', hide_possible_values = true,
          value_parser = values::one_of(Part::ALL.map(|part| (part.name(), part))))]
    pub parts: Vec<Part>,
    /// Photos of the test split per scene, evenly spaced over their names
    #[arg(long, value_parser = values::count, value_name = "N", default_value = "20")]
    pub images: NonZeroUsize,
    /// Points per map, a random subset, of which less comes back than of all [default: all]
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_points: Option<NonZeroUsize>,
    /// Random seed
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// Folder for paper.json, paper.csv and the audits of scenes; whatever else is in it stays
    #[arg(long, value_name = "DIR", default_value = "unlift-paper")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
    /// Print paper.json in place of the tables
    #[arg(long)]
    pub json: bool,
    /// Threads to use; never changes a figure [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

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
    /// Random seed
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// Threads to use [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// Print JSON in place of the table
    #[arg(long)]
    pub json: bool,
}
