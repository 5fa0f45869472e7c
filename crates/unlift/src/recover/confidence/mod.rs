//! How sure the attacker can be of each recovered point, from attacker-side data alone.
//!
//! After recovery every slot is looked at once more: `cues.rs` measures how much better than by chance
//! estimates and records agree around it, and `judge.rs` turns that into the probability that the right
//! place was found and a scale of its error. Its constants come from synthetic rooms
//! (`examples/fit_confidence.rs`), never from a real map. Cues are ratios: a scaled map has the same.

mod constants;
mod cues;
mod edges;
mod judge;
pub(super) mod model;
pub(super) mod seen;

use rayon::prelude::*;

use edges::{BothWays, Edges, Listed};

use crate::neighbors::Neighborhoods;
use crate::recover::map::family::Family;
use crate::recover::map::graph::Graph;
use crate::recover::map::pieces::{CandidatePieces, LinePieces, PlanePieces};
use crate::recover::map::settings::Settings;
use crate::recover::options::{RecoverOptions, Solver};
use crate::recover::result::estimate::{Estimate, Status};
use crate::recover::result::probability::Confidence;
use crate::recover::result::unknown::Unknown;
use crate::released::Released;
use seen::{Seen, Solved};

/// A list has at most as many entries as this share of all hidden points in the maps that the model was fitted on.
const MOST_LISTED: f64 = 0.01;

/// Why nobody looks how sure the attacker is, if `options` or the kind of map say so.
pub(super) fn not_asked<const D: usize>(options: &RecoverOptions) -> Option<Unknown> {
    match options.solver {
        Solver::Density | Solver::Tomography => Some(Unknown::FromRecordsAlone),
        Solver::JointStart => Some(Unknown::FirstPass),
        _ if !options.confidence => Some(Unknown::NotAsked),
        _ if !Settings::of_dimension::<D>().confidence => Some(Unknown::OfImages),
        Solver::Consensus | Solver::Joint | Solver::Ransac => None,
    }
}

/// Why the model says nothing that comes true about maps recovered from `lists`, if so.
///
/// On smaller maps, and with lists that sources rank, a tenth to nine tenths of those called 90 % sure were right.
pub(super) fn unknown(lists: &Neighborhoods) -> Option<Unknown> {
    let n_slots = lists.n_slots() as f64;
    let mean = lists.records().len() as f64 / n_slots.max(1.0);
    if lists.scores().is_some() {
        Some(Unknown::RankedLists)
    } else if mean > MOST_LISTED * n_slots {
        Some(Unknown::SmallMap)
    } else {
        None
    }
}

/// Looks around estimates, along `graph` where there is one, else along `lists`.
pub(super) fn look<const D: usize>(
    family: &Family<'_, D>,
    (graph, lists): (Option<&Graph>, &Neighborhoods),
    released: &Released<D>,
    solved: &Solved<'_, D>,
) -> Seen {
    let slots_per_record = released.slots_per_record();
    let seen = match graph {
        Some(graph) => look_along(family, &BothWays { graph, slots_per_record }, solved),
        None => look_along(family, &Listed { lists, slots_per_record }, solved),
    };
    Seen { kind: model::kind(released), ..seen }
}

fn look_along<const D: usize, E: Edges>(
    family: &Family<'_, D>,
    edges: &E,
    solved: &Solved<'_, D>,
) -> Seen {
    match family {
        Family::Lines { rows, slots_per_record, chance } => {
            let pieces = LinePieces::new(rows, *slots_per_record, chance, solved.delta);
            cues::of(&pieces, edges, solved)
        }
        Family::Planes { planes, sorted } => {
            cues::of(&PlanePieces::new(planes, sorted, solved.delta), edges, solved)
        }
        Family::Candidates { rows, chance } => {
            cues::of(&CandidatePieces::new(rows, chance, solved.delta), edges, solved)
        }
    }
}

/// How sure the attacker is of every slot.
pub(super) fn of<const D: usize>(
    solver: Solver,
    estimates: &[Estimate<D>],
    seen: &Seen,
) -> Vec<Confidence> {
    let radius = seen.radius as f32;
    estimates
        .par_iter()
        .zip(&seen.cues)
        .map(|(estimate, cues)| match estimate.status {
            Status::Ok => judge::confidence(solver, seen.kind, cues, radius),
            _ => Confidence::LOST,
        })
        .collect()
}
