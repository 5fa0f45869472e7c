//! Recovered positions against the truth: numbers, no opinions.

mod accuracy;
mod blind;
mod reference;
mod reliability;

pub use accuracy::{Accuracy, evaluate};
pub use blind::blind;
pub use reference::reference;
pub use reliability::{Bin, Reliability, reliability};
