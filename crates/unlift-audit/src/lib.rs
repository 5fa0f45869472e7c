//! Audits of files as a library call: from a map or images on disk to figures and a page.
//!
//! ```text
//! Input (what is attacked, plan), Audit (gates, output) ──run──> Audited ──write──> audit.json, report.html
//! ```
//!
//! ```no_run
//! use std::path::Path;
//!
//! use unlift::Unit;
//! use unlift::audit::Plan;
//! use unlift_audit::{Audit, Gate, Input, Map, Output, Preparation, Quiet, maps};
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
//!     ..Audit::new(output).of_map(&prepared)
//! };
//! let finished = audit.run(&input, &Quiet)?.write(files)?;
//! assert!(finished.passed());
//! # Ok(())
//! # }
//! ```
//!
//! The schemes, sources and measures of the plan may be your own; see `unlift`.

mod attack;
mod audit;
pub mod changes;
mod document;
mod doubts;
mod gate;
pub mod images;
pub mod inversion;
pub mod localization;
pub mod maps;
mod request;
pub mod sources;

pub use attack::{Again, Hidden, Images, Input, Map, Maps, Sequence, Tiles};
pub use audit::{Audit, Audited, FIGURES, Files, Finished, Output, PAGE, check_file, refused};
pub use document::evaluated;
pub use doubts::{check_scale, check_thresholds};
pub use gate::{Gate, number, positive, ratio};
pub use maps::released;
pub use maps::{Preparation, Prepared, by_point, prepare};
pub use request::{Request, distinct, headline};

use std::fmt;

/// Ends a function with an error of the request, whose text has the form of `format!`.
#[macro_export]
macro_rules! bail {
    ($($text:tt)*) => { return Err($crate::Error::request(format!($($text)*))) };
}

/// An error of an audit.
#[derive(Debug)]
pub struct Error {
    message: String,
    /// True if the request is wrong, not a file.
    pub is_request: bool,
    /// What the user could try instead.
    pub advice: Option<String>,
}

impl Error {
    /// Creates an error of the request, not of a file.
    pub fn request(message: impl Into<String>) -> Self {
        Self { message: message.into(), is_request: true, advice: None }
    }

    /// Creates an error that is not of the request, with a text of its own.
    pub fn failed(message: impl Into<String>) -> Self {
        Self { message: message.into(), is_request: false, advice: None }
    }

    /// Adds advice: what the user could try instead.
    #[must_use]
    pub fn advise(self, advice: impl Into<String>) -> Self {
        Self { advice: Some(advice.into()), ..self }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}

// Errors of everything that an audit reads and calls become its own.
macro_rules! from {
    ($($error:ty),*) => {$(
        impl From<$error> for Error {
            fn from(error: $error) -> Self {
                use std::error::Error as _;
                let sources = std::iter::successors(error.source(), |&source| source.source());
                let texts = sources.map(|source| format!(": {source}"));
                Self::failed(error.to_string() + &texts.collect::<String>())
            }
        }
    )*};
}

from!(unlift::Error, unlift_io::Error, unlift_report::Error, serde_json::Error);

/// Receives the progress of an audit, from any thread.
pub trait Progress: Send + Sync {
    /// Reports that `done` of `total` items are finished and that `what` comes next.
    fn show(&self, _done: usize, _total: usize, _what: &str) {}

    /// Reports that another share of an item is finished. `what` is the current step, or empty.
    fn add(&self, _share: f64, _what: &str) {}

    /// Passes a note to the user.
    fn say(&self, _line: &str) {}

    /// Returns whether the work continues. The audit calls it between cells; on false, it ends with an error and writes nothing.
    fn goes_on(&self) -> bool {
        true
    }
}

/// Returns an error if the user asked to stop.
fn check_stop(progress: &dyn Progress) -> Result<(), Error> {
    if !progress.goes_on() {
        bail!("audit: expected to run to the end, found a request to stop");
    }
    Ok(())
}

/// A progress receiver that ignores everything.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quiet;

impl Progress for Quiet {}
