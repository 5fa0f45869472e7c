//! A map as the solvers read it: what several of them share.
//!
//! From the bottom up: `lanes` and `evidence` (arithmetic), `cells` (a grid), rows of each kind of record and where they
//! pass a feasible line (`line_rows`, `candidate_rows`, `sections`, `plane_windows`), how likely a random record passes
//! near a place (`chance_field`), all of it for one released map (`family`); lists and who lists whom (`edges`, `graph`, `lists`);
//! where slots are believed to be and where they may be (`places`, `pieces`, `crowding`).

pub(crate) mod along_curve;
pub(crate) mod bytes;
pub(crate) mod candidate_rows;
pub(crate) mod cells;
pub(crate) mod chance_field;
pub(crate) mod chunks;
pub(crate) mod crowding;
pub(crate) mod edges;
pub(crate) mod evidence;
pub(crate) mod extent;
pub(crate) mod family;
pub(crate) mod graph;
pub(crate) mod lanes;
pub(crate) mod line_rows;
pub(crate) mod lists;
mod merge;
mod named_by;
pub(crate) mod pieces;
pub(crate) mod places;
pub(crate) mod plane_windows;
pub(crate) mod sections;
pub(crate) mod settings;
