//! Audits of files as a library call: from a map or images on disk to figures and a page.
//!
//! ```text
//! input, plan, gates, output ──Audit──> run ──> Audited ──write──> audit.json, report.html
//! ```
//!
//! ```no_run
//! use std::path::Path;
//!
//! use unlift::Unit;
//! use unlift::audit::Plan;
//! use unlift_audit::maps::{self, Map};
//! use unlift_audit::{Audit, Gate, Input, Output, Preparation, Quiet};
//! use unlift_io::outputs::Rules;
//!
//! # fn main() -> Result<(), unlift_audit::Error> {
//! let path = Path::new("reconstruction/0");
//! let preparation = Preparation { scale: Some(1.0), ..Preparation::default() };
//! let prepared = maps::open(path, None, &preparation)?;
//! let plan = Plan::new(Unit::Meter).for_map(prepared.original.len(), 50);
//! let output = Output::new(Path::new("audit"));
//! let files = output.open(Rules::new([path], false))?;
//! let input = Input::Map(Map { plan, ..Map::new(&prepared) });
//! let audit = Audit {
//!     about: prepared.about(path)?,
//!     gates: vec![Gate::parse("all@0.5:0.10<=20").expect("a gate")],
//!     ..Audit::of_map(input, &prepared, output)
//! };
//! let finished = audit.run(&Quiet)?.write(files)?;
//! assert!(finished.passed());
//! # Ok(())
//! # }
//! ```
//!
//! The schemes, sources and measures of the plan may be your own; see `unlift`.

pub mod again;
mod audit;
pub mod changes;
mod curves;
mod document;
mod doubts;
mod gate;
pub mod images;
pub mod inversion;
pub mod localization;
pub mod maps;
mod outputs;
mod prepare;
pub mod released;
mod request;
pub mod sequence;
pub mod sources;
mod tiles;

pub use audit::{Audit, Hidden, Input, Output, Views};
pub use document::peak_bytes;
pub use document::{evaluated, ordered};
pub use doubts::{
    Checked, LengthMessages, check_scale, check_thresholds, read_from_file, unlike_neighbors,
};
pub use gate::{Figure, Gate, Tried, positive, ratio};
pub use outputs::{Audited, FIGURES, Files, Finished, PAGE, check_file, check_file_of, refused};
pub use prepare::{Preparation, Prepared, by_point, prepare};
pub use request::{Planned, Request, check_fit, distinct};
pub use tiles::{Tile, Tiles};

use std::fmt;

/// An error of an audit.
#[derive(Debug)]
pub struct Error {
    fault: Fault,
    advice: Option<String>,
}

#[derive(Debug)]
enum Fault {
    /// The request cannot be carried out.
    Request(String),
    /// A file cannot be read, used or written.
    Input(Box<dyn std::error::Error + Send + Sync>),
}

impl Error {
    /// Creates an error of the request, not of a file.
    pub fn request(message: impl Into<String>) -> Self {
        Self { fault: Fault::Request(message.into()), advice: None }
    }

    /// Creates an error that is not of the request, with a text of its own.
    pub fn failed(message: impl Into<String>) -> Self {
        Self { fault: Fault::Input(message.into().into()), advice: None }
    }

    /// Adds advice: what the user could try instead.
    #[must_use]
    pub fn advise(self, advice: impl Into<String>) -> Self {
        Self { advice: Some(advice.into()), ..self }
    }

    /// Returns true if the request is wrong, not a file.
    pub fn is_request(&self) -> bool {
        matches!(self.fault, Fault::Request(_))
    }

    /// Returns what the user could try instead.
    pub fn advice(&self) -> Option<&str> {
        self.advice.as_deref()
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.fault {
            Fault::Request(message) => f.write_str(message),
            Fault::Input(error) => {
                write!(f, "{error}")?;
                let mut source = error.source();
                while let Some(error) = source {
                    write!(f, ": {error}")?;
                    source = error.source();
                }
                Ok(())
            }
        }
    }
}

impl std::error::Error for Error {}

// Errors of everything that an audit reads and calls become its own.
macro_rules! from {
    ($($error:ty),*) => {$(
        impl From<$error> for Error {
            fn from(error: $error) -> Self {
                Self { fault: Fault::Input(Box::new(error)), advice: None }
            }
        }
    )*};
}

from!(unlift::Error, unlift_io::Error, unlift_report::Error, serde_json::Error);

/// Receives the progress of an audit, from any thread.
pub trait Progress: Send + Sync {
    /// Reports that `done` of `total` items are finished and that `what` comes next.
    fn show(&self, done: usize, total: usize, what: &str) {
        let _ = (done, total, what);
    }

    /// Reports that another share of an item is finished. `what` is the current step, or empty.
    fn add(&self, share: f64, what: &str) {
        let _ = (share, what);
    }

    /// Passes a note to the user.
    fn say(&self, line: &str) {
        let _ = line;
    }

    /// Returns whether the work continues. The audit calls it between cells; on false, it ends with
    /// an error and writes nothing.
    fn goes_on(&self) -> bool {
        true
    }
}

/// Returns an error if the user asked to stop.
fn check_stop(progress: &dyn Progress) -> Result<(), Error> {
    let stopped = "audit: expected to run to the end, found a request to stop";
    if progress.goes_on() { Ok(()) } else { Err(Error::request(stopped)) }
}

/// A progress receiver that ignores everything.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quiet;

impl Progress for Quiet {}
