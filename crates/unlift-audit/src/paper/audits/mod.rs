//! Audits of all scenes, with the same calls as audits of other maps and photos.

mod images;
mod maps;
mod run;

pub use run::Run;
