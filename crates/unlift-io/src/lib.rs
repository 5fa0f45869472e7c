//! unlift: io.

pub mod atomic;
pub mod clouds;
mod error;
pub mod hash;
pub mod read;
pub mod stage;

pub use error::{Error, Place};
