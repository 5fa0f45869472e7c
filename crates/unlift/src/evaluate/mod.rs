//! Recovered positions against the truth: numbers, no opinions.

mod accuracy;
mod blind;
mod reference;

pub use accuracy::{Accuracy, evaluate};
pub use blind::blind;
pub use reference::reference;
