//! The result of an audit as a document (`audit.json`) and as a page.
//!
//! [`document`] contains the structs of `audit.json`. The other modules only show them: this crate
//! measures nothing, and each number on the page is a number of the document.
//!
//! ```
//! use unlift_report::{Document, Error, RenderOptions, render, text_table};
//!
//! # fn main() -> Result<(), Error> {
//! let text = r#"{
//!     "unlift": "0.1.0", "schema": 1, "options": {}, "seed": 0, "break_even": [],
//!     "input": {"path": "room.ply", "n_points": 500, "scale_m_per_unit": 1.0},
//!     "results": [{
//!         "scheme": "olc", "neighbors": "oracle", "oracle_noise": "uniform", "inlier_ratio": 0.5, "k": 50,
//!         "solver": "joint", "delta": 0.02, "unit": "m", "n_points": 500, "n_lost": 0, "lost": {},
//!         "dropped": {}, "recovered_percent": {"0.10": 93.1}, "blind_percent": {"0.10": 8.2},
//!         "axis_accuracy_percent": null, "assignment_accuracy_percent": null,
//!         "median_error": 0.01, "error_percentiles": {"50": 0.01}
//!     }],
//!     "run": {"threads": 2, "peak_memory_bytes": null, "seconds": {"total": 1.0, "rows": []}}
//! }"#;
//! let document = Document::from_json(text)?;
//! assert!(text_table(&document).contains("93.1 %"));
//! let page = render(&document, None, &RenderOptions::default())?;
//! assert!(page.starts_with("<!doctype html>"));
//! # Ok(())
//! # }
//! ```

mod attack;
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

pub use attack::{Attack, ByAttack, Given};
pub use document::{Document, Error, rounded};
pub use export::{junit, text_table};
pub use gates::gate_lines;
pub use page::curves::ErrorCdf;
pub use page::scene::Scene3d;
pub use page::{Opening, RenderOptions, Shares, inversions, pictures, render, scene, shares};
pub use release::leak;
pub use words::align;
