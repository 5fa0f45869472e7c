//! The result of an audit as a document (`audit.json`) and as a page.
//!
//! [`document`] contains the structs of `audit.json`. The other modules only show them: this crate
//! measures nothing, and each number on the page is a number of the document.
//!
//! ```no_run
//! use unlift_report::{Document, RenderOptions, render, text_table};
//!
//! let document = Document::from_json(&std::fs::read_to_string("unlift-audit/audit.json")?)?;
//! print!("{}", text_table(&document));
//! std::fs::write("report.html", render(&document, &RenderOptions::default())?)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod attack;
pub mod compare;
pub mod document;
pub mod export;
mod gates;
mod page;
mod release;
mod results;
mod table;
mod templates;
mod words;

pub use attack::{ByAttack, same_lists};
pub use document::{Document, Error, rounded};
pub use export::text_table;
pub use gates::{gate_lines, junit};
pub use page::scene::Scene3d;
pub use page::{Opening, RenderOptions, Shares, inversions, pictures, render, scene, shares};
pub use release::leak;
pub use results::headline;
pub use words::align;
