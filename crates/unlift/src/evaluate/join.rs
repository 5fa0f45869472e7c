//! Assignment of originals to the rows of a recovered map. No other code decides it.
//!
//! Rows of positions have the order of the lists that they were recovered from ([`RowOrder`]). For
//! records with two points this order decides which positions are correct.

use std::borrow::Cow;

use crate::RowOrder;
use crate::geometry::vector::distance;
use crate::recover::Recovered;
use crate::truth::{Original, Secret};

/// Returns `secret` with slots in the row order of `recovered`.
///
/// - [`RowOrder::Slots`][]: unchanged;
/// - [`RowOrder::DescriptorRows`]: by [`Secret::by_descriptor_row`];
/// - [`RowOrder::Either`] and [`RowOrder::Unstated`]: each record's two points in the order with
///   the smaller error, because an attacker without descriptors cannot know it. The published
///   attacks on paired lines are evaluated this way.
pub fn joined<'a, const D: usize>(
    recovered: &Recovered<D>,
    original: &Original<D>,
    secret: &'a Secret,
) -> Cow<'a, Secret> {
    if secret.slots_per_record() < 2 {
        return Cow::Borrowed(secret);
    }
    match recovered.about().order {
        RowOrder::Slots => Cow::Borrowed(secret),
        RowOrder::DescriptorRows => Cow::Owned(secret.by_descriptor_row()),
        RowOrder::Either | RowOrder::Unstated => {
            Cow::Owned(in_better_order(recovered, original, &secret.by_descriptor_row()))
        }
    }
}

/// Returns `secret` with the two points of every record in the order with the smaller error.
fn in_better_order<const D: usize>(
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
