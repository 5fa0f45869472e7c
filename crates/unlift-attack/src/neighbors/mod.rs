//! Neighborhoods: per slot, records that are likely to hide points near the slot's point.
//!
//! The oracle makes them from the originals, for experiments. A [`Source`] makes them from a released map, as an attacker can.
//! [`sources::SOURCES`] lists the sources of this crate.

mod alike;
mod bearings;
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
mod source;
pub mod sources;
mod walk;

pub use bearings::{REAL, support};
pub use compare::KeptPairs;
pub(crate) use compare::MOST_ROWS;
pub use dense::{Dense, dense, usual};
pub(crate) use geometric::geometric_by;
pub use geometric::{Geometric, geometric};
pub use kept::KeptLists;
pub(crate) use kind::comparable;
pub use kind::{DescriptorKind, are_bits};
pub(crate) use mutual::{Blocks, mutual};
pub use neighborhoods::Neighborhoods;
pub use overlap::{Overlap, REACHES, overlap};
pub use scored::{Part, Scores, scored};
pub use similarity::{Similarity, similarity};
#[doc(hidden)]
pub use source::lacks_descriptors;
pub use source::{Needs, Source, of_what_there_is};
