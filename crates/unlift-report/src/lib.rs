//! What an audit found, as a document and as a page.
//!
//! [`document`] holds the structs of `audit.json`; everything else here only shows them:
//! nothing is measured in this crate, and a number on the page is a number of the document.

mod attack;
mod cards;
mod check;
mod choices;
pub mod document;
mod error;
mod gates;
mod html;
mod images;
mod lead;
mod options;
mod page_data;
pub mod paper;
pub mod pictures;
mod quantity;
mod round;
pub mod scene;
mod share;
mod slot;
mod tables;
mod text;
mod verdict;
mod words;

pub use attack::Given;
pub use document::Document;
pub use error::Error;
pub use html::render;
pub use options::{ErrorCdf, RenderOptions};
pub use round::rounded;
pub use scene::Scene3d;
pub use text::text_table;
