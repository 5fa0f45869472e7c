//! Evaluation of recovered positions against the ground truth.

mod accuracy;
mod blind;
mod plausible;
mod reliability;

pub use accuracy::{Accuracy, distinct_weights, evaluate, joined};
pub use blind::blind;
pub use plausible::{
    OFF_RECORD, Truth, are_strangers, correlation, distance_to_record, nearer_to_own,
    recovered_away,
};
pub use reliability::{Bin, Reliability, reliability};
