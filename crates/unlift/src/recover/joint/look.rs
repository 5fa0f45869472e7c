//! What the law of neighbors is learned from: places, and a sample of edges.

use crate::Error;
use crate::recover::map::bytes::{Reader, Writer};
use crate::recover::map::crowding::Density;
use crate::recover::map::edges::check_edge;
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
        let n = graph.n_slots();
        let every = n.div_ceil(SLOTS).max(1);
        let slots = if graph.len() == 0 { 0..0 } else { 0..n };
        let rows = slots.step_by(every).map(|slot| {
            let mut draws = Draws::new(seed, Stage::NullSample, slot as u64);
            let mut random = [(0, 0); RANDOM];
            for edge in &mut random {
                *edge = graph.edge(draws.below(graph.len() as u64))?;
            }
            let edges = graph.rows(&(slot..slot + 1))?;
            let (ends, class) = edges.of(slot);
            Ok(Sampled { slot: slot as u32, ends: ends.to_vec(), class: class.to_vec(), random })
        });
        Ok(Self { rows: rows.collect::<Result<_, Error>>()? })
    }

    /// Appends them to `to`.
    pub(super) fn write(&self, to: &mut Writer) {
        to.u64(self.rows.len() as u64);
        for Sampled { slot, ends, class, random } in &self.rows {
            to.u32(*slot);
            to.u32s(ends);
            to.bytes(class);
            for (end, class) in random {
                to.u32(*end);
                to.bytes(&[*class]);
            }
        }
    }

    /// Those that [`write`](Self::write) appended, of a map with so many records and slots per record.
    ///
    /// # Errors
    /// When there are none.
    pub(super) fn read(from: &mut Reader<'_>, map: (usize, usize)) -> Result<Self, Error> {
        let n_slots = map.0 * map.1;
        let n = from.count(SLOTS)?;
        let row = |_| {
            let slot = from.below(n_slots)?;
            let ends = from.u32s(2 * n_slots)?;
            let class = from.bytes(ends.len())?.to_vec();
            let mut random = [(0, 0); RANDOM];
            for edge in &mut random {
                *edge = (from.u32()?, from.array::<1>()?[0]);
            }
            let all = ends.iter().copied().zip(class.iter().copied()).chain(random);
            all.into_iter().try_for_each(|edge| check_edge(edge, map))?;
            Ok(Sampled { slot, ends, class, random })
        };
        Ok(Self { rows: (0..n).map(row).collect::<Result<_, Error>>()? })
    }

    /// All of them.
    pub(super) fn rows(&self) -> &[Sampled] {
        &self.rows
    }
}
