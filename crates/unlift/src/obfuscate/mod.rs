//! Obfuscation: computes released records and a secret from originals. Schemes that share a rule share a file.
//!
//! A scheme, built-in or custom, implements only its rule ([`Scheme::lift`]). This module does the
//! rest for all: origin, normal form, order of records, slots and descriptors.

mod changed;
mod hide;
mod mitigate;
mod protect;
mod scheme;

pub mod cp;
pub mod olc;
pub mod plane;
pub mod ppl;
pub mod ray;

pub use changed::{Change, Changed};
pub use hide::obfuscate;
pub use mitigate::Mitigation;
pub use protect::Protection;
pub use scheme::{Entry, Lift, LiftIn, Lifted, LocalPoints, Scheme, SchemeOptions};

use crate::Error;

/// All built-in schemes, in the order of the paper's tables.
pub const SCHEMES: &[Entry] = &[
    olc::ENTRY,
    ppl::ENTRY,
    ppl::PLUS,
    ray::ENTRY,
    ray::VOXEL,
    plane::ENTRY,
    cp::ENTRY,
    olc::LINES2D,
    cp::CP2D,
    ray::DCL2D,
];

/// Built-in schemes that are audited only on request: their records meet in one point, so crossings give no position.
pub const ON_REQUEST: &[Entry] = &[ray::SPHERE];

/// Returns all built-in schemes.
pub fn all() -> impl Iterator<Item = &'static Entry> {
    SCHEMES.iter().chain(ON_REQUEST)
}

/// Returns the built-in scheme called `name`.
///
/// # Errors
/// When there is no such scheme; the message lists all.
pub fn scheme(name: &str) -> Result<&'static Entry, Error> {
    all().find(|entry| entry.name == name).ok_or_else(|| {
        let names: Vec<&str> = all().map(|entry| entry.name).collect();
        Error::new("scheme", format!("one of {}", names.join(", ")), name)
    })
}
