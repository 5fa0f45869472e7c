//! The audits of one scene after the other, by the calls that audit any map and any photos.

mod images;
mod maps;
mod run;

pub use run::Run;
