//! Tests stage files: round trips, NumPy, and malformed files.

mod maps;
mod numpy;
mod round_trip;
mod strict;
