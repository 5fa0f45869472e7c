//! Attacks on paired lines that cannot tell which of the two points is whose.

use crate::geometry::vector::distance;
use crate::recover::Recovered;
use crate::truth::{Original, Secret};

/// `secret` with the two points of every record in the order that fits `recovered` better: which slot
/// comes first says nothing to an attacker who has no descriptors. The published attacks on paired
/// lines are evaluated this way. Both must have two slots per record.
pub fn in_better_order<const D: usize>(
    recovered: &Recovered<D>,
    original: &Original<D>,
    secret: &Secret,
) -> Secret {
    let positions = original.reveal().positions();
    let error = |slot: usize, of: usize| {
        recovered
            .position(slot)
            .map_or(0.0, |position| distance(&position, &positions[secret.hidden()[of].index()]))
    };
    secret.exchanged(|first| {
        let second = first + 1;
        error(first, second) + error(second, first) < error(first, first) + error(second, second)
    })
}
