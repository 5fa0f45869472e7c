//! Audits: rows for every combination of scheme, source, inlier ratio and solver of a plan. Only
//! this module uses all stages.
//!
//! [`run`](fn@run) audits one map, [`run_many`] many images or the tiles of a map. A [`Plan`] can
//! contain custom schemes, sources, solvers and measures.

mod break_even;
mod cells;
mod chance;
mod clock;
mod item;
mod laws;
mod lists;
mod many;
mod measure;
mod not_audited;
mod observer;
mod plan;
mod pool;
mod records_alone;
mod released;
mod row;
mod run;
mod solved;
pub mod staged;
mod threshold;

pub use break_even::{Bound, BreakEven, STRONGEST, break_even};
pub use clock::{RowSeconds, Seconds};
pub use laws::check_laws;
pub use many::{Item, Watcher, run_many};
pub use measure::measure;
pub use not_audited::NotAudited;
pub use observer::{Cell, Counts, Measure, Observer, Silent};
pub use plan::{NeighborsBy, Plan, PointNeighbors, Variant};
pub use records_alone::records_alone;
pub use released::{run_released, scheme_called};
pub use row::{Alone, Distinct, PERCENTILES, Repeats, Row};
pub use run::{Outcome, run};
pub use threshold::Threshold;
