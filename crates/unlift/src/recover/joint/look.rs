//! What the law of neighbors is learned from: places, edges, and a sample of both.

use crate::recover::map::crowding::Density;
use crate::recover::map::graph::Graph;
use crate::recover::map::places::Places;
use crate::seed::{Draws, Stage};

/// Random edges per slot: together of the order of the edges that are looked at.
pub(super) const RANDOM: usize = 24;
/// Random edges of one slot: other ends, and the class of each.
pub(super) type RandomEdges = [(u32, u8); RANDOM];
/// Slots looked at: about 100,000 edges of lists of 50.
const SLOTS: usize = 1 << 11;

/// What the law is learned from.
pub(crate) struct Look<'a, const D: usize> {
    pub(crate) places: &'a Places<D>,
    pub(crate) graph: &'a Graph,
    pub(crate) density: &'a Density<D>,
    pub(crate) slots_per_record: usize,
    /// True neighbors are looked for within this many local widths.
    pub(crate) reach: f32,
    /// Whether entries that are near without being neighbors are told from neighbors.
    pub(crate) tells_region: bool,
    /// The radius of the law at least and at most.
    pub(crate) least_radius: f32,
    pub(crate) most_radius: f32,
    pub(crate) sample: &'a Sample,
}

/// The slots that are looked at, with random edges for each.
pub(crate) struct Sample {
    slots: Vec<u32>,
    random: Vec<RandomEdges>,
}

impl Sample {
    /// Slots spread evenly over `graph`.
    pub(crate) fn new(graph: &Graph, seed: u64) -> Self {
        if graph.len() == 0 {
            return Self { slots: Vec::new(), random: Vec::new() };
        }
        let every = graph.n_slots().div_ceil(SLOTS).max(1);
        let slots: Vec<u32> = (0..graph.n_slots() as u32).step_by(every).collect();
        let random = |&slot: &u32| {
            let mut draws = Draws::new(seed, Stage::NullSample, u64::from(slot));
            std::array::from_fn(|_| graph.edge(draws.below(graph.len() as u64) as usize))
        };
        let random = slots.iter().map(random).collect();
        Self { slots, random }
    }

    /// Slots, and random edges of each.
    pub(super) fn columns(&self) -> (&[u32], &[RandomEdges]) {
        (&self.slots, &self.random)
    }

    /// Slots, each with its random edges.
    pub(super) fn rows(&self) -> impl Iterator<Item = (&u32, &RandomEdges)> {
        self.slots.iter().zip(&self.random)
    }
}
