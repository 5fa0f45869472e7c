//! Thresholds for recovered points.

use crate::Error;

/// An error below which a point counts as recovered.
#[derive(Clone, Debug, PartialEq)]
pub struct Threshold {
    /// Text as the user typed it; the key in reports.
    pub label: String,
    /// Value in the unit of the points.
    pub value: f64,
}

impl Threshold {
    /// Parses a positive number and keeps its text.
    ///
    /// # Errors
    /// When `text` is not a positive number.
    pub fn parse(text: &str) -> Result<Self, Error> {
        match text.trim().parse::<f64>() {
            Ok(value) if value.is_finite() && value > 0.0 => {
                Ok(Self { label: text.trim().to_owned(), value })
            }
            _ => Err(Error::new("threshold", "a positive number", format!("{text:?}"))),
        }
    }
}
