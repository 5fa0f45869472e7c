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

mod audit;
pub mod changes;
mod document;
mod doubts;
mod error;
mod gate;
pub mod images;
pub mod inversion;
pub mod localization;
pub mod maps;
mod request;
pub mod sources;

pub use audit::{
    Again, Audit, Audited, FIGURES, Files, Finished, Hidden, Images, Input, Map, Maps, Output,
    PAGE, Sequence, Tiles, check_file, refused,
};
pub use document::{distinct, evaluated};
pub use doubts::{Remarks, check_scale, check_thresholds};
pub use error::{Error, Progress, Quiet};
pub use gate::{Gate, number, positive, ratio};
pub use maps::released;
pub use maps::{Preparation, Prepared, by_point, prepare};
pub use request::{Request, headline};
