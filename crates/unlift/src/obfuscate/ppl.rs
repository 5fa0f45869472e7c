//! Scheme `ppl`: a line through each pair of a random pairing.

use std::sync::Arc;

use super::pairs::{drop_pairs, pair_again, random_pairs, refused_last};
use super::scheme::{Entry, Facts, Lifted, Scheme};
use crate::geometry::frame::Bounds;
use crate::geometry::vector::{squared_distance, sub};
use crate::released::{Lines, Obfuscation};
use crate::seed::{Cipher, Draws, Key, Stage};
use crate::truth::{DropReason, Dropped};
use crate::{Error, OriginalId};

/// Paired-point lifting.
#[derive(Clone, Copy, Debug)]
pub struct Ppl;

/// Registry entry.
pub const ENTRY: Entry = Entry {
    name: "ppl",
    facts: Facts {
        summary: "one line through two random points",
        source: "Lee et al., Paired-Point Lifting for Enhanced Privacy-Preserving Visual Localization, CVPR 2023",
        hidden: "two positions along the line and which descriptor is whose",
        patents: "application declared by its authors; line clouds as for olc",
    },
    in_2d: None,
    in_3d: Some(|_| Arc::new(Ppl)),
};

/// Maximum number of re-pairings of coincident points before they are dropped.
const RE_DRAWS: usize = 100;

impl Scheme<3> for Ppl {
    fn name(&self) -> &str {
        ENTRY.name
    }

    fn lift(
        &self,
        points: &[[f64; 3]],
        _: Option<&Bounds<3>>,
        key: &Key,
    ) -> Result<Lifted<3>, Error> {
        let mut draws = key.draws(Stage::Scheme, 0);
        let (mut pairs, mut dropped) = random_pairs(points.len(), &mut draws);
        let coincident = separate(points, &mut pairs, &mut draws);
        dropped.extend(coincident);
        lines_through(points, &pairs, dropped)
    }
}

/// Returns true if two points are far enough apart to define a line in `f64`.
pub(super) fn apart(points: &[[f64; 3]], pair: &[OriginalId; 2]) -> bool {
    let [a, b] = pair.map(|id| points[id.index()]);
    let size2 = a.iter().chain(&b).map(|x| x * x).fold(0.0, f64::max);
    squared_distance(&a, &b) > size2 * 1e-24
}

/// Pairs coincident points again. Removes and returns those that stay coincident.
fn separate(
    points: &[[f64; 3]],
    pairs: &mut Vec<[OriginalId; 2]>,
    draws: &mut Draws<Cipher>,
) -> Vec<Dropped> {
    let mut refused = refused_last(pairs, |pair| apart(points, pair));
    for _ in 0..RE_DRAWS {
        if refused == 0 {
            break;
        }
        // Coincident points need other partners, so as many accepted pairs join the pool.
        let pool = (2 * refused).min(pairs.len());
        refused = pair_again(pairs, pool, draws, |pair| apart(points, pair));
    }
    let kept = pairs.len() - refused;
    let dropped = drop_pairs(&pairs[kept..], DropReason::CoincidentPair);
    pairs.truncate(kept);
    dropped
}

pub(super) fn lines_through(
    points: &[[f64; 3]],
    pairs: &[[OriginalId; 2]],
    dropped: Vec<Dropped>,
) -> Result<Lifted<3>, Error> {
    let through: Vec<[f64; 3]> = pairs.iter().map(|[a, _]| points[a.index()]).collect();
    let direction: Vec<[f64; 3]> =
        pairs.iter().map(|[a, b]| sub(&points[b.index()], &points[a.index()])).collect();
    Ok(Lifted {
        obfuscation: Obfuscation::Lines(Lines::through(&through, &direction)?),
        slots_per_record: 2,
        hidden: pairs.as_flattened().to_vec(),
        swapped_axis: None,
        dropped,
    })
}
