//! Weights of keypoints at the same place, such as one keypoint with two orientations.

use crate::truth::{Original, Secret};

/// Returns for each slot 1 / the number of slots whose points have exactly the same place.
///
/// With these weights every place counts once. They sum to the number of places.
pub fn distinct_weights<const D: usize>(original: &Original<D>, secret: &Secret) -> Vec<f64> {
    let positions = original.reveal().positions();
    let place = |slot: &usize| {
        // Adding 0.0 turns -0.0 into 0.0.
        positions[secret.hidden()[*slot].index()].map(|x| (x + 0.0).to_bits())
    };
    let mut order: Vec<usize> = (0..secret.n_slots()).collect();
    order.sort_unstable_by_key(place);
    let mut weights = vec![1.0; order.len()];
    for twins in order.chunk_by(|a, b| place(a) == place(b)) {
        twins.iter().for_each(|&slot| weights[slot] = 1.0 / twins.len() as f64);
    }
    weights
}
