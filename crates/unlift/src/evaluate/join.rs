//! Which original every row of a recovered map is compared with: the one place that decides it.
//!
//! Rows of positions are counted as the lists were that they came from ([`RowOrder`]). Of records that hide two
//! points this decides what is right and what is a miss.

use std::borrow::Cow;

use crate::RowOrder;
use crate::geometry::vector::distance;
use crate::recover::Recovered;
use crate::truth::{Original, Secret};

/// `secret` with slots counted as the rows of `recovered` are.
///
/// - [`RowOrder::Slots`]: as it is;
/// - [`RowOrder::DescriptorRows`]: by [`Secret::by_descriptor_row`];
/// - [`RowOrder::Either`], and [`RowOrder::Unstated`] where one secret must be named: the two points of every record
///   in the order that fits better, since an attacker who has no descriptors cannot know it. The published
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

/// `secret` with the two points of every record in the order that fits `recovered` better.
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
