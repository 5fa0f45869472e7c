//! Tests stage files through the public API.

mod maps;
mod numpy;
mod round_trip;
mod strict;
