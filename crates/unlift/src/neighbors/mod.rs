//! Neighborhoods: which records are said to hide points near the point of a slot.

mod geometric;
mod neighborhoods;
pub mod oracle;

pub use geometric::geometric;
pub use neighborhoods::Neighborhoods;
