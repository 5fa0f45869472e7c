//! The owner's side: originals in, released records and a secret out. One scheme per file.
//!
//! A scheme only states its rule ([`Scheme::lift`]), here or in a crate of somebody else; what every scheme needs to be free of truth
//! (the origin, the normal form, the order of records, slots and descriptors) happens here, once.

mod hide;
mod kmeans;
mod pairs;
mod scheme;
mod size;

pub mod cp;
pub mod cp2d;
pub mod dcl2d;
pub mod lines2d;
pub mod olc;
pub mod plane;
pub mod ppl;
pub mod ppl_plus;
pub mod ray;
pub mod ray_voxel;

pub use hide::obfuscate;
pub use scheme::{Build, Entry, Facts, Lifted, Scheme, SchemeOptions};

use crate::Error;

/// All schemes, in the order of the paper's tables. A file that is missing here fails
/// `tests/architecture`.
pub const SCHEMES: &[Entry] = &[
    olc::ENTRY,
    ppl::ENTRY,
    ppl_plus::ENTRY,
    ray::ENTRY,
    ray_voxel::ENTRY,
    plane::ENTRY,
    cp::ENTRY,
    lines2d::ENTRY,
    cp2d::ENTRY,
    dcl2d::ENTRY,
];

/// The scheme users call `name`.
///
/// # Errors
/// When there is none; the message lists all.
pub fn scheme(name: &str) -> Result<&'static Entry, Error> {
    SCHEMES.iter().find(|entry| entry.name == name).ok_or_else(|| {
        let names: Vec<&str> = SCHEMES.iter().map(|entry| entry.name).collect();
        Error::new("scheme", format!("one of {}", names.join(", ")), name)
    })
}
