//! Scheme `ppl+`: paired-point lifting that avoids lines within local surfaces.
//!
//! The published code takes the normal from a row of the wrong matrix, so it depends on the
//! orientation of the map. This implementation follows the paper: the normal is the direction of
//! least spread of the neighbors.

use std::sync::Arc;

use super::pairs::{drop_pairs, pair_again, random_pairs, refused_last};
use super::ppl::{apart, lines_through};
use super::scheme::{Entry, Facts, Lifted, Scheme};
use crate::geometry::frame::Bounds;
use crate::geometry::knn::Knn;
use crate::geometry::normal::local_normal;
use crate::geometry::vector::{dot, sub};
use crate::seed::{Key, Stage};
use crate::truth::DropReason;
use crate::{Error, OriginalId};

/// Paired-point lifting with plane rejection.
#[derive(Clone, Copy, Debug)]
pub struct PplPlus;

/// Registry entry.
pub const ENTRY: Entry = Entry {
    name: "ppl+",
    facts: Facts {
        summary: "as ppl, but no line lies within the local surface of its first point",
        source: "Lee et al., Paired-Point Lifting for Enhanced Privacy-Preserving Visual Localization, CVPR 2023",
        hidden: "two positions along the line and which descriptor is whose",
        patents: "as ppl",
    },
    in_2d: None,
    in_3d: Some(|_| Arc::new(PplPlus)),
};

const MAX_ROUNDS: usize = 1000;
/// Re-pairing ends when fewer pairs than this are refused.
const FEW_PAIRS: usize = 10;
/// Re-pairing stalls after this many rounds, if this many rounds in a row changed nothing.
const STALL: (usize, usize) = (100, 50);
/// sin(20 degrees). A line is refused if its angle to the surface is at most 20 degrees.
const SIN_20_DEGREES: f64 = 0.342_020_143_325_668_7;

impl Scheme<3> for PplPlus {
    fn name(&self) -> &str {
        ENTRY.name
    }

    fn lift(
        &self,
        points: &[[f64; 3]],
        _: Option<&Bounds<3>>,
        key: &Key,
    ) -> Result<Lifted<3>, Error> {
        let normals = normals(points)?;
        let on_surface = |pair: &[OriginalId; 2]| {
            let [a, b] = pair.map(|id| points[id.index()]);
            let along = sub(&b, &a);
            normals[pair[0].index()].is_some_and(|normal| {
                dot(&along, &normal).abs() <= SIN_20_DEGREES * dot(&along, &along).sqrt()
            })
        };
        let mut draws = key.draws(Stage::Scheme, 0);
        let (mut pairs, mut dropped) = random_pairs(points.len(), &mut draws);
        let accept = |pair: &[OriginalId; 2]| apart(points, pair) && !on_surface(pair);
        let mut refused = refused_last(&mut pairs, accept);
        let mut unchanged = 0;
        for round in 1..=MAX_ROUNDS {
            if refused < FEW_PAIRS {
                break;
            }
            let before = refused;
            refused = pair_again(&mut pairs, refused, &mut draws, accept);
            unchanged = if refused == before { unchanged + 1 } else { 0 };
            if round > STALL.0 && unchanged >= STALL.1 {
                break;
            }
        }
        let kept = pairs.len() - refused;
        for pair in pairs.drain(kept..) {
            let coincident = !apart(points, &pair);
            let reason =
                if coincident { DropReason::CoincidentPair } else { DropReason::RejectedPair };
            dropped.extend(drop_pairs(&[pair], reason));
        }
        lines_through(points, &pairs, dropped)
    }
}

/// Returns for each point the normal of the surface through its K = min(1 % of the points, 100)
/// nearest neighbors, with K even and at least 4.
fn normals(points: &[[f64; 3]]) -> Result<Vec<Option<[f64; 3]>>, Error> {
    if points.is_empty() {
        return Ok(Vec::new());
    }
    let k = (points.len() / 100).clamp(4, 100) & !1;
    let knn = Knn::new(points)?;
    Ok(knn.per_row(k, |row, found| {
        local_normal(&points[row], found.iter().map(|&(_, at)| points[at as usize]))
    }))
}
