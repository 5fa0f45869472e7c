//! The command line as types. What a string means is in `values.rs`.

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use unlift::audit::Threshold;
use unlift::neighbors::oracle::Noise;
use unlift::neighbors::sources::Joined;
use unlift::obfuscate::Entry;
use unlift::recover::{Delta, Solver};

use crate::args_audit::{AttackArgs, ResultArgs, RunArgs};
use crate::args_bench::BenchRecoverArgs;
use crate::args_features::FeaturesArgs;
use crate::args_images::AuditImagesArgs;
use crate::args_released::AuditReleasedArgs;
use crate::values::{self, NeighborSource, OutlierFilter};

/// How much of a privacy-preserving ("obfuscated") SfM map or image comes back?
#[derive(Debug, Parser)]
#[command(
    name = "unlift",
    version,
    term_width = 100,
    after_help = "\
Examples:
  unlift demo                                  audit a made-up room, no data needed
  unlift audit map PROJECT/sparse/0 --scale 1  audit a COLMAP map that is in meters
  unlift audit images photos                   audit the keypoints of photos
  unlift schemes                               what can be audited

Exit codes: 0 done, 1 a gate failed, 2 usage, 3 bad input.
Recovered points are as private as the original map."
)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

impl Cli {
    /// Reads a command line, the name of the program first.
    ///
    /// # Errors
    /// When it is none of ours, or asks for help.
    pub fn read(
        line: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    ) -> Result<Self, clap::Error> {
        let matches = numbers_may_be_negative(Self::command()).try_get_matches_from(line)?;
        Self::from_arg_matches(&matches)
    }
}

/// So that `--scale -1` is told what is wrong with -1, not that there is no option `-1`.
fn numbers_may_be_negative(command: clap::Command) -> clap::Command {
    let forgiving = |arg: clap::Arg| match arg.get_action().takes_values() && !arg.is_positional() {
        true => arg.allow_negative_numbers(true),
        false => arg,
    };
    command.mut_args(forgiving).mut_subcommands(numbers_may_be_negative)
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Audit a made-up furnished room under every scheme
    Demo(DemoArgs),
    /// Audit what you have
    #[command(subcommand)]
    Audit(AuditCommand),
    /// Hide the points of a map, or the keypoints of images, by one scheme: a released file and a truth file
    Obfuscate(ObfuscateArgs),
    /// Make neighborhoods
    #[command(subcommand)]
    Neighbors(NeighborsCommand),
    /// Recover the points of an obfuscated map, from released files alone
    Recover(RecoverArgs),
    /// Compare recovered points with the truth
    Evaluate(EvaluateArgs),
    /// Measure speed and memory
    #[command(subcommand)]
    Bench(BenchCommand),
    /// Keypoints and descriptors of photos, or of a file of features, as hloc stores them
    Features(FeaturesArgs),
    /// List the schemes: rule, what stays hidden, source, stated patents
    Schemes,
}

/// What can be audited.
#[derive(Debug, Subcommand)]
#[command(after_help = "\
Examples:
  unlift audit map PROJECT --scale 1
  unlift audit images photos
  unlift audit released mine.parquet --truth truth.parquet")]
pub enum AuditCommand {
    /// Audit a 3D map: COLMAP, PLY, CSV, XYZ or NPY
    // Boxed: ten times the size of the other commands.
    Map(Box<AuditMapArgs>),
    /// Audit images: a folder of photos, hloc's features.h5, or a COLMAP database.db
    Images(Box<AuditImagesArgs>),
    /// Audit records that you made yourself: released.parquet and truth.parquet of a scheme of your own
    Released(Box<AuditReleasedArgs>),
}

/// Options of `demo`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift demo
  unlift demo --out /tmp/room")]
pub struct DemoArgs {
    /// Folder for report.html and audit.json; whatever else is in it stays
    #[arg(long, value_name = "DIR", default_value = "unlift-demo")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
    /// Threads to use [default: one per core]
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

/// What is read, and what one unit of it means: shared by `audit map` and `obfuscate`.
#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct MapArgs {
    /// Meters per unit of the map. Without it the unit is the median distance to the K-th neighbor
    #[arg(long, value_name = "METERS_PER_UNIT", value_parser = values::scale)]
    pub scale: Option<f64>,
    /// Descriptors of the points: a COLMAP database.db, a .npy array with a row per point (of a COLMAP
    /// model by ascending point id), or a file that begins with P3DESC01
    #[arg(long, value_name = "FILE")]
    pub descriptors: Option<PathBuf>,
    /// Use a random subset of at most this many points
    #[arg(long, value_name = "N")]
    pub max_points: Option<NonZeroUsize>,
    /// Leave out points whose mean distance to this many neighbors exceeds the mean of all by more
    /// than RATIO standard deviations [default when given: 20,2.0]
    #[arg(long, value_name = "NEIGHBORS,RATIO", value_parser = values::outlier_filter,
          num_args = 0..=1, require_equals = true, default_missing_value = "20,2.0")]
    pub outlier_filter: Option<OutlierFilter>,
    /// True neighbors per point
    #[arg(long, value_name = "K", default_value = "50",
          value_parser = clap::value_parser!(u16).range(1..))]
    pub k: u16,
    /// The integer that all randomness comes from [default: 0 for audits; obfuscate uses a fresh key
    /// of 256 bits instead, as whoever guesses the integer undoes the hiding]
    #[arg(long, value_name = "INTEGER")]
    pub seed: Option<u64>,
}

/// Options of `audit map`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift audit map PROJECT --scale 1
  unlift audit map cloud.ply --schemes ppl,ppl+ --inlier-ratios 1,0.5 --out ppl-audit
  unlift audit map PROJECT --scale 1 --gate 'ppl@0.5:0.10<=20' --gate 'all:0.25:gain<=30'
  unlift audit map PROJECT --descriptors PROJECT/database.db --neighbors overlap \
    --gate 'all:overlap:1.0<=20'
  unlift audit map PROJECT --neighbors lists-by-point.parquet --solver joint,ransac
  unlift audit map PROJECT --descriptors PROJECT/database.db --neighbors oracle --neighbors overlap
  unlift audit map PROJECT --share-safe --json

Gates: SCHEME[:SOLVER][:SOURCE][@RATIO]:THRESHOLD[:gain]<=PERCENT. SCHEME may be all; without @RATIO
every ratio counts, without a solver or a source of neighborhoods every one; every noise model
counts; the largest figure decides, which is that of the strongest attack. :gain bounds what
neighborhoods add to an attacker without them (a blind guess, or what the records alone give, the
larger), in percentage points. A gate that names something not in the audit is a usage error; one on
a scheme that could not be applied to the map fails.

Exit codes: 0 done, 1 a gate failed, 2 usage, 3 bad input.")]
pub struct AuditMapArgs {
    /// A COLMAP model or project folder, or a .ply, .csv, .xyz, .txt or .npy file
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
    #[command(flatten)]
    pub map: MapArgs,
    /// Schemes to audit, by commas [default: all, see unlift schemes]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::scheme,
          help_heading = "Attack")]
    pub schemes: Vec<&'static Entry>,
    /// Recovery methods, by commas or repeated: joint, joint-start, consensus, ransac, density, tomography
    /// [default: joint, and joint-start, the pass that it begins with; consensus on maps of fewer than 150 K points]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::solver,
          help_heading = "Attack")]
    pub solver: Vec<Solver>,
    /// Leave out the second baseline: attacks on the released records alone, without neighborhoods and
    /// descriptors
    #[arg(long, help_heading = "Attack")]
    pub no_records_alone: bool,
    /// Where neighborhoods come from, repeatable: oracle (made from the map itself); what an attacker
    /// makes from the released map (similarity, overlap, geometric, or several joined by +); or a file
    #[arg(long, value_name = "oracle|SOURCE|FILE", value_parser = values::neighbor_source,
          default_value = "oracle", help_heading = "Attack")]
    pub neighbors: Vec<NeighborSource>,
    #[command(flatten)]
    pub attack: AttackArgs,
    /// Errors up to which a point counts as recovered, by commas; kept as typed
    /// [default: 0.10,0.25 with --scale, else 1.0,2.5]
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

/// Options of `obfuscate`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  unlift obfuscate PROJECT --scheme ppl --scale 1 --out hidden
  unlift obfuscate PROJECT --scheme olc --descriptors PROJECT/database.db --out hidden
  unlift obfuscate features.h5 --scheme dcl2d --out hidden-images

Writes hidden/released.parquet (what an attacker sees) and hidden/truth.parquet (keep it private).
What is drawn comes from a fresh 256-bit key that is kept nowhere. With --seed it comes from that
number, for experiments only: whoever guesses it undoes the order of the records, and cp entirely.")]
pub struct ObfuscateArgs {
    /// A COLMAP model or project folder, or a .ply, .csv, .xyz, .txt or .npy file; of images hloc's features.h5, a
    /// COLMAP database.db, or a folder of photos
    #[arg(value_name = "PATH")]
    pub path: PathBuf,
    /// The scheme, see unlift schemes; those for images take features of images
    #[arg(long, value_name = "SCHEME", value_parser = values::any_scheme)]
    pub scheme: &'static Entry,
    /// Folder for released.parquet and truth.parquet; whatever else is in it stays
    #[arg(long, value_name = "DIR", default_value = "unlift-obfuscated")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub map: MapArgs,
}

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
Sources: similarity (any descriptors), overlap (SIFT), geometric (no descriptors), or several joined by +.

Examples:
  unlift neighbors find hidden/released.parquet --source overlap --out lists.parquet
  unlift neighbors find hidden/released.parquet --source overlap+geometric --k 20")]
pub struct FindArgs {
    /// A released map
    #[arg(value_name = "OBFUSCATED")]
    pub released: PathBuf,
    /// How: a source, or several joined by +
    #[arg(long, value_name = "SOURCE", value_parser = values::joined)]
    pub source: Joined,
    /// Records per list [default: the source's own choice]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u16).range(1..))]
    pub k: Option<u16>,
    /// The integer that all randomness comes from
    #[arg(long, value_name = "INTEGER", default_value_t = 0)]
    pub seed: u64,
    /// Threads to use; never changes a result [default: one per core]
    #[arg(long, value_name = "N")]
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
    pub solver: Solver,
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
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// File to write
    #[arg(long, value_name = "FILE", default_value = "recovered.parquet")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
}

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

/// What can be measured.
#[derive(Debug, Subcommand)]
pub enum BenchCommand {
    /// Seconds of recovery per inlier ratio, beside those of the paper
    Recover(BenchRecoverArgs),
}

#[cfg(test)]
mod tests {
    use super::*;

    fn audit(arguments: &[&str]) -> Result<AuditMapArgs, clap::Error> {
        let line = ["unlift", "audit", "map", "PATH"].iter().chain(arguments);
        match Cli::read(line)?.command {
            Command::Audit(AuditCommand::Map(args)) => Ok(*args),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_definition_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn defaults_are_those_of_the_documentation() {
        let args = audit(&[]).unwrap();
        assert_eq!((args.map.k, args.map.seed, args.attack.repeats), (50, None, 1));
        assert!(args.solver.is_empty() && !args.no_records_alone);
        assert_eq!((args.attack.delta, args.map.outlier_filter), (Delta::Auto, None));
        assert_eq!(args.neighbors, [NeighborSource::Oracle]);
        assert!(
            args.attack.inlier_ratios.is_empty()
                && args.attack.oracle_noise.is_empty()
                && args.attack.source_k.is_none()
        );
        assert!(args.schemes.is_empty() && args.thresholds.is_empty());
    }

    #[test]
    fn negative_numbers_are_values_that_are_refused_as_such() {
        for (option, expected) in [
            ("--scale", "meters per unit of the map, a number above 0, found -1"),
            ("--thresholds", "expected a number above 0, found -1"),
            ("--inlier-ratios", "expected a number from 0 to 1, found -1"),
            ("--delta", "expected auto or a number above 0, found -1"),
            ("--k", "-1 is not in 1..=65535"),
        ] {
            let error = audit(&[option, "-1"]).unwrap_err().to_string();
            assert!(error.contains(expected), "{option}: {error}");
        }
    }

    #[test]
    fn lists_are_split_at_commas_and_repeated_options_add_up() {
        let args =
            audit(&["--solver", "consensus", "--solver", "ransac", "--schemes=ppl+,cp"]).unwrap();
        assert_eq!(args.solver, [Solver::Consensus, Solver::Ransac]);
        let names: Vec<&str> = args.schemes.iter().map(|scheme| scheme.name).collect();
        assert_eq!(names, ["ppl+", "cp"]);
    }

    #[test]
    fn the_outlier_filter_has_a_default_when_named() {
        let filter = |arguments: &[&str]| audit(arguments).unwrap().map.outlier_filter;
        let usual = OutlierFilter { neighbors: 20, std_ratio: 2.0 };
        assert_eq!(filter(&["--outlier-filter"]), Some(usual));
        let strict = OutlierFilter { neighbors: 8, std_ratio: 1.5 };
        assert_eq!(filter(&["--outlier-filter=8,1.5"]), Some(strict));
    }

    #[test]
    fn private_clouds_and_a_shareable_report_exclude_each_other() {
        let error = audit(&["--write-clouds", "--share-safe"]).unwrap_err();
        assert_eq!(error.exit_code(), 2);
    }
}
