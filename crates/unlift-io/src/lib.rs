//! unlift: io.

mod error;

pub use error::{Error, Place};
