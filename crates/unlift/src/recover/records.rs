//! Records with their lists in the form that solvers read, and the delta that goes with them.

use super::delta;
use super::learned::Model;
use super::map::family::Family;
use super::map::graph::Graph;
use super::map::lists::Listed;
use super::options::{Delta, RecoverOptions, Solver};
use super::placement;
use crate::density::Peaks;
use crate::neighbors::Neighborhoods;
use crate::released::Released;
use crate::{Error, Shelf};

/// Records as solvers read them.
#[derive(Debug)]
pub(super) enum Records<'a, const D: usize> {
    /// Where records alone say that points are.
    Alone(Peaks),
    /// Records with their lists.
    Listed {
        family: Family<'a, D>,
        /// Who lists whom, where the solver asks.
        graph: Option<Box<Graph>>,
        /// The same as lists, where records have one slot.
        both_ways: Option<Neighborhoods>,
    },
}

/// What attacks on the records alone leave to do.
pub(super) fn at_peaks<'a, const D: usize>(peaks: Peaks) -> (Records<'a, D>, f64) {
    let delta = placement::delta(&peaks);
    (Records::Alone(peaks), delta)
}

/// Records with their lists, and delta: learned, or as `model` says.
pub(super) fn listed<'a, const D: usize>(
    released: &'a Released<D>,
    (lists, shelf): (Listed<'a>, Option<&dyn Shelf>),
    options: &RecoverOptions,
    model: Option<&Model<D>>,
) -> Result<(Records<'a, D>, f64), Error> {
    let family = match model.and_then(|model| model.chance.clone()) {
        Some(chance) => Family::with_chance(released, chance)?,
        None => Family::learn(released, lists)?,
    };
    // Joint recovery also asks who lists whom, from the first pass on.
    let slots_per_record = released.slots_per_record();
    let graph = match (lists, shelf) {
        _ if !matches!(options.solver, Solver::Joint | Solver::JointStart) => None,
        (Listed::Here(lists), _) => Some(Box::new(Graph::new(lists, slots_per_record))),
        (Listed::Away(lists), Some(shelf)) => {
            Some(Box::new(Graph::away(lists, slots_per_record, shelf)?))
        }
        _ => None,
    };
    let both_ways = match (&graph, lists) {
        (Some(graph), Listed::Here(_)) if slots_per_record == 1 => Some(graph.neighborhoods()?),
        _ => None,
    };
    let delta = match (model, options.delta) {
        (Some(model), _) => model.delta,
        (None, Delta::Fixed(delta)) => delta,
        (None, Delta::Auto) => {
            let used = used(lists, graph.as_deref(), both_ways.as_ref());
            delta::learn(released, &family, (used, lists), graph.is_some(), options.seed)?
        }
    };
    Ok((Records::Listed { family, graph, both_ways }, delta))
}

/// The lists that consensus reads: as given, or those of both directions, where joint recovery has them.
pub(super) fn used<'a>(
    lists: Listed<'a>,
    graph: Option<&'a Graph>,
    both_ways: Option<&'a Neighborhoods>,
) -> Listed<'a> {
    match (lists, graph, both_ways) {
        (_, _, Some(both_ways)) => Listed::Here(both_ways),
        (Listed::Away(_), Some(graph), _) if graph.slots_per_record() == 1 => {
            Listed::Edges(graph, lists.about())
        }
        _ => lists,
    }
}
