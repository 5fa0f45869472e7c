//! Stage files, as a user of the public API sees them.

mod damaged;
mod document;
mod hostile;
mod lenient;
mod malformed;
mod malformed_lists;
mod maps;
mod parts;
mod python;
mod round_trip;
mod tables;
mod third_party;
