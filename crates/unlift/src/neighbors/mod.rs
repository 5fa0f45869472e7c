//! Neighborhoods: which records are said to hide points near the point of a slot.

mod neighborhoods;
pub mod oracle;

pub use neighborhoods::Neighborhoods;
