//! Tests stage files through the public API.

mod damaged;
mod document;
mod hostile;
mod lenient;
mod malformed;
mod malformed_lists;
mod maps;
mod python;
mod round_trip;
mod tables;
mod third_party;
