//! Neighborhoods: per slot, records that are likely to hide points near the slot's point.
//!
//! The oracle makes them for experiments, a [`Source`] from a released map. [`sources::SOURCES`] lists the sources of this crate.

mod bearings;
mod columns;
mod compare;
mod dense;
mod geometric;
mod kept;
mod kind;
mod mutual;
mod neighborhoods;
mod overlap;
mod protected;
mod rows;
mod scored;
mod similarity;
pub mod sources;
mod walk;

#[cfg(test)]
use crate::released::{Lines, Obfuscation, Released};
pub use bearings::{REAL, support};
pub use columns::has_usual_order;
pub use compare::KeptPairs;
pub(crate) use compare::MOST_ROWS;
pub use dense::{dense, usual};
pub(crate) use geometric::geometric_by;
pub use geometric::{Geometric, geometric};
pub use kept::KeptLists;
pub(crate) use kind::comparable;
pub use kind::{DescriptorKind, are_bits};
pub(crate) use mutual::{Blocks, mutual};
pub use neighborhoods::Neighborhoods;
pub use overlap::{Overlap, REACHES};
pub use scored::{Part, Scores, scored};
pub use similarity::Similarity;
#[doc(hidden)]
pub use sources::lacks_descriptors;
pub use sources::{Needs, Source, of_what_there_is};

/// Returns parallel lines with these descriptors, for tests.
#[cfg(test)]
fn described(descriptors: crate::Descriptors, slots_per_record: usize) -> Released<3> {
    let n = descriptors.len() / slots_per_record;
    let lines = Lines::through(&vec![[0.0; 3]; n], &vec![[0.0, 1.0, 0.5]; n]).unwrap();
    let (obfuscation, unit) = (Obfuscation::Lines(lines), crate::Unit::Meter);
    Released::try_new(obfuscation, slots_per_record, [0.0; 3], unit, Some(descriptors)).unwrap()
}
