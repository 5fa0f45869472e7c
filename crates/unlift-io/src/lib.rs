//! unlift: io.

mod error;
pub mod read;

pub use error::{Error, Place};
