//! Audits of files as a library call: from a map or images on disk to figures and a page.
//!
//! ```text
//! open ──> Plan ──> perform (run, gate, draw) ──> audit.json, report.html
//! ```
//!
//! ```no_run
//! use std::path::Path;
//! use std::time::Instant;
//!
//! use unlift::Unit;
//! use unlift::audit::Plan;
//! use unlift_audit::{Gate, Job, Preparation, maps, open_audit};
//! use unlift_io::atomic::Rules;
//!
//! # fn main() -> Result<(), unlift_audit::Error> {
//! let (started, path) = (Instant::now(), Path::new("reconstruction/0"));
//! let preparation = Preparation { scale: Some(1.0), ..Preparation::default() };
//! let (input, prepared) = maps::open(path, None, &preparation)?;
//! let out = Path::new("audit");
//! let files = open_audit(out, Rules::new([path], false), false)?;
//! let finished = maps::perform(
//!     Job {
//!         plan: Plan::new(Unit::Meter).for_map(prepared.original.len(), 50),
//!         gates: vec![Gate::parse("all@0.5:0.10<=20").expect("a gate")],
//!         ..Job::new(path, &input, &prepared, out, started)?
//!     },
//!     files,
//! )?;
//! assert!(finished.passed());
//! # Ok(())
//! # }
//! ```
//!
//! The schemes, sources and measures of the plan may be your own; see `unlift`.

pub mod again;
mod checked;
mod curves;
mod document;
mod doubts;
mod error;
mod gate;
mod given;
pub mod images;
pub mod inversion;
mod lengths;
pub mod localization;
pub mod maps;
mod memory;
mod outputs;
mod prepare;
mod progress;
mod scene;
pub mod sequence;
pub mod sources;
mod tiles;

pub use checked::Checked;
pub use document::{evaluated, ordered, row};
pub use error::Error;
pub use gate::{Candidate, Figure, Gate};
pub use given::by_point;
pub use lengths::{Extent, SaidOfLengths, check_scale, check_thresholds};
pub use maps::Job;
pub use outputs::{
    Audited, FIGURES, Finished, PAGE, check_file, check_file_of, open_audit, refused,
};
pub use prepare::{Preparation, Prepared, prepare};
pub use progress::{Progress, Quiet};
