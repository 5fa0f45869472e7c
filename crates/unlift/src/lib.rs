//! Measures how much of a privacy-preserving ("obfuscated") map an attacker can recover.
//!
//! Each stage of the pipeline is a module, each arrow a type:
//!
//! ```text
//! read ──> obfuscate ──> neighbors ──> recover ──> evaluate ──> report
//! ```
//!
//! An audit of a synthetic room:
//!
//! ```
//! use unlift::audit::{Plan, Silent, run};
//! use unlift::{Error, PointSet, Unit, synthetic, truth::Original};
//!
//! let room = PointSet::try_new(synthetic::room(1, 1_000).points, Unit::Meter)?;
//! let mut plan = Plan { inlier_ratios: vec![0.5], ..Plan::new(Unit::Meter) };
//! plan.schemes.truncate(1);
//! let row = &run(&Original::new(room), None, &plan, &mut Silent)?.rows[0];
//! println!("{}: {:.0} % within {} m", row.scheme, row.recovered_percent[1], plan.thresholds[1].label);
//! assert!(row.recovered_percent[1] > row.blind_percent[1]);
//! # Ok::<(), Error>(())
//! ```
//!
//! To test your own scheme, implement [`Scheme`](obfuscate::Scheme) and put it into the plan. Custom
//! sources of neighborhoods implement [`neighbors::Source`]. The crate `unlift-testkit` has property
//! tests for both, and an example of each. The crate `unlift-audit` audits files and writes reports.

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
