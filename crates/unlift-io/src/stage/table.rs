//! A table of one kind: from a Parquet file or a folder of its parts, or the rows of one image in
//! it.

use super::column::{Batch, Type};
use super::header::{Kind, Meta};
use super::pages::Stay;
use super::parts::Parts;
use crate::Error;
use arrow_array::RecordBatch;
use arrow_schema::SchemaRef;
use std::path::Path;
use unlift::Unit;

/// A table with columns that are read by name.
#[derive(Debug)]
pub(super) struct Table<'a> {
    path: &'a Path,
    rows: Rows<'a>,
    meta: Meta<'a>,
}

#[derive(Debug)]
enum Rows<'a> {
    Stored(Parts<'a>),
    /// The rows of one image. At least one batch.
    Held(Vec<RecordBatch>),
}

impl<'a> Table<'a> {
    pub(super) fn open(path: &'a Path) -> Result<Self, Error> {
        let parts = Parts::open(path)?;
        let meta = Meta::parse(path, parts.meta_text())?;
        Ok(Self { path, rows: Rows::Stored(parts), meta })
    }

    pub(super) fn held(path: &'a Path, meta: Meta<'a>, held: Vec<RecordBatch>) -> Self {
        Self { path, rows: Rows::Held(held), meta }
    }

    /// Opens `path`, which must be of `kind`.
    pub(super) fn open_kind(path: &'a Path, kind: Kind) -> Result<Self, Error> {
        let table = Self::open(path)?;
        let found = match table.meta.kind()? {
            Some(found) => found,
            // An ambiguous table is taken for the requested kind.
            None => table.kind_by_columns().unwrap_or(kind),
        };
        if found == kind {
            Ok(table)
        } else {
            Err(Error::new(path, "", kind.to_string(), found.to_string()))
        }
    }

    /// The kind by the metadata, else by the columns.
    pub(super) fn kind(&self) -> Result<Kind, Error> {
        let kind = self.meta.kind()?.or_else(|| self.kind_by_columns());
        kind.ok_or_else(|| Error::new(self.path, "", "a stage file of unlift", NO_METADATA))
    }

    /// Returns the kind, if only one has such columns.
    fn kind_by_columns(&self) -> Option<Kind> {
        let any = |names: &[&str]| names.iter().any(|name| self.has(name));
        if self.has("point") && self.has("neighbors") {
            Some(Kind::PointNeighborhoods)
        } else if self.has("records") {
            Some(Kind::Neighborhoods)
        } else if any(&["foot_x", "direction_x", "offset"]) {
            Some(Kind::Released)
        } else if any(&["original", "dropped", "swapped_axis"]) {
            Some(Kind::Truth)
        } else if any(&["status", "support", "evidence", "error_scale"]) {
            Some(Kind::Recovered)
        } else {
            None
        }
    }

    pub(super) fn path(&self) -> &'a Path {
        self.path
    }

    pub(super) fn refused(&self, source: unlift::Error) -> Error {
        Error::core(self.path, source)
    }

    pub(super) fn meta(&self) -> &Meta<'a> {
        &self.meta
    }

    /// The dimension by the metadata, else by the columns.
    pub(super) fn dimension(&self) -> Result<usize, Error> {
        if let Some(declared) = self.meta.dimension()? {
            return Ok(declared);
        }
        let any = |names: [&str; 3]| names.iter().any(|name| self.has(name));
        if any(["z", "foot_z", "direction_z"]) {
            Ok(3)
        } else if any(["y", "foot_y", "direction_y"]) {
            Ok(2)
        } else {
            // Planes have no column per axis.
            Err(self.meta.wrong("dimension", "2 or 3"))
        }
    }

    pub(super) fn expect_dimension<const D: usize>(&self) -> Result<(), Error> {
        let found = self.dimension()?;
        if found == D {
            return Ok(());
        }
        if self.meta.dimension()?.is_some() {
            return Err(self.meta.wrong("dimension", D.to_string()));
        }
        let found = format!("columns of {found}");
        Err(Error::new(self.path, "", format!("{D} dimensions"), found))
    }

    /// The unit of all lengths: as declared, else `usual`, else pixels in 2D.
    pub(super) fn unit<const D: usize>(&self, usual: Option<Unit>) -> Result<Unit, Error> {
        let in_plane = (D == 2).then_some(Unit::Pixel);
        let unit = self.meta.unit()?.or(usual).or(in_plane);
        unit.ok_or_else(|| self.meta.wrong_unit())
    }

    pub(super) fn n_rows(&self) -> u64 {
        match &self.rows {
            Rows::Stored(parts) => parts.n_rows(),
            Rows::Held(held) => held.iter().map(|rows| rows.num_rows() as u64).sum(),
        }
    }

    /// Returns true if there is a column `name` that may have a value, as far as file metadata
    /// shows.
    pub(super) fn has(&self, name: &str) -> bool {
        let field = self.schema().column_with_name(name);
        let named = field.is_some_and(|(_, field)| !field.data_type().is_null());
        named && (self.n_rows() == 0 || !self.is_all_null(name))
    }

    pub(super) fn present<'c>(&self, columns: &[(&'c str, Type)]) -> Vec<(&'c str, Type)> {
        columns.iter().copied().filter(|(name, _)| self.has(name)).collect()
    }

    pub(super) fn is(&self, name: &str, class: Type) -> bool {
        let field = self.schema().column_with_name(name);
        field.is_some_and(|(_, field)| class.admits(field.data_type()))
    }

    /// Decodes `columns`, a few thousand rows at a time, and passes them to `each` in the order of
    /// rows.
    pub(super) fn read(
        &self,
        columns: &[(&str, Type)],
        mut each: impl FnMut(&Batch<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut roots = Vec::with_capacity(columns.len());
        for &(name, class) in columns {
            roots.push(self.find(name, class)?);
        }
        let parts = match &self.rows {
            Rows::Stored(parts) => parts,
            Rows::Held(held) => {
                let mut first_row = 0;
                for rows in held {
                    each(&Batch::new((self.path, columns), rows, first_row))?;
                    first_row += rows.num_rows() as u64;
                }
                return Ok(());
            }
        };
        let mut batches = parts.batches(&roots, Stay::Whole)?;
        let mut first_row = 0;
        while let Some(batch) = batches.next()? {
            each(&Batch::new((self.path, columns), &batch, first_row))?;
            first_row += batch.num_rows() as u64;
        }
        Ok(())
    }

    /// Returns true if the column `name` has no values. `n_null` is the number of rows in batches
    /// that are all null. Values in some rows only are an error.
    pub(super) fn is_without(&self, name: &str, n_null: usize) -> Result<bool, Error> {
        if n_null == 0 || n_null as u64 == self.n_rows() {
            return Ok(n_null > 0);
        }
        let found = format!("null in {n_null} of {}", self.n_rows());
        let place = format!("column {name}");
        Err(Error::new(self.path, place, "a list in every row, or in none", found))
    }

    fn schema(&self) -> &SchemaRef {
        match &self.rows {
            Rows::Stored(parts) => parts.schema(),
            Rows::Held(held) => held[0].schema_ref(),
        }
    }

    fn is_all_null(&self, name: &str) -> bool {
        match &self.rows {
            Rows::Stored(parts) => parts.is_all_null(name),
            Rows::Held(held) => held.iter().all(|rows| {
                let column = rows.column_by_name(name);
                column.is_some_and(|column| column.null_count() == column.len())
            }),
        }
    }

    /// Returns the index of the column `name`, which must exist once and have the type `class`.
    fn find(&self, name: &str, class: Type) -> Result<usize, Error> {
        let wrong = |found: String| {
            Error::new(self.path, format!("column {name}"), class.to_string(), found)
        };
        let fields = self.schema().fields().iter().enumerate();
        let mut named = fields.filter(|(_, field)| field.name() == name);
        let Some((at, field)) = named.next() else {
            return Err(wrong("no such column".into()));
        };
        if named.next().is_some() {
            return Err(wrong("two columns of this name".into()));
        }
        if !class.admits(field.data_type()) {
            return Err(wrong(format!("type {}", field.data_type())));
        }
        Ok(at)
    }
}

const NO_METADATA: &str = "a Parquet file without metadata of unlift";
