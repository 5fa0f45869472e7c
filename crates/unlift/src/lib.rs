//! Measures how much of a privacy-preserving ("obfuscated") map an attacker can recover.
//!
//! Each stage of the pipeline is a module, each arrow a type:
//!
//! ```text
//! read ──> obfuscate ──> neighbors ──> recover ──> evaluate ──> report
//! ```
//!
//! To test your own scheme, implement [`Scheme`](obfuscate::Scheme) and audit a map with it:
//!
//! ```
//! use std::sync::Arc;
//! use unlift::audit::{Plan, Silent, run};
//! use unlift::obfuscate::{Lifted, LocalPoints, Scheme};
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
//!     fn lift(&self, points: &LocalPoints<'_, 3>, key: &Key) -> Result<Lifted<3>, Error> {
//!         let (points, key) = (points.positions, key.stage(Stage::Scheme));
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
//! Custom sources of neighborhoods implement [`neighbors::Source`]. The crate `unlift-testkit` has
//! property tests for both, and an example of each. The crate `unlift-audit` audits files and
//! writes reports.

pub mod audit;
pub mod evaluate;
// Not public: for crates that run third-party code.
#[doc(hidden)]
pub mod guard;
pub mod localization;
pub mod neighbors;
pub mod obfuscate;
pub mod seed;
pub mod synthetic;
pub mod truth;

pub use truth::OriginalId;
pub use unlift_attack::{
    About, Descriptors, Error, ErrorKind, Fingerprint, OneLine, PointSet, ProtectedDescriptors,
    RecordId, RowOrder, Unit, again, descriptors, geometry, is_obeyed, points, protected, recover,
    released, sequence,
};
#[doc(hidden)]
pub use unlift_attack::{compiled, simd};
