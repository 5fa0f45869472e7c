//! What is read of a map, and what one unit of it is.

use crate::values;
use clap::Args;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use unlift_audit::OutlierFilter;

/// What is read, and what one unit of it means: shared by `audit map` and `obfuscate`.
#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct MapArgs {
    /// Meters per unit of the map. Without it the unit is the usual distance to the K-th neighbor (the median)
    #[arg(long, value_name = "METERS_PER_UNIT", value_parser = values::scale)]
    pub scale: Option<f64>,
    /// Descriptors of the points: a COLMAP database.db or hloc's features.h5 that the model was made of,
    /// a .npy array with a row per point (of a COLMAP model by ascending point id), or a file that
    /// begins with P3DESC01
    #[arg(long, value_name = "FILE")]
    pub descriptors: Option<PathBuf>,
    /// Use a random subset of at most this many points
    #[arg(long, value_parser = values::count, value_name = "N")]
    pub max_points: Option<NonZeroUsize>,
    /// Leave out points whose mean distance to this many neighbors exceeds the mean of all by more
    /// than RATIO standard deviations [default when given: 20,2.0]
    #[arg(long, value_name = "NEIGHBORS,RATIO", value_parser = values::outlier_filter,
          num_args = 0..=1, require_equals = true, default_missing_value = "20,2.0")]
    pub outlier_filter: Option<OutlierFilter>,
    /// True neighbors per point; without --scale also what lengths are measured in: the usual distance to this one
    #[arg(long, value_name = "K", default_value = "50",
          value_parser = clap::value_parser!(u16).range(1..))]
    pub k: u16,
    /// The integer that all randomness comes from [default: 0 for audits; obfuscate uses a fresh key
    /// of 256 bits instead, as whoever guesses the integer undoes the hiding]
    #[arg(long, value_name = "INTEGER")]
    pub seed: Option<u64>,
}
