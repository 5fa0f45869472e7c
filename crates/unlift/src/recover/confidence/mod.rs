//! How sure the attacker can be of each recovered point, from attacker-side data alone.
//!
//! After recovery every slot is looked at once more: `cues.rs` measures how much better than by chance
//! estimates and records agree around it, and `model.rs` turns that into the probability that the right
//! place was found and a scale of its error. Its constants come from synthetic rooms
//! (`examples/fit_confidence.rs`), never from a real map. Cues are ratios: a scaled map has the same.

mod constants;
mod cues;
mod edges;
mod model;

use rayon::prelude::*;

pub use cues::{Cues, N_CUES};
use edges::{BothWays, Edges, Listed};
pub use model::{Confidence, N_TERMS, centered, terms};

use super::family::Family;
use super::joint::{CandidatePieces, Graph, LinePieces, PlanePieces};
use super::{Estimate, Solver, Status};
use crate::neighbors::Neighborhoods;

/// What the attacker sees around every slot.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Per slot.
    pub cues: Vec<Cues>,
    /// The typical radius of crowds, in the unit of the map: errors scale with it.
    pub radius: f64,
}

/// Looks around `estimates`, along `graph` where there is one, else along `lists`.
pub(super) fn look<const D: usize>(
    family: &Family<'_, D>,
    (graph, lists): (Option<&Graph>, &Neighborhoods),
    slots_per_record: usize,
    estimates: &[Estimate<D>],
    delta: f32,
) -> Seen {
    match graph {
        Some(graph) => look_along(family, &BothWays { graph, slots_per_record }, estimates, delta),
        None => look_along(family, &Listed { lists, slots_per_record }, estimates, delta),
    }
}

fn look_along<const D: usize, E: Edges>(
    family: &Family<'_, D>,
    edges: &E,
    estimates: &[Estimate<D>],
    delta: f32,
) -> Seen {
    match family {
        Family::Lines { rows, slots_per_record, chance } => {
            let pieces = LinePieces::new(rows, *slots_per_record, chance, delta);
            cues::of(&pieces, edges, estimates, delta)
        }
        Family::Planes { planes, sorted } => {
            cues::of(&PlanePieces::new(planes, sorted, delta), edges, estimates, delta)
        }
        Family::Candidates { rows, chance } => {
            cues::of(&CandidatePieces::new(rows, chance, delta), edges, estimates, delta)
        }
    }
}

/// How sure the attacker is of every slot.
pub(super) fn of<const D: usize>(
    family: &Family<'_, D>,
    solver: Solver,
    estimates: &[Estimate<D>],
    seen: &Seen,
) -> Vec<Confidence> {
    let kind = model::kind(family);
    let radius = seen.radius as f32;
    estimates
        .par_iter()
        .zip(&seen.cues)
        .map(|(estimate, cues)| match estimate.status {
            Status::Ok => model::confidence(solver, kind, cues, radius),
            _ => Confidence::LOST,
        })
        .collect()
}
