//! Recovered positions against the truth: numbers, no opinions.

mod accuracy;
mod blind;
mod distinct;
mod pairs;
mod reference;
mod reliability;

pub use accuracy::{Accuracy, evaluate};
pub use blind::blind;
pub use distinct::distinct_weights;
pub use pairs::in_better_order;
pub use reference::reference;
pub use reliability::{BINS, Bin, Reliability, SURE, reliability};
