//! What the iterations of joint recovery read and never change.

use crate::recover::map::graph::Graph;
use crate::recover::map::grid::Density;
use crate::recover::map::places::Places;
use crate::seed::{Draws, Stage};

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

// The edges that the distribution of neighbors is learned from.

/// Random edges per slot: together of the order of the edges that are looked at.
pub(super) const RANDOM: usize = 24;
/// Slots looked at: about 100,000 edges of lists of 50.
const SLOTS: usize = 1 << 11;

/// What the distribution is learned from.
pub(super) struct Learning<'a, const D: usize> {
    pub(super) places: &'a Places<D>,
    pub(super) density: &'a Density<D>,
    pub(super) slots_per_record: usize,
    /// True neighbors are looked for within this many local widths.
    pub(super) reach: f32,
    /// Whether entries that are near without being neighbors are told from neighbors.
    pub(super) tells_region: bool,
    /// The radius at least and at most.
    pub(super) least_radius: f32,
    pub(super) most_radius: f32,
    pub(super) graph: &'a Graph,
    pub(super) sample: &'a Sample,
}

/// Slots that are looked at, spread evenly over a graph.
pub(super) struct Sample {
    pub(super) rows: Vec<Sampled>,
}

/// A slot that is looked at.
pub(super) struct Sampled {
    pub(super) slot: u32,
    /// Random edges of the whole graph: the other end, and the class of each.
    pub(super) random: [(u32, u8); RANDOM],
}

impl Sample {
    /// Slots spread evenly over `graph`.
    pub(super) fn new(graph: &Graph, seed: u64) -> Self {
        let n = graph.n_slots();
        let every = n.div_ceil(SLOTS).max(1);
        let slots = if graph.len() == 0 { 0..0 } else { 0..n };
        let row = |slot: usize| {
            let mut draws = Draws::new(seed, Stage::NullSample, slot as u64);
            let random = std::array::from_fn(|_| graph.edge(draws.below(graph.len() as u64)));
            Sampled { slot: slot as u32, random }
        };
        Self { rows: slots.step_by(every).map(row).collect() }
    }
}
