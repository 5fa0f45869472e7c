//! Evaluation of recovered positions against the ground truth.

mod accuracy;
mod bearings;
mod blind;
mod distinct;
mod join;
mod plausible;
mod reliability;

pub use accuracy::{Accuracy, evaluate};
pub use bearings::bearings;
pub use blind::blind;
pub use distinct::distinct_weights;
pub use join::joined;
pub use plausible::{
    are_strangers, away_from_own, belongs, farthest_for_rounding, nearer_to_own, recovered_away,
};
pub use reliability::{BINS, Bin, Reliability, SURE, reliability};
