//! Audits: rows for every combination of scheme, source, inlier ratio and solver of a plan.
//!
//! [`run`](fn@run) audits one map, [`run_many`] many images or the tiles of a map.

mod break_even;
mod cells;
mod clock;
pub mod doubts;
pub mod frames;
mod lists;
mod many;
mod missing;
mod observer;
mod plan;
pub mod published;
mod row;
mod run;
mod share;
pub mod staged;

pub use break_even::{Bound, BreakEven, STRONGEST, break_even};
pub use cells::{check_laws, records_alone};
pub use clock::{RowSeconds, Seconds};
pub use many::{Item, Watcher, run_many};
pub use missing::NotAudited;
pub use observer::{Cell, Measure, Observer, Silent};
pub use plan::{NeighborsBy, Plan, PointNeighbors, Variant};
pub use row::{
    Alone, ByReason, Distinct, Intervals, PERCENTILES, Parts, ReliabilityBin, Row, Spread, measure,
};
pub use run::{Outcome, run, run_released, scheme_called};
pub use share::{
    ByThreshold, Interval, Share, Shares, Threshold, WithInterval, interval_of_largest,
};
