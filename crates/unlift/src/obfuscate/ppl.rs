//! Schemes of lines through pairs of points: `ppl`, a random pairing, and `ppl+`, which avoids lines within local surfaces.
//!
//! The published code of `ppl+` takes the normal from a row of the wrong matrix, so it depends on the orientation of the map. This
//! implementation follows the paper: the normal is the direction of least spread of the neighbors.

use super::scheme::{Entry, Lift, Lifted};
use crate::geometry::knn::Knn;
use crate::geometry::normal::local_normal;
use crate::geometry::vector::{dot, squared_distance, sub};
use crate::released::{Lines, Obfuscation};
use crate::seed::{Cipher, Draws, Key, Stage};
use crate::truth::{DropReason, Dropped};
use crate::{Error, OriginalId};

/// Registry entry.
pub const ENTRY: Entry = Entry {
    title: "Paired-point lines",
    rule: "Two random points share the line through both.",
    color: 1,
    source: "Lee et al., Paired-Point Lifting for Enhanced Privacy-Preserving Visual Localization, CVPR 2023",
    hidden: "two positions along the line and which descriptor is whose",
    patents: "application declared by its authors; line clouds as for olc",
    ..Entry::new("ppl", Lift::In3d(|points, key, _| lift(points.positions, key)))
};

/// Paired-point lifting. Coincident points need other partners, so as many accepted pairs are paired again with them.
fn lift(points: &[[f64; 3]], key: &Key) -> Result<Lifted<3>, Error> {
    lines_through_pairs(points, key, Again { rounds: 100, few: 1, pool: 2 }, |_| true)
}

/// When and how refused pairs are paired again.
struct Again {
    /// Maximum number of rounds.
    rounds: usize,
    /// It ends when fewer pairs than this are refused.
    few: usize,
    /// Number of pairs that are paired again, for each refused one.
    pool: usize,
}

/// It stalls after this many rounds, if this many rounds in a row changed nothing.
const STALL: (usize, usize) = (100, 50);

/// Returns true if two points are far enough apart to define a line in `f64`.
fn apart(points: &[[f64; 3]], pair: &[OriginalId; 2]) -> bool {
    let [a, b] = pair.map(|id| points[id.index()]);
    let size2 = a.iter().chain(&b).map(|x| x * x).fold(0.0, f64::max);
    squared_distance(&a, &b) > size2 * 1e-24
}

/// Returns the lines through random pairs of points that are apart and that `accept` accepts. Points of pairs
/// that are refused in the end are dropped.
fn lines_through_pairs(
    points: &[[f64; 3]],
    key: &Key,
    again: Again,
    accept: impl Fn(&[OriginalId; 2]) -> bool,
) -> Result<Lifted<3>, Error> {
    let mut draws = key.draws(Stage::Scheme, 0);
    let (mut pairs, mut dropped) = random_pairs(points.len(), &mut draws);
    let accept = |pair: &[OriginalId; 2]| apart(points, pair) && accept(pair);
    let mut refused = refused_last(&mut pairs, accept);
    let mut unchanged = 0;
    for round in 1..=again.rounds {
        if refused < again.few {
            break;
        }
        let (before, start) = (refused, pairs.len().saturating_sub(again.pool * refused));
        draws.shuffle(pairs[start..].as_flattened_mut());
        refused = refused_last(&mut pairs[start..], accept);
        unchanged = if refused == before { unchanged + 1 } else { 0 };
        if round > STALL.0 && unchanged >= STALL.1 {
            break;
        }
    }
    for pair in pairs.split_off(pairs.len() - refused) {
        let reason = match apart(points, &pair) {
            true => DropReason::RejectedPair,
            false => DropReason::CoincidentPair,
        };
        dropped.extend(pair.map(|original| Dropped { original, reason }));
    }
    let ends = pairs.iter().map(|pair| pair.map(|id| points[id.index()]));
    let (through, direction): (Vec<_>, Vec<_>) = ends.map(|[a, b]| (a, sub(&b, &a))).unzip();
    let lines = Obfuscation::Lines(Lines::through(&through, &direction)?);
    let hidden = pairs.as_flattened().to_vec();
    Ok(Lifted { slots_per_record: 2, hidden, dropped, ..Lifted::one_each(lines) })
}

/// Registry entry of `ppl+`.
pub const PLUS: Entry = Entry {
    name: "ppl+",
    title: "Paired-point lines, plane-aware",
    rule: "Two points share a line that leaves the surface around them.",
    color: 2,
    patents: "as ppl",
    lift: Lift::In3d(|points, key, _| lift_off_surfaces(points.positions, key)),
    ..ENTRY
};

/// sin(20 degrees). A line is refused if its angle to the surface is at most 20 degrees.
const SIN_20_DEGREES: f64 = 0.342_020_143_325_668_7;

/// Paired-point lifting with plane rejection.
fn lift_off_surfaces(points: &[[f64; 3]], key: &Key) -> Result<Lifted<3>, Error> {
    let normals = normals(points)?;
    let on_surface = |pair: &[OriginalId; 2]| {
        let [a, b] = pair.map(|id| points[id.index()]);
        let along = sub(&b, &a);
        let limit = SIN_20_DEGREES * dot(&along, &along).sqrt();
        normals[pair[0].index()].is_some_and(|normal| dot(&along, &normal).abs() <= limit)
    };
    let again = Again { rounds: 1000, few: 10, pool: 1 };
    lines_through_pairs(points, key, again, |pair| !on_surface(pair))
}

/// Returns the normal of the surface through the nearest 1 % of points (4 to 100, even) of each.
fn normals(points: &[[f64; 3]]) -> Result<Vec<Option<[f64; 3]>>, Error> {
    if points.is_empty() {
        return Ok(Vec::new());
    }
    let k = (points.len() / 100).clamp(4, 100) & !1;
    let knn = Knn::new(points)?;
    Ok(knn.per_row(
        |_| k,
        |row, found| local_normal(&points[row], found.iter().map(|&(_, at)| points[at as usize])),
    ))
}

/// Returns a uniformly random pairing of `0..n`: consecutive entries of a random permutation. The
/// point that remains for odd `n` is random, too; in published code it is the last of the file.
pub(super) fn random_pairs(
    n: usize,
    draws: &mut Draws<Cipher>,
) -> (Vec<[OriginalId; 2]>, Vec<Dropped>) {
    let order = draws.permutation(n);
    let (pairs, odd) = order.as_chunks::<2>();
    let dropped = |&id: &u32| Dropped { original: OriginalId(id), reason: DropReason::OddPoint };
    (pairs.iter().map(|pair| pair.map(OriginalId)).collect(), odd.iter().map(dropped).collect())
}

/// Moves the pairs that `accept` refuses to the end and returns their number.
fn refused_last(pairs: &mut [[OriginalId; 2]], accept: impl Fn(&[OriginalId; 2]) -> bool) -> usize {
    let (accepted, refused): (Vec<_>, Vec<_>) = pairs.iter().copied().partition(|p| accept(p));
    pairs[..accepted.len()].copy_from_slice(&accepted);
    pairs[accepted.len()..].copy_from_slice(&refused);
    refused.len()
}
