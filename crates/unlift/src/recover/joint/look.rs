//! What the law of neighbors is learned from: places, and a sample of edges.

use crate::Error;
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

/// The slots that are looked at, each with its edges and with random ones.
pub(crate) struct Sample {
    rows: Vec<Sampled>,
}

/// One of them.
pub(crate) struct Sampled {
    pub(super) slot: u32,
    /// The other ends of its edges, and the class of each.
    pub(super) ends: Vec<u32>,
    pub(super) class: Vec<u8>,
    pub(super) random: RandomEdges,
}

impl Sample {
    /// Slots spread evenly over `graph`.
    ///
    /// # Errors
    /// When edges cannot be read.
    pub(crate) fn new(graph: &Graph, seed: u64) -> Result<Self, Error> {
        let row = |slot: usize| {
            let rows = graph.rows(&(slot..slot + 1))?;
            let (ends, class) = rows.of(slot);
            Ok((ends.to_vec(), class.to_vec()))
        };
        Self::of((graph.n_slots(), graph.len()), seed, row, |at| graph.edge(at))
    }

    /// Slots spread evenly over a map with so many slots and edges: of a slot there is a `row` of ends and
    /// classes, and each of all edges, end to end, is an `edge`.
    ///
    /// # Errors
    /// When edges cannot be had.
    pub(crate) fn of(
        (n_slots, n_edges): (usize, usize),
        seed: u64,
        mut row: impl FnMut(usize) -> Result<(Vec<u32>, Vec<u8>), Error>,
        mut edge: impl FnMut(u64) -> Result<(u32, u8), Error>,
    ) -> Result<Self, Error> {
        let every = n_slots.div_ceil(SLOTS).max(1);
        let slots = if n_edges == 0 { 0..0 } else { 0..n_slots };
        let rows = slots.step_by(every).map(|slot| {
            let mut draws = Draws::new(seed, Stage::NullSample, slot as u64);
            let mut random = [(0, 0); RANDOM];
            for one in &mut random {
                *one = edge(draws.below(n_edges as u64))?;
            }
            let (ends, class) = row(slot)?;
            Ok(Sampled { slot: slot as u32, ends, class, random })
        });
        Ok(Self { rows: rows.collect::<Result<_, Error>>()? })
    }

    /// All of them.
    pub(super) fn rows(&self) -> &[Sampled] {
        &self.rows
    }
}
