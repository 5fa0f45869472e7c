//! Files of unlift: maps in ([`read`]), features of images in and out ([`features`]), stages in and out
//! ([`stage`]), clouds out ([`clouds`]).
//!
//! Bad input gets one line that names the file, the place, what was expected and what was found;
//! outputs appear whole or not at all, and never in place of what is not theirs ([`atomic`]).

pub mod atomic;
pub mod clouds;
mod database;
mod error;
pub mod features;
pub mod hash;
pub mod read;
pub mod stage;

pub use error::{Error, Place};
