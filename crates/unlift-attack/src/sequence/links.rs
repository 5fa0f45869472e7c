//! Links between queries: slots that probably hide keypoints of the same point in space.

use std::ops::Range;

use rayon::prelude::*;

use super::Query;
use crate::neighbors::{Cosine, Likeness};
use crate::simd::BLOCK;
use crate::{Descriptors, Error};

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
        let cosine = Cosine { counts: false };
        let blocks: Vec<Vec<_>> =
            described.par_iter().map(|descriptors| blocks(&cosine, descriptors)).collect();
        let pairs: Vec<(usize, usize)> = (0..queries.len())
            .flat_map(|a| (a + 1..queries.len().min(a + reach)).map(move |b| (a, b)))
            .filter(|&(a, b)| queries[a].camera.looks_like(&queries[b].camera))
            .collect();
        let scratch = || vec![0.0f32; BLOCK * BLOCK];
        let found: Vec<Vec<(u32, u32)>> = pairs
            .par_iter()
            .with_max_len(1)
            .map_init(scratch, |scores, &(a, b)| {
                let mut nearest = [described[a], described[b]].map(|of| vec![NONE; of.len()]);
                let [rows, columns] = &mut nearest;
                compare(&cosine, (&blocks[a], rows), (&blocks[b], columns), scores);
                mutual(rows, columns)
            })
            .collect();
        let mut links = Self::none(queries.iter().map(|query| query.released.n_slots()));
        for (&(a, b), found) in pairs.iter().zip(&found) {
            found.iter().for_each(|&(row, column)| links.link((a as u32, row), (b as u32, column)));
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

/// The nearest descriptor and its score, and the score of the second nearest.
type Nearest = (u32, f32, f32);
const NONE: Nearest = (u32::MAX, f32::NEG_INFINITY, f32::NEG_INFINITY);

fn blocks(cosine: &Cosine, descriptors: &Descriptors) -> Vec<<Cosine as Likeness>::Block> {
    let slots: Vec<u32> = (0..descriptors.len() as u32).collect();
    slots.chunks(BLOCK).map(|slots| cosine.block(descriptors, slots)).collect()
}

type Side<'a> = (&'a [<Cosine as Likeness>::Block], &'a mut [Nearest]);

/// Finds the nearest column of every row and the nearest row of every column.
fn compare(cosine: &Cosine, (a, rows): Side<'_>, (b, columns): Side<'_>, scores: &mut [f32]) {
    for (i, (own, rows)) in a.iter().zip(rows.chunks_mut(BLOCK)).enumerate() {
        for (j, (other, columns)) in b.iter().zip(columns.chunks_mut(BLOCK)).enumerate() {
            cosine.scores(own, other, scores);
            for (r, (row, scores)) in rows.iter_mut().zip(scores.chunks_exact(BLOCK)).enumerate() {
                for (c, (column, &score)) in columns.iter_mut().zip(scores).enumerate() {
                    keep(row, (j * BLOCK + c) as u32, score);
                    keep(column, (i * BLOCK + r) as u32, score);
                }
            }
        }
    }
}

#[inline(always)]
fn keep(nearest: &mut Nearest, at: u32, score: f32) {
    if score > nearest.1 {
        *nearest = (at, score, nearest.1);
    } else if score > nearest.2 {
        nearest.2 = score;
    }
}

fn mutual(rows: &[Nearest], columns: &[Nearest]) -> Vec<(u32, u32)> {
    // The squared distance of unit vectors is 2 - 2 cos.
    let stands_out = |(_, first, second): &Nearest| {
        1.0 - first.min(1.0) < RATIO * RATIO * (1.0 - second.max(-1.0))
    };
    let of_row = |(row, nearest): (usize, &Nearest)| {
        let column = columns.get(nearest.0 as usize)?;
        let both = column.0 as usize == row && stands_out(nearest) && stands_out(column);
        both.then_some((row as u32, nearest.0))
    };
    rows.iter().enumerate().filter_map(of_row).collect()
}
