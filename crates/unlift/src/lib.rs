//! How much of a privacy-preserving ("obfuscated") map comes back?
//!
//! The pipeline, one module per stage, a type per arrow:
//!
//! ```text
//! read ──> obfuscate ──> neighbors ──> recover ──> evaluate ──> report
//! ```
//!
//! Is my scheme safe? Implement [`Scheme`](obfuscate::Scheme), and audit a map under it:
//!
//! ```
//! use std::sync::Arc;
//! use unlift::audit::{Plan, Silent, run};
//! use unlift::geometry::frame::Bounds;
//! use unlift::obfuscate::{Lifted, Scheme};
//! use unlift::released::{Lines, Obfuscation};
//! use unlift::seed::{Key, Stage};
//! use unlift::{Error, PointSet, Unit, synthetic, truth::Original};
//!
//! /// A level line in a random direction through every point.
//! #[derive(Debug)]
//! struct Level;
//!
//! impl Scheme<3> for Level {
//!     fn name(&self) -> &str {
//!         "level"
//!     }
//!
//!     fn lift(&self, points: &[[f64; 3]], _: Option<&Bounds<3>>, key: &Key) -> Result<Lifted<3>, Error> {
//!         let key = key.stage(Stage::Scheme);
//!         let level = |row: usize| key.draws(row as u64).direction::<2>();
//!         let directions: Vec<_> = (0..points.len()).map(level).map(|[x, y]| [x, y, 0.0]).collect();
//!         Ok(Lifted::one_each(Obfuscation::Lines(Lines::through(points, &directions)?)))
//!     }
//! }
//!
//! let room = PointSet::try_new(synthetic::room(1, 1_000).points, Unit::Meter)?;
//! let plan = Plan { schemes: vec![Arc::new(Level)], inlier_ratios: vec![0.5], ..Plan::new(Unit::Meter) };
//! let row = &run(&Original::new(room), None, &plan, &mut Silent)?.rows[0];
//! println!("{}: {:.0} % within {} m", row.scheme, row.recovered_percent[1], plan.thresholds[1].label);
//! assert!(row.recovered_percent[1] > row.blind_percent[1]);
//! # Ok::<(), Error>(())
//! ```
//!
//! A source of neighborhoods is a [`neighbors::Source`]; `unlift-testkit` has the laws of both, and an example of each. Audits of files, with figures and a page, are calls of `unlift-audit`.

pub mod audit;
pub mod evaluate;
// Not part of the interface: for crates that run code of others.
#[doc(hidden)]
pub mod guard;
pub mod neighbors;
pub mod obfuscate;
pub mod seed;
pub mod synthetic;
pub mod truth;

pub use truth::OriginalId;
pub use unlift_attack::{
    About, Descriptors, Error, ErrorKind, Fingerprint, ListsBy, OneLine, PointSet, RecordId,
    RowOrder, Unit, descriptors, geometry, is_obeyed, points, recover, released,
};
#[doc(hidden)]
pub use unlift_attack::{compiled, simd};
