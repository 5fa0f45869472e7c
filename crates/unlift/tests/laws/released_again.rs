//! Recovery from another form of the same map recovers the same percentage of points: records in
//! another order, lines reversed and through another of their points, centers in another order.

use unlift::neighbors::Neighborhoods;
use unlift::obfuscate::Entry;
use unlift::recover::{Builtin, RecoverOptions};
use unlift::released::{AxisCandidates, AxisPlanes, Lines, Obfuscation, Rays, Released};
use unlift::seed::{Draws, Stage};

use crate::maps::*;

/// Number of points of a map, and number of times that it is released again.
const POINTS: usize = 400;
const TIMES: u64 = 8;
/// Distance within which a point is correct, in a room with sides of a few meters.
const NEAR: f64 = 0.1;
/// Limit of the mean difference in standard deviations, and a share that is too small to compare.
const MOST: f64 = 4.0;
const LITTLE: f64 = 0.01;

/// Returns the old position of each new record.
pub fn shuffled(n: usize, draws: &mut Draws) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    for at in (1..n).rev() {
        order.swap(at, draws.below(at as u64 + 1) as usize);
    }
    order
}

/// Returns the records in `order`, each in another form.
pub fn again<const D: usize>(
    records: &Obfuscation<D>,
    order: &[usize],
    draws: &mut Draws,
) -> Obfuscation<D> {
    let wide = |row: &[f32; D]| row.map(f64::from);
    match records {
        Obfuscation::Lines(lines) => {
            let rows = order.iter().map(|&old| {
                let (foot, direction) = (wide(&lines.foot()[old]), wide(&lines.direction()[old]));
                let (t, turned) = (draws.between(-3.0, 3.0), draws.below(2) == 0);
                let through = std::array::from_fn(|c| foot[c] + t * direction[c]);
                (through, direction.map(|x| if turned { -x } else { x }))
            });
            let (points, directions): (Vec<_>, Vec<_>) = rows.unzip();
            Obfuscation::Lines(Lines::through(&points, &directions).unwrap())
        }
        Obfuscation::Rays(rays) => {
            let n = rays.centers().len();
            let center = order.iter().map(|&old| n as u8 - 1 - rays.center()[old]).collect();
            let centers: Vec<_> = rays.centers().iter().rev().map(wide).collect();
            let directions: Vec<_> =
                order.iter().map(|&old| wide(&rays.direction()[old])).collect();
            let again = Rays::try_new(&centers, center, &directions).unwrap();
            Obfuscation::Rays(match rays.regions() {
                Some(regions) => {
                    again.with_regions(regions.iter().rev().copied().collect()).unwrap()
                }
                None => again,
            })
        }
        Obfuscation::AxisPlanes(planes) => {
            let axis = order.iter().map(|&old| planes.axis()[old]).collect();
            let offset: Vec<f64> = order.iter().map(|&old| planes.offset()[old].into()).collect();
            Obfuscation::AxisPlanes(AxisPlanes::try_new(axis, &offset).unwrap())
        }
        Obfuscation::AxisCandidates(points) => {
            let rows: Vec<_> = order.iter().map(|&old| wide(&points.position()[old])).collect();
            Obfuscation::AxisCandidates(AxisCandidates::try_new(&rows).unwrap())
        }
    }
}

pub fn lists_again(lists: &Neighborhoods, order: &[usize], per: usize) -> Neighborhoods {
    let mut new_of = vec![0; order.len()];
    order.iter().enumerate().for_each(|(new, &old)| new_of[old] = new as u32);
    let slots = order.iter().flat_map(|&old| (0..per).map(move |at| old * per + at));
    let rows = slots.map(|old| {
        let mut row: Vec<u32> = lists.of(old).iter().map(|id| new_of[id.index()]).collect();
        row.sort_unstable();
        row
    });
    lists_of(&rows.collect::<Vec<_>>(), order.len(), per)
}

/// Returns the share of correct points, of the old map in `order`.
fn right<const D: usize>(
    hidden: &Hidden<D>,
    released: &Released<D>,
    lists: &Neighborhoods,
    order: &[usize],
    solver: Builtin,
) -> f64 {
    let options = (solver, RecoverOptions { seed: 3, ..RecoverOptions::default() });
    let recovered = solve(released, lists, options);
    let per = released.slots_per_record();
    let near = |new: usize| {
        let truth = hidden.local(order[new / per] * per + new % per);
        recovered.positions()[new]
            .iter()
            .zip(truth)
            .all(|(&found, true_)| (f64::from(found) - true_).abs() <= NEAR)
    };
    (0..recovered.n_slots()).filter(|&new| near(new)).count() as f64 / recovered.n_slots() as f64
}

fn shares_do_not_depend_on_how_a_map_is_written<const D: usize>(name: &str, scheme: &Entry) {
    for solver in Builtin::FROM_LISTS {
        let mut differences = Vec::new();
        for time in 0..TIMES {
            let hidden = hide::<D>(scheme, &room(time, POINTS), 50 + time);
            let (released, lists) = (&hidden.released, hidden.lists(20, 0.5, time));
            let per = released.slots_per_record();
            let mut draws = Draws::new(time, Stage::Synthetic, 13);
            let order = shuffled(released.n_records(), &mut draws);
            let written = again(released.obfuscation(), &order, &mut draws);
            let anew = Released::try_new(written, per, released.origin(), released.unit(), None);
            let anew = anew.unwrap().with_bounds(released.bounds());
            let in_order: Vec<usize> = (0..released.n_records()).collect();
            let before = right(&hidden, released, &lists, &in_order, solver);
            let lists = lists_again(&lists, &order, per);
            differences.push(right(&hidden, &anew, &lists, &order, solver) - before);
        }
        let n = differences.len() as f64;
        let mean = differences.iter().sum::<f64>() / n;
        let variance = differences.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let chance = LITTLE + MOST * (variance / n).sqrt();
        assert!(mean.abs() < chance, "{name} in {D}D, {solver:?}: {differences:?}");
    }
}

#[test]
fn a_map_that_is_written_otherwise_gives_the_same_shares() {
    over_schemes!(shares_do_not_depend_on_how_a_map_is_written);
}
