//! Pictures of recovered points beside the photos, in an audit.

mod images;
mod maps;
mod sheet;

pub use images::Inversion;
pub use maps::{MapInversion, view};
