//! Where the model of confidence says what comes true: on maps and lists like those that it was fitted on.

use rayon::prelude::*;

use crate::ListsBy;
use crate::geometry::flatness::flatness;
use crate::geometry::vector::widen;
use crate::neighbors::Neighborhoods;
use crate::recover::result::estimate::{Estimate, Status};
use crate::recover::result::unknown::Unknown;
use crate::released::{Obfuscation, Rays, Released};

/// A list has at most as many entries as this share of all hidden points in the maps that the model was fitted on.
const MOST_LISTED: f64 = 0.01;

/// A map is flat whose smallest extent is at most this share of its largest one.
const FLAT: f64 = 0.01;

/// Points fall together where at least this share of all rays has another one in its place. Of points that differ this
/// hardly ever happens by rounding.
const COINCIDENT: f64 = 0.5;

/// Why the model says nothing that comes true about maps recovered from `lists`, if so.
///
/// On smaller maps, on flat ones and on those of which most points fall together, and with lists that sources make, a tenth
/// to nine tenths of those called 90 % sure were right.
pub(crate) fn unknown<const D: usize>(
    released: &Released<D>,
    lists: &Neighborhoods,
    estimates: &[Estimate<D>],
) -> Option<Unknown> {
    let n_slots = lists.n_slots() as f64;
    let mean = lists.records().len() as f64 / n_slots.max(1.0);
    let found = || estimates.iter().filter(|one| one.status == Status::Ok);
    let places = || -> Vec<[f64; D]> { found().map(|one| widen(&one.position)).collect() };
    if lists.scores().is_some() {
        Some(Unknown::RankedLists)
    } else if lists.about().lists_by != ListsBy::Oracle {
        Some(Unknown::GivenLists)
    } else if mean > MOST_LISTED * n_slots {
        Some(Unknown::SmallMap)
    } else if coincident(released) >= COINCIDENT {
        Some(Unknown::Coincident)
    } else {
        (flatness(&places()) <= FLAT).then_some(Unknown::Flat)
    }
}

/// Share of the records that tell of points that fall together: rays in the place of others. Records of other families are
/// drawn anew for every point, or for a pair.
fn coincident<const D: usize>(released: &Released<D>) -> f64 {
    match released.obfuscation() {
        Obfuscation::Rays(rays) => twins(rays),
        Obfuscation::Lines(_) | Obfuscation::AxisPlanes(_) | Obfuscation::AxisCandidates(_) => 0.0,
    }
}

/// Share of the rays of which there is another one, bit for bit.
fn twins<const D: usize>(rays: &Rays<D>) -> f64 {
    let bits = |row: usize| (rays.center()[row], rays.direction()[row].map(f32::to_bits));
    let mut rows: Vec<_> = (0..rays.len()).into_par_iter().map(bits).collect();
    rows.par_sort_unstable();
    let same = rows.chunk_by(|a, b| a == b).map(<[_]>::len).filter(|&n| n > 1);
    same.sum::<usize>() as f64 / rays.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::twins;
    use crate::released::Rays;

    #[test]
    fn rays_in_the_same_place_from_the_same_center_are_twins() {
        let centers = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        let up = [0.0, 0.0, 1.0];
        let rays = |center: Vec<u8>, directions: Vec<[f64; 3]>| {
            Rays::try_new(&centers, center, &directions).unwrap()
        };
        assert_eq!(twins(&rays(vec![0, 0, 0, 1], vec![up, up, [0.0, 1.0, 0.0], up])), 0.5);
        assert_eq!(twins(&rays(vec![0, 1], vec![up, up])), 0.0);
    }
}
