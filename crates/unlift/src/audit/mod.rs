//! One whole audit as a value: a plan in, rows out. The only module that sees the whole pipeline.

mod break_even;
mod lists;
mod plan;
mod row;
mod run;

pub use break_even::{Bound, BreakEven, break_even};
pub use plan::{Plan, PointNeighbors, Source, Threshold, Variant};
pub use row::{PERCENTILES, Repeats, Row};
pub use run::{Cell, Observer, Outcome, REFERENCE, RowSeconds, Seconds, Silent, run};
