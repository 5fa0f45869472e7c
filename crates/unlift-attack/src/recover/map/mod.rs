//! The data that solvers share, made from a released map and its lists.
//!
//! From the bottom up: a grid of cells and the density of estimates on it (`grid`); rows per record and their sections with a
//! feasible line (`lines`, `planes`); the chance that a random record passes near a place (`chance`); all of these for one map
//! (`family`, `families`); the neighborhood graph (`graph`); estimates per slot (`places`).

pub(crate) mod chance;
pub(crate) mod families;
pub(crate) mod family;
pub(crate) mod graph;
pub(crate) mod grid;
pub(crate) mod lines;
pub(crate) mod places;
pub(crate) mod planes;
