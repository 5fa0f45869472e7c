//! Evaluation of recovered positions against the ground truth.

mod accuracy;
mod blind;
mod plausible;

pub(crate) use accuracy::exchanged_percent;
pub use accuracy::{Accuracy, Bin, Reliability, distinct_weights, evaluate, joined, reliability};
pub use blind::blind;
pub use plausible::{
    OFF_RECORD, Truth, are_strangers, correlation, distance_to_record, nearer_to_own,
    recovered_away,
};
