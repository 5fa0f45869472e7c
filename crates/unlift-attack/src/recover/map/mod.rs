//! A map as the solvers read it: what several of them share.
//!
//! From the bottom up: a grid of cells and the density of estimates on it (`grid`); rows of each kind of record and where they pass a
//! feasible line (`lines`, `planes`); how likely a random record passes near a place (`chance`); all of it for one released map
//! (`family`); lists, and who lists whom (`lists`, `graph`); where slots are believed to be and where they may be (`places`, `pieces`).

pub(crate) mod bytes;
pub(crate) mod chance;
pub(crate) mod family;
pub(crate) mod graph;
pub(crate) mod grid;
pub(crate) mod lines;
pub(crate) mod lists;
pub(crate) mod pieces;
pub(crate) mod places;
pub(crate) mod planes;
