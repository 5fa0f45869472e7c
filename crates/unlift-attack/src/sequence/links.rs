//! Links between queries: slots that probably hide keypoints of the same point in space.

use std::ops::Range;

use rayon::prelude::*;

use super::Query;
use crate::Error;
use crate::neighbors::{Blocks, mutual};

/// A mutual nearest neighbor is a link if its distance is below this share of the distance of the second nearest. Geometry rejects wrong
/// links later, so that a strict ratio would only lose right ones (docs/decisions/sequence.md).
const RATIO: f32 = 0.95;

/// Links between the slots of all queries of a sequence.
#[derive(Clone, Debug, Default)]
pub struct Links {
    /// Linked (query, slot) of each slot of each query, at most one per other query, sorted.
    of_slot: Vec<Vec<Vec<(u32, u32)>>>,
}

impl Links {
    /// Links mutual nearest neighbors of the descriptors of any two queries that are fewer than `reach` apart and look in similar
    /// directions.
    ///
    /// # Errors
    /// When a query has no descriptors, or two have descriptors of different length.
    pub fn by_descriptors(queries: &[Query], reach: usize) -> Result<Self, Error> {
        let mut described = Vec::with_capacity(queries.len());
        for (at, query) in queries.iter().enumerate() {
            let Some(descriptors) = query.released.descriptors() else {
                return Err(Error::new(format!("query {at}"), "descriptors", "none"));
            };
            described.push(descriptors);
        }
        let dim = described.first().map_or(0, |first| first.dim());
        if let Some(at) = described.iter().position(|descriptors| descriptors.dim() != dim) {
            let expected = format!("{dim} columns, as in query 0");
            let what = format!("descriptors of query {at}");
            return Err(Error::new(what, expected, described[at].dim().to_string()));
        }
        let blocks: Vec<Blocks> = described.par_iter().map(|rows| Blocks::new(rows)).collect();
        let pairs: Vec<(usize, usize)> = (0..queries.len())
            .flat_map(|a| (a + 1..queries.len().min(a + reach)).map(move |b| (a, b)))
            .filter(|&(a, b)| queries[a].camera.looks_like(&queries[b].camera))
            .collect();
        let of_pair = |&(a, b): &(usize, usize)| mutual(&blocks[a], &blocks[b]);
        let found: Vec<_> = pairs.par_iter().with_max_len(1).map(of_pair).collect();
        let mut links = Self::none(queries.iter().map(|query| query.released.n_slots()));
        for (&(a, b), found) in pairs.iter().zip(&found) {
            for &(row, column, _) in found.iter().filter(|pair| pair.2 < RATIO * RATIO) {
                links.link((a as u32, row), (b as u32, column));
            }
        }
        Ok(links)
    }

    /// Links all slots of each track, a list of (query, slot). `n_slots` has the number of slots of each query. Of several slots of a
    /// query in one track, the first counts.
    ///
    /// # Panics
    /// When a track names a query or slot that does not exist.
    pub fn of_tracks(
        n_slots: impl IntoIterator<Item = usize>,
        tracks: impl IntoIterator<Item = Vec<(u32, u32)>>,
    ) -> Self {
        let mut links = Self::none(n_slots);
        for mut track in tracks {
            track.sort_unstable();
            for (at, &a) in track.iter().enumerate() {
                track[at + 1..].iter().filter(|b| b.0 != a.0).for_each(|&b| links.link(a, b));
            }
        }
        links
    }

    /// Returns these links for other releases of the same keypoints. `of_slots` has, per query, the slot of each new slot in the
    /// release of these links.
    ///
    /// # Panics
    /// When a slot is out of range or a slot has no new one.
    #[must_use]
    pub fn reordered(&self, of_slots: &[Vec<u32>]) -> Self {
        let inverse = |of: &Vec<u32>| {
            let mut new = vec![0; of.len()];
            of.iter().enumerate().for_each(|(slot, &old)| new[old as usize] = slot as u32);
            new
        };
        let new: Vec<Vec<u32>> = of_slots.iter().map(inverse).collect();
        let moved = |&(query, slot): &(u32, u32)| (query, new[query as usize][slot as usize]);
        let mut links = Self::none(of_slots.iter().map(Vec::len));
        for (query, of) in of_slots.iter().enumerate() {
            for (links, &old) in links.of_slot[query].iter_mut().zip(of) {
                *links = self.of_slot[query][old as usize].iter().map(moved).collect();
            }
        }
        links
    }

    fn none(n_slots: impl IntoIterator<Item = usize>) -> Self {
        Self { of_slot: n_slots.into_iter().map(|n| vec![Vec::new(); n]).collect() }
    }

    fn link(&mut self, a: (u32, u32), b: (u32, u32)) {
        for (from, to) in [(a, b), (b, a)] {
            let known = &mut self.of_slot[from.0 as usize][from.1 as usize];
            if let Err(at) = known.binary_search_by_key(&to.0, |link| link.0) {
                known.insert(at, to);
            }
        }
    }

    /// Returns the track of `slot` of `query` among the queries in `window`: at most one (query, slot) per other query. A query that is
    /// not linked directly adds the slot to which most linked ones are linked.
    pub fn track(&self, query: usize, slot: usize, window: &Range<usize>) -> Vec<(u32, u32)> {
        let within = |link: &&(u32, u32)| window.contains(&(link.0 as usize));
        let direct = &self.of_slot[query][slot];
        let mut found: Vec<(u32, u32)> = direct.iter().filter(within).copied().collect();
        let is_new = |link: &&(u32, u32)| {
            let is_linked = direct.binary_search_by_key(&link.0, |direct| direct.0).is_ok();
            link.0 as usize != query && !is_linked
        };
        let next = |&(other, at): &(u32, u32)| &self.of_slot[other as usize][at as usize];
        let votes = found.iter().flat_map(|link| next(link).iter().filter(within).filter(is_new));
        let mut votes: Vec<(u32, u32)> = votes.copied().collect();
        votes.sort_unstable();
        for of_query in votes.chunk_by(|a, b| a.0 == b.0) {
            let mut best: &[(u32, u32)] = &[];
            for of_slot in of_query.chunk_by(|a, b| a == b) {
                if of_slot.len() > best.len() {
                    best = of_slot;
                }
            }
            found.extend(best.first());
        }
        found.sort_unstable();
        found
    }
}
