//! What a stage file is, before it is read.

use super::header::Kind;
use super::table::Table;
use crate::Error;
use std::path::Path;

/// What can be said of a stage file without reading its columns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// What the file holds.
    pub kind: Kind,
    /// 2 or 3, where the kind has a dimension.
    pub dimension: Option<usize>,
    /// Number of rows: records, slots or points, as the kind has them.
    pub n_rows: u64,
}

/// Reads kind, dimension and number of rows of the stage file `path`: what decides which reader and
/// which `D` to call.
///
/// # Errors
/// When the file is not a Parquet file, or not a stage file of a known kind and version.
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

/// The kind that the metadata of the file at `path` names; `None` where it names none, and where no stage file is.
pub fn declared_kind(path: &Path) -> Option<Kind> {
    Table::open(path).ok()?.meta().kind().ok()?
}
