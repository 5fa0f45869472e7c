//! What every step of joint recovery reads and none changes.

use crate::neighbors::Neighborhoods;
use crate::recover::map::{Family, Graph, evenly};
use crate::seed::{Draws, Stage};

/// Number of random edges per sampled slot. Together they get the weight of all edges of the slot.
pub(super) const RANDOM: usize = 24;

/// A map as its family of records sees it, its lists, and the sample from which distributions are learned.
pub(super) struct Problem<'a, const D: usize, F: Family<D>> {
    pub(super) family: &'a F,
    pub(super) lists: &'a Neighborhoods,
    pub(super) graph: &'a Graph,
    pub(super) delta: f32,
    pub(super) at_delta: F::AtDelta,
    pub(super) seed: u64,
    pub(super) listed: Vec<u32>,
    /// Evenly spaced slots from which the distribution of true neighbors is learned.
    pub(super) sample: Vec<Sampled>,
}

/// A sampled slot, and edges drawn at random from the whole graph: the end and the class of each.
pub(super) struct Sampled {
    pub(super) slot: usize,
    pub(super) random: [(usize, u8); RANDOM],
}

impl<'a, const D: usize, F: Family<D>> Problem<'a, D, F> {
    pub(super) fn new(
        family: &'a F,
        (lists, graph): (&'a Neighborhoods, &'a Graph),
        delta: f32,
        seed: u64,
    ) -> Self {
        let n = if graph.len() == 0 { 0 } else { graph.n_slots() };
        let row = |slot: usize| {
            let mut draws = Draws::new(seed, Stage::NullSample, slot as u64);
            let random = std::array::from_fn(|_| graph.edge(draws.below(graph.len() as u64)));
            Sampled { slot, random }
        };
        // With lists of 50, the sampled slots have about 100,000 edges.
        let sample = evenly(n, 1 << 11).map(row).collect();
        let (at_delta, listed) = (family.at_delta(delta), graph.times_listed());
        Self { family, lists, graph, delta, at_delta, seed, listed, sample }
    }
}
