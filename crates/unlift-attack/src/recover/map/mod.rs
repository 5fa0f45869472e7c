//! The data that solvers share, made from a released map and its lists.
//!
//! From the bottom up: estimates per slot (`places`), their density on cells (`grid`), records and their sections (`lines`), the chance
//! that a random record passes (`chance`), all of these for one map (`family`); and the neighborhood graph (`graph`).

mod chance;
mod family;
mod graph;
mod grid;
mod lines;
mod places;

pub(crate) use chance::mixed;
pub(crate) use family::{CandidateFamily, Family, LineFamily, Piece, PlaneFamily};
pub(crate) use graph::{CLASSES, Graph, Listers, Side, record_of, side};
pub(crate) use grid::{Density, Grid};
pub(crate) use lines::{
    Columns, LANES, Lanes, LineRow, NO_GROUP, NO_VOTE, Scratch, evidence, ln, rows_of,
};
pub(crate) use places::{
    CHUNK, Candidate, Step, along_curve, distance2, evenly, known, nearest2, rows_mut, solve_slots,
    sorted, trimmed_box, unit,
};
