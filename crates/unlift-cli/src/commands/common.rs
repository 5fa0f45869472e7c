//! Functions that several commands share.

use std::io;
use std::num::NonZeroUsize;
use std::path::Path;

use unlift::{Descriptors, OneLine};
use unlift_audit::changes::public_descriptors;
use unlift_audit::{Preparation, Prepared, maps};
use unlift_io::Error;
use unlift_report::Document;
use unlift_vision::network::DescriptorKind;

use crate::args::MapArgs;
use crate::demo::photos;
use crate::progress::Progress;

/// Runs `work` on `RAYON_NUM_THREADS` threads (default: all cores). rayon's global pool would panic if the system refuses threads.
pub fn with_threads<T: Send>(work: impl FnOnce() -> crate::Result<T> + Send) -> crate::Result<T> {
    let pool = rayon::ThreadPoolBuilder::new().build();
    let pool = pool
        .map_err(|error| unlift_audit::Error::failed(format!("cannot start threads: {error}")))?;
    pool.install(work)
}

/// Reads and prepares a map: an `even` number of points, as in an audit, or all. Descriptors that lie beside the model are read with `beside`.
pub fn open_map(
    path: &Path,
    args: &MapArgs,
    (even, beside): (bool, bool),
    (seed, quiet): (u64, bool),
) -> crate::Result<Prepared> {
    let _alive = Progress::uncounted(quiet, "reading the map");
    let preparation = Preparation {
        scale: args.scale,
        k: usize::from(args.k),
        max_points: args.max_points.map(NonZeroUsize::get),
        even,
        beside,
        seed,
    };
    maps::open(path, args.descriptors.as_deref(), &preparation)
}

/// Reads the descriptors that owner and attacker know, by default those of the photos of the demo.
pub fn public(path: Option<&Path>, kind: DescriptorKind) -> crate::Result<Descriptors> {
    match path {
        Some(path) => public_descriptors(path, kind, None),
        None => public_descriptors(photos::folder()?.path(), kind, Some(photos::MIN_SCORE)),
    }
}

/// Reads an `audit.json` of this version of the format.
pub fn read_document(path: &Path) -> crate::Result<Document> {
    let (file, _) = unlift_io::input::open(path)?;
    let text = io::read_to_string(file).map_err(|error| Error::read(path, error))?;
    Document::from_json(&text).map_err(|error| {
        let text = error.to_string();
        // The path names the file already.
        let text = text.strip_prefix("audit.json: ").unwrap_or(&text);
        unlift_audit::Error::failed(format!("{}: {}", OneLine(path.display()), OneLine(text)))
    })
}

/// Returns an error if `failed` images could not be `done`; each was reported in a line before.
pub fn all_could_be(done: &str, path: &Path, n: usize, failed: usize) -> crate::Result<()> {
    if failed == 0 {
        return Ok(());
    }
    let expected = format!("{} images that can be {done}", n + failed);
    Err(Error::new(path, "", expected, n.to_string()).into())
}
