//! Arguments that audits of maps and of images share.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use unlift::neighbors::oracle::Noise;
use unlift::recover::{Builtin, Delta};

use crate::values;
use unlift_audit::Gate;

/// How the attacker works.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Attack")]
pub struct AttackArgs {
    /// Shares of true neighbors to try, by commas (oracle) [default: 1,0.75,0.5,0.3,0.2,0.1]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::ratio)]
    pub inlier_ratios: Vec<f64>,
    /// How the oracle errs, by commas or repeated: uniform (any record), near (the 2K-th to 10K-th
    /// nearest), clustered (wrong places that neighbors share, as of look-alike descriptors) [default: uniform]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::noise)]
    pub oracle_noise: Vec<Noise>,
    /// Do not use rules that tie records together (cp: swaps are mutual; ray-voxel: parity)
    #[arg(long)]
    pub no_exact_constraints: bool,
    /// Add a row per scheme for an attacker who is told where three true neighbors of every point are
    #[arg(long)]
    pub reference: bool,
    /// Records per list of an attacker's own sources [default: each source's own choice]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u16).range(1..))]
    pub source_k: Option<u16>,
    /// Distance up to which a neighbor supports a position, in the unit of the audit
    #[arg(long, value_name = "auto|VALUE", value_parser = values::delta, default_value = "auto")]
    pub delta: Delta,
    /// Average over this many seeds
    #[arg(long, value_name = "N", default_value = "1",
          value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub repeats: u32,
}

/// What becomes of the figures.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Result")]
pub struct ResultArgs {
    /// Fail (exit code 1) when more than this comes back; repeatable, see below
    #[arg(long, value_name = "GATE", value_parser = Gate::parse)]
    pub gate: Vec<Gate>,
    /// Also write how the gates ended as JUnit XML, as GitLab, Jenkins and others show it
    #[arg(long, value_name = "FILE", requires = "gate")]
    pub junit: Option<PathBuf>,
    /// Also write the gates that failed as SARIF 2.1.0, as GitHub shows it
    #[arg(long, value_name = "FILE", requires = "gate")]
    pub sarif: Option<PathBuf>,
    /// Folder for report.html and audit.json (and clouds); whatever else is in it stays
    #[arg(long, value_name = "DIR", default_value = "unlift-audit")]
    pub out: PathBuf,
    /// Replace files of that name that unlift did not write
    #[arg(long)]
    pub force: bool,
    /// A report that can be shown: figures only, no points, paths, names or hashes
    #[arg(long)]
    pub share_safe: bool,
    /// Print a summary as JSON on stdout in place of the table
    #[arg(long)]
    pub json: bool,
    /// The configuration and the line of it that ask for the audit, seen from where `check` was started.
    #[arg(skip)]
    pub asked_at: Option<(String, usize)>,
}

/// How the program runs.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Run")]
pub struct RunArgs {
    /// Threads to use; never changes a figure [default: one per core]
    #[arg(long, value_parser = values::threads, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// No progress on stderr
    #[arg(long)]
    pub quiet: bool,
}

/// What recovers a map.
#[derive(Clone, Debug, Args)]
pub struct SolverArgs {
    /// Recovery methods, by commas or repeated: joint, joint-start, consensus, ransac, density, tomography
    /// [default: joint, and joint-start, the pass that it begins with; consensus on maps of fewer than 150 K points]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = values::solver,
          help_heading = "Attack")]
    pub solver: Vec<Builtin>,
    /// Leave out the second baseline: attacks on the released records alone, without neighborhoods and
    /// descriptors
    #[arg(long, help_heading = "Attack")]
    pub no_records_alone: bool,
}
