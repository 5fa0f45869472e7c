//! The attacker: records and neighborhoods in, positions out. Never imports `truth`.

mod recovered;

pub use recovered::{Estimate, Recovered, Status};
