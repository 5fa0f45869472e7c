//! What is done with the bytes of a fuzzer: every reader of other people's files, and recovery from records that nobody
//! made. No input may panic, hang or take memory that its size does not explain; what is accepted obeys the
//! rules of its type. `crates/unlift-cli/tests/cli/corpus.rs` replays the corpus through these functions.

mod bytes;
mod files;
mod records;

pub use files::{descriptors, document, features, model_folder, network, photo, points, stages};
pub use records::recovery;

/// What is done with an input.
pub type Target = fn(&[u8]);

/// A target by its name.
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
