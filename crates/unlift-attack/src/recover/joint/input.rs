//! What the iterations of joint recovery read and never change.

use super::sample::Sample;
use crate::recover::map::graph::Graph;

/// A map with its records as pieces of their family.
pub(super) struct Input<'a, P> {
    pub(super) pieces: P,
    pub(super) graph: &'a Graph,
    /// The distance up to which a record supports a place, in the unit of the map.
    pub(super) delta: f32,
    /// How often each record is listed.
    pub(super) listed: Vec<u32>,
    /// The edges that the distribution of neighbors is learned from.
    pub(super) sample: Sample,
}
