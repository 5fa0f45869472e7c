//! Functions that several commands share.

use std::io::Read;
use std::num::NonZeroUsize;
use std::path::Path;

use unlift::released::Released;
use unlift::truth::Secret;
use unlift::{Fingerprint, OneLine};
use unlift_audit::{Preparation, Prepared, maps};
use unlift_io::Error;
use unlift_io::read::Input;
use unlift_report::Document;

use crate::args::MapArgs;
use crate::exit::Outcome;
use crate::progress::Progress;

pub const RELEASED: &str = "released.npz";
/// File name of the truth, which only the owner has.
pub const TRUTH: &str = "truth.npz";

/// Runs `work` on `RAYON_NUM_THREADS` threads (default: all cores). rayon's global pool would panic
/// if the system refuses threads.
pub fn with_threads<T: Send>(work: impl FnOnce() -> crate::Result<T> + Send) -> crate::Result<T> {
    let pool = rayon::ThreadPoolBuilder::new().build();
    let pool = pool
        .map_err(|error| unlift_audit::Error::failed(format!("cannot start threads: {error}")))?;
    pool.install(work)
}

/// Returns an error if `file` belongs to another released map than `of`. A missing fingerprint is
/// accepted.
pub fn same_map(
    file: &Path,
    found: Option<Fingerprint>,
    of: &Path,
    expected: Option<Fingerprint>,
) -> Result<(), Error> {
    match (found, expected) {
        (Some(found), Some(expected)) if found != expected => {
            let expected = format!("{expected}, that of the released map of {}", of.display());
            Err(Error::new(file, "fingerprint", expected, found.to_string()))
        }
        _ => Ok(()),
    }
}

/// Reads and prepares a map, for `audit map` and `obfuscate`. Descriptors that lie beside the model are read with `beside`.
pub fn open_map(
    path: &Path,
    args: &MapArgs,
    beside: bool,
    (seed, quiet): (u64, bool),
) -> crate::Result<(Input, Prepared)> {
    let _alive = Progress::uncounted(quiet, "reading the map");
    let preparation = Preparation {
        scale: args.scale,
        k: usize::from(args.k),
        max_points: args.max_points.map(NonZeroUsize::get),
        beside,
        seed,
    };
    maps::open(path, args.descriptors.as_deref(), &preparation)
}

/// Returns an error if the released map and the truth differ in the number of hidden points, in
/// total or per record.
pub fn expect_slots<const D: usize>(
    path: &Path,
    released: &Released<D>,
    secret: &Secret,
) -> crate::Result<()> {
    let wrong = |expected: usize, what: &str, found: usize| {
        let expected = format!("{expected} hidden points{what}, as in the truth");
        Err(Error::new(path, "", expected, found.to_string()).into())
    };
    if released.n_slots() != secret.n_slots() {
        return wrong(secret.n_slots(), "", released.n_slots());
    }
    if released.slots_per_record() != secret.slots_per_record() {
        return wrong(secret.slots_per_record(), " per record", released.slots_per_record());
    }
    Ok(())
}

/// Reads an `audit.json`.
///
/// # Errors
/// If the file cannot be read, or is no `audit.json` of this version of the format.
pub fn read_document(path: &Path) -> crate::Result<Document> {
    let mut text = String::new();
    let (mut file, _) = unlift_io::input::open(path)?;
    file.read_to_string(&mut text).map_err(|error| Error::read(path, error))?;
    Document::from_json(&text).map_err(|error| {
        let text = error.to_string();
        // The path names the file already.
        let text = text.strip_prefix("audit.json: ").unwrap_or(&text);
        unlift_audit::Error::failed(format!("{}: {}", OneLine(path.display()), OneLine(text)))
    })
}

/// Returns an error if `failed` images could not be `done`; each was reported in a line before.
pub fn all_could_be(done: &str, path: &Path, n: usize, failed: usize) -> crate::Result<Outcome> {
    if failed == 0 {
        return Ok(Outcome::Done);
    }
    let expected = format!("{} images that can be {done}", n + failed);
    Err(Error::new(path, "", expected, n.to_string()).into())
}
