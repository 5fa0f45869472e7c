//! The published density attacks, for comparison: constants as published, nothing read but the records.
//!
//! One point per line (Chelani et al., CVPR 2021): the nearest lines vote where they pass; the peak of
//! the votes is the estimate; then lines vote again, chosen near the present estimates. Two points per
//! line (Lee et al., CVPR 2023): the two highest peaks of a kernel density of the votes. Rays (Moon et
//! al., CVPR 2024): rays of other centers vote, once. (Paper, supplement, "Comparison to other 3D line recoveries".)
//!
//! The published programs read more than the records: votes counted from the true point, a line that
//! votes for itself exactly there, ranges from true distances. Here votes are counted from the foot, a line
//! has no vote of its own, ranges come from the votes.

mod columns;
mod peak;

use rayon::prelude::*;

use crate::density::feasible::{Feasible, FeasibleLine, Hides};
use crate::density::{Peak, Peaks};
use crate::released::Released;
use columns::{LineColumns, PointColumns, nearest};
use peak::{crowd, two_crowds};

/// Nearest lines that vote at first: at most so many, and at most this share of all.
const COARSE: (usize, f64) = (500, 0.05);
/// The same for paired points, of which a vote may mean either.
const COARSE_OF_PAIRS: (usize, f64) = (1000, 0.05);
/// Rounds in which the voting lines are chosen anew.
const REFINEMENTS: usize = 3;
/// Estimates nearest to a line, and lines nearest to its estimate, of which those in both vote.
const REFINE: usize = 100;
/// Fewer than this in both are too few: then all lines of the near estimates vote.
const FEWEST: usize = 10;
/// Larger maps let this many lines vote, spread evenly over the file: all pairs would be too many.
const MOST_VOTERS: usize = 100_000;

/// Where the published attacks put the points of `released`. No answer for planes, axis candidates and
/// maps that are not in three dimensions.
pub(crate) fn published<const D: usize>(released: &Released<D>) -> Peaks {
    let n_slots = released.n_slots();
    let Some(feasible) = Feasible::new(released) else {
        return Peaks::none(n_slots);
    };
    if feasible.hides == Hides::OnAxis || n_slots == 0 {
        return Peaks::none(n_slots);
    }
    let lines = &feasible.lines;
    let every = lines.len().div_ceil(MOST_VOTERS);
    let voters: Vec<u32> = (0..lines.len() as u32).step_by(every).collect();
    let columns = LineColumns::new(lines, &voters);
    let (most, share) = if feasible.hides == Hides::Two { COARSE_OF_PAIRS } else { COARSE };
    let k = most.min((share * lines.len() as f64) as usize).max(2);
    let vote = |scratch: &mut Scratch, row: usize| {
        columns.distances_to_line(&lines[row], &mut scratch.distances);
        scratch.silence(row, lines, &voters);
        let reach = nearest(&scratch.distances, k, &mut scratch.keys, &mut scratch.near);
        let near = scratch.near.iter().map(|&at| &lines[voters[at as usize] as usize]);
        passes(&lines[row], near, &mut scratch.votes);
        reach
    };
    let place = |row: usize, t: f64| on(&lines[row], t);
    if feasible.hides == Hides::Two {
        let rows: Vec<([Option<Peak>; 2], f32)> = (0..lines.len())
            .into_par_iter()
            .map_init(Scratch::default, |scratch, row| {
                let reach = vote(scratch, row);
                let found = two_crowds(&mut scratch.votes);
                (found.map_or([None; 2], |pair| pair.map(|t| place(row, t))), reach)
            })
            .collect();
        let resolution = median(rows.iter().map(|row| row.1));
        return Peaks { of: rows.into_iter().flat_map(|row| row.0).collect(), resolution };
    }
    let rows: Vec<(Option<Peak>, f32)> = (0..lines.len())
        .into_par_iter()
        .map_init(Scratch::default, |scratch, row| {
            let reach = vote(scratch, row);
            (crowd(&mut scratch.votes).and_then(|t| place(row, t)), reach)
        })
        .collect();
    let resolution = median(rows.iter().map(|row| row.1));
    let mut of: Vec<Option<Peak>> = rows.into_iter().map(|row| row.0).collect();
    if feasible.hides == Hides::One {
        for _ in 0..REFINEMENTS {
            of = refine(lines, &voters, &columns, &of);
        }
    }
    Peaks { of, resolution }
}

/// One refinement: lines whose estimates are near a line and that pass near its estimate vote again.
fn refine(
    lines: &[FeasibleLine],
    voters: &[u32],
    columns: &LineColumns,
    estimates: &[Option<Peak>],
) -> Vec<Option<Peak>> {
    let points = PointColumns::new(estimates, voters);
    let step = |scratch: &mut Scratch, row: usize| {
        let estimate = estimates[row]?;
        points.distances_to_line(&lines[row], &mut scratch.distances);
        scratch.silence(row, lines, voters);
        nearest(&scratch.distances, REFINE, &mut scratch.keys, &mut scratch.near);
        columns.distances_to_point(&estimate.position, &mut scratch.distances);
        scratch.silence(row, lines, voters);
        nearest(&scratch.distances, REFINE, &mut scratch.keys, &mut scratch.passing);
        scratch.passing.sort_unstable();
        let passes_too = |at: &u32| scratch.passing.binary_search(at).is_ok();
        let both: Vec<u32> = scratch.near.iter().copied().filter(passes_too).collect();
        let chosen = if both.len() > FEWEST { &both } else { &scratch.near };
        let near = chosen.iter().map(|&at| &lines[voters[at as usize] as usize]);
        passes(&lines[row], near, &mut scratch.votes);
        crowd(&mut scratch.votes).and_then(|t| on(&lines[row], t)).or(Some(estimate))
    };
    (0..lines.len()).into_par_iter().map_init(Scratch::default, step).collect()
}

#[derive(Default)]
struct Scratch {
    distances: Vec<f32>,
    keys: Vec<u64>,
    near: Vec<u32>,
    passing: Vec<u32>,
    votes: Vec<f64>,
}

impl Scratch {
    /// Takes the vote of the line itself, and of rays of its center.
    fn silence(&mut self, row: usize, lines: &[FeasibleLine], voters: &[u32]) {
        let own = lines[row].group;
        if own.is_some() {
            for (distance, &voter) in self.distances.iter_mut().zip(voters) {
                if lines[voter as usize].group == own {
                    *distance = f32::INFINITY;
                }
            }
        } else if let Ok(at) = voters.binary_search(&(row as u32)) {
            self.distances[at] = f32::INFINITY;
        }
    }
}

/// The parameters at which `line` is passed most closely by each of `others`; parallel ones do not tell.
fn passes<'a>(
    line: &FeasibleLine,
    others: impl Iterator<Item = &'a FeasibleLine>,
    out: &mut Vec<f64>,
) {
    out.clear();
    for other in others {
        let (mut along, mut own, mut cosine) = (0.0f64, 0.0f64, 0.0f64);
        for c in 0..3 {
            let away = f64::from(line.through[c]) - f64::from(other.through[c]);
            let (d, e) = (f64::from(line.direction[c]), f64::from(other.direction[c]));
            own += away * d;
            along += away * e;
            cosine += d * e;
        }
        let square_sine = 1.0 - cosine * cosine;
        let t = (cosine * along - own) / square_sine;
        if square_sine > 1e-6 && t > f64::from(line.from) {
            out.push(t);
        }
    }
}

fn on(line: &FeasibleLine, t: f64) -> Option<Peak> {
    let position = std::array::from_fn(|c| {
        (f64::from(line.through[c]) + t * f64::from(line.direction[c])) as f32
    });
    let finite = position.iter().all(|x: &f32| x.is_finite());
    finite.then_some(Peak { position, axis: 0, evidence: 0.0 })
}

fn median(values: impl Iterator<Item = f32>) -> f64 {
    let mut values: Vec<f64> = values.map(f64::from).filter(|x| x.is_finite()).collect();
    if values.is_empty() { 0.0 } else { crate::geometry::vector::median(&mut values) }
}
