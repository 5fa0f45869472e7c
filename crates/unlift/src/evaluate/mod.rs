//! Evaluation of recovered positions against the ground truth.

mod accuracy;
mod blind;
mod plausible;
mod reliability;

pub use accuracy::{Accuracy, distinct_weights, evaluate, joined};
pub use blind::blind;
pub(crate) use plausible::off_record;
pub use plausible::{
    OFF_RECORD, are_strangers, away_from_own, bearings, belongs, correlation,
    farthest_for_rounding, is_noise, nearer_to_own, recovered_away,
};
pub use reliability::{BINS, Bin, Reliability, SURE, reliability};
