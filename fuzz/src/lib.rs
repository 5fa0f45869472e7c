//! Fuzz targets: readers of untrusted files, and recovery from arbitrary records. No input may
//! panic, hang or take memory out of proportion to its size; accepted values obey the rules of
//! their type. `crates/unlift-cli/tests/cli/corpus.rs` replays the corpus with these functions.

mod bytes;
mod files;
mod records;

pub use files::{descriptors, document, features, model_folder, network, photo, points, stages};
pub use records::recovery;

/// Function that processes an input.
pub type Target = fn(&[u8]);

/// Targets by name.
pub const TARGETS: &[(&str, Target)] = &[
    ("points", points),
    ("model_folder", model_folder),
    ("descriptors", descriptors),
    ("features", features),
    ("stages", stages),
    ("photo", photo),
    ("document", document),
    ("network", network),
    ("recovery", recovery),
];
