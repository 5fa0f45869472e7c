//! Tests stage files: round trips, NumPy, and malformed files.

pub mod maps;
mod numpy;
mod round_trip;
mod strict;
