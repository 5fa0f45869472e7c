//! Random pairings, for schemes that hide two points together.

use crate::OriginalId;
use crate::seed::{Cipher, Draws};
use crate::truth::{DropReason, Dropped};

/// Returns a uniformly random pairing of `0..n`: consecutive entries of a random permutation. The
/// point that remains for odd `n` is random, too; in published code it is the last of the file.
pub(super) fn random_pairs(
    n: usize,
    draws: &mut Draws<Cipher>,
) -> (Vec<[OriginalId; 2]>, Vec<Dropped>) {
    let order = draws.permutation(n);
    let (pairs, odd) = order.as_chunks::<2>();
    let pairs = pairs.iter().map(|pair| pair.map(OriginalId)).collect();
    let dropped = odd
        .iter()
        .map(|&id| Dropped { original: OriginalId(id), reason: DropReason::OddPoint })
        .collect();
    (pairs, dropped)
}

/// Pairs the points of the last `refused` pairs again. Returns the number of pairs that `accept`
/// still refuses and moves them to the end.
pub(super) fn pair_again(
    pairs: &mut [[OriginalId; 2]],
    refused: usize,
    draws: &mut Draws<Cipher>,
    accept: impl Fn(&[OriginalId; 2]) -> bool,
) -> usize {
    let start = pairs.len() - refused;
    let mut pool: Vec<OriginalId> = pairs[start..].as_flattened().to_vec();
    draws.shuffle(&mut pool);
    let (mut accepted, mut still_refused) = (Vec::new(), Vec::new());
    for pair in pool.as_chunks::<2>().0 {
        if accept(pair) { accepted.push(*pair) } else { still_refused.push(*pair) }
    }
    for (at, pair) in accepted.iter().chain(&still_refused).enumerate() {
        pairs[start + at] = *pair;
    }
    still_refused.len()
}

/// Moves the pairs that `accept` refuses to the end and returns their number.
pub(super) fn refused_last(
    pairs: &mut Vec<[OriginalId; 2]>,
    accept: impl Fn(&[OriginalId; 2]) -> bool,
) -> usize {
    let (accepted, refused): (Vec<_>, Vec<_>) = pairs.iter().copied().partition(|p| accept(p));
    pairs.clear();
    pairs.extend(accepted);
    pairs.extend(&refused);
    refused.len()
}

pub(super) fn drop_pairs(pairs: &[[OriginalId; 2]], reason: DropReason) -> Vec<Dropped> {
    pairs.as_flattened().iter().map(|&original| Dropped { original, reason }).collect()
}
