//! One file per command: parse, call the library, print.

mod audit_images;
mod audit_map;
mod audit_released;
mod bench;
mod demo;
mod evaluate;
mod features;
mod image_stages;
mod neighbors;
mod obfuscate;
mod plan;
mod recover;
mod schemes;

use std::num::NonZeroUsize;
use std::path::Path;

pub use evaluate::expect_slots;
pub use obfuscate::{RELEASED, TRUTH};

use crate::args::{AuditCommand, BenchCommand, Command, MapArgs, NeighborsCommand};
use crate::exit::Outcome;
use crate::progress::Spinner;
use unlift::Fingerprint;
use unlift_audit::{Preparation, Prepared, maps};
use unlift_io::read::Input;

/// Runs one command.
///
/// # Errors
/// Whatever keeps it from its result; `exit` turns it into a line and a code.
pub fn run(command: Command) -> anyhow::Result<Outcome> {
    match command {
        Command::Demo(args) => demo::run(&args),
        Command::Audit(AuditCommand::Map(args)) => audit_map::run(*args),
        Command::Audit(AuditCommand::Images(args)) => audit_images::run(&args),
        Command::Audit(AuditCommand::Released(args)) => audit_released::run(&args),
        Command::Obfuscate(args) => obfuscate::run(&args),
        Command::Neighbors(NeighborsCommand::Oracle(args)) => neighbors::oracle(&args),
        Command::Neighbors(NeighborsCommand::Find(args)) => neighbors::find(&args),
        Command::Recover(args) => recover::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Bench(BenchCommand::Recover(args)) => bench::recovery(&args),
        Command::Features(args) => features::run(&args),
        Command::Schemes => schemes::run(),
    }
}

/// Runs `work` on `threads` threads (all cores without a number); never changes a result.
fn with_threads<T: Send>(
    threads: Option<NonZeroUsize>,
    work: impl FnOnce() -> anyhow::Result<T> + Send,
) -> anyhow::Result<T> {
    let n = threads.map_or(0, NonZeroUsize::get);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build()?;
    pool.install(work)
}

/// Refuses `file` when it is about another released map than `of`; what does not say is taken.
pub fn same_map(
    file: &Path,
    found: Option<Fingerprint>,
    of: &Path,
    expected: Option<Fingerprint>,
) -> Result<(), unlift_io::Error> {
    match (found, expected) {
        (Some(found), Some(expected)) if found != expected => {
            let expected = format!("{expected}, that of the released map of {}", of.display());
            Err(unlift_io::Error::new(file, "fingerprint", expected, found.to_string()))
        }
        _ => Ok(()),
    }
}

/// Reads a map and makes it ready: the first step of `audit map` and `obfuscate`.
fn open_map(path: &Path, args: &MapArgs, quiet: bool) -> anyhow::Result<(Input, Prepared)> {
    let alive = Spinner::unless(quiet, "reading the map");
    let preparation = Preparation {
        scale: args.scale,
        k: usize::from(args.k),
        outlier_filter: args.outlier_filter,
        max_points: args.max_points.map(NonZeroUsize::get),
        seed: args.seed.unwrap_or(0),
    };
    Ok(maps::open(path, args.descriptors.as_deref(), &preparation, &alive)?)
}
