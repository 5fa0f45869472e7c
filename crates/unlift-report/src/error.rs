//! The errors of this crate.

/// An error in reading, checking or writing an audit's files.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The text is not an `audit.json` of this schema.
    #[error("audit.json: {0}")]
    Json(#[from] serde_json::Error),
    /// The page could not be rendered.
    #[error("report.html: {0}")]
    Template(#[from] minijinja::Error),
    /// The document was written by another version of the format.
    #[error("audit.json: expected schema {expected}, found {found}")]
    Schema {
        /// The schema this build reads.
        expected: u32,
        /// The schema the text declares.
        found: u64,
    },
    /// A field breaks a rule of the format, for example a NaN or a repeated row.
    #[error("audit.json: {place}: expected {expected}, found {found}")]
    Invalid {
        /// Where in the document, for example `results[3].recovered_percent["0.10"]`.
        place: String,
        /// The rule of the format.
        expected: String,
        /// The value found.
        found: String,
    },
}
