//! Describes a stage file without reading its columns.

use super::header::Kind;
use super::table::Table;
use crate::Error;
use std::path::Path;

/// The description of a stage file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// The kind of the file.
    pub kind: Kind,
    /// The dimension, 2 or 3, for kinds that have one.
    pub dimension: Option<usize>,
    /// The number of rows: records, slots or points, depending on the kind.
    pub n_rows: u64,
}

/// Reads kind, dimension and number of rows of the stage file `path`, which decide the reader and
/// `D`.
///
/// # Errors
/// When the file is not a stage file of a known kind and version.
pub fn peek(path: &Path) -> Result<Header, Error> {
    let table = Table::open(path)?;
    let kind = table.kind()?;
    let dimension = match kind {
        Kind::Neighborhoods | Kind::PointNeighborhoods => None,
        Kind::Released | Kind::Truth | Kind::Recovered => Some(table.dimension()?),
    };
    let n_rows = table.n_rows();
    Ok(Header { kind, dimension, n_rows })
}

/// Returns the kind that the metadata of the file at `path` declares, if it is a stage file and
/// declares one.
pub fn declared_kind(path: &Path) -> Option<Kind> {
    Table::open(path).ok()?.meta().kind().ok()?
}
