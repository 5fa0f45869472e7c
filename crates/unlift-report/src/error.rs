//! The errors of this crate.

/// What can go wrong between an audit's numbers and its files.
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
    /// A field breaks a rule of the format, for example a NaN or a row that stands twice.
    #[error("audit.json: {place}: expected {expected}, found {found}")]
    Invalid {
        /// Where in the document, for example `results[3].recovered_percent["0.10"]`.
        place: String,
        /// What the format asks for.
        expected: String,
        /// What stands there.
        found: String,
    },
}
