//! Reads one Parquet file or a folder of parts.

use super::file::{self, ParquetFile};
use super::manifest::Manifest;
use super::pages::{self, Stay};
use crate::Error;
use crate::input::Budget;
use arrow_array::RecordBatch;
use arrow_schema::SchemaRef;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The extension of a part. Other files, and names that begin with `_` or a dot, are skipped:
/// engines write them.
pub(super) const ENDING: &str = "parquet";

/// One open Parquet file, or all parts of a folder in the order of their names. At least one.
#[derive(Debug)]
pub(super) struct Parts<'a> {
    path: &'a Path,
    files: Vec<Arc<ParquetFile>>,
    meta_text: Option<String>,
}

impl<'a> Parts<'a> {
    /// Opens the file or folder `path` and reads its footers. All parts must have the same columns
    /// and metadata, as in the manifest.
    pub(super) fn open(path: &'a Path) -> Result<Self, Error> {
        if !path.is_dir() {
            let file = ParquetFile::open(path)?;
            let meta_text = file.meta_text().map(str::to_owned);
            return Ok(Self { path, files: vec![Arc::new(file)], meta_text });
        }
        let names = names_in(path)?;
        if names.is_empty() {
            let found = format!("a folder without .{ENDING}");
            return Err(Error::new(path, "", "a stage file, or a folder of its parts", found));
        }
        let manifest = Manifest::read(path)?;
        if let Some(manifest) = &manifest {
            manifest.check_names(path, &names)?;
        }
        let mut files: Vec<Arc<ParquetFile>> = Vec::with_capacity(names.len());
        let mut meta_text = manifest.as_ref().map(Manifest::meta_text);
        for (at, name) in names.iter().enumerate() {
            let file = ParquetFile::open(&path.join(name))?;
            if let Some(manifest) = &manifest {
                manifest.check_part(at, file.path(), (file.n_rows(), file.n_bytes()))?;
            }
            match (file.meta_text(), &meta_text) {
                (Some(found), Some(expected)) if found != expected => {
                    let expected = "the metadata of the other parts";
                    return Err(Error::new(file.path(), "metadata unlift", expected, "others"));
                }
                (Some(found), None) => meta_text = Some(found.to_owned()),
                _ => {}
            }
            if let Some(first) = files.first() {
                same_columns(first, &file)?;
            }
            files.push(Arc::new(file));
        }
        let parts = Self { path, files, meta_text };
        let (n_rows, most) = (parts.n_rows(), i32::MAX as u64);
        if n_rows > most {
            let expected = format!("at most {most} rows in all parts");
            return Err(Error::new(path, "", expected, n_rows.to_string()));
        }
        Ok(parts)
    }

    pub(super) fn n_rows(&self) -> u64 {
        self.files.iter().map(|file| file.n_rows()).sum()
    }

    pub(super) fn schema(&self) -> &SchemaRef {
        self.files[0].schema()
    }

    pub(super) fn meta_text(&self) -> Option<&str> {
        self.meta_text.as_deref()
    }

    pub(super) fn is_all_null(&self, name: &str) -> bool {
        self.files.iter().all(|file| file.n_rows() == 0 || file.is_all_null(name))
    }

    /// Starts decoding the columns at `roots`, in order.
    pub(super) fn batches(&self, roots: &[usize], stay: Stay) -> Result<Batches, Error> {
        let names: Vec<&str> =
            roots.iter().map(|&root| self.schema().field(root).name().as_str()).collect();
        let mut of_files = Vec::with_capacity(self.files.len());
        for file in &self.files {
            for name in &names {
                file.check_codec(name)?;
            }
            // Parts may have another order of columns.
            let at = names.iter().filter_map(|name| file.schema().index_of(name).ok());
            of_files.push(at.collect::<Vec<usize>>());
        }
        let n_bytes = self.files.iter().map(|file| file.n_bytes()).sum();
        let budget = Budget::new(self.path, n_bytes);
        let longest = pages::check(&self.files, &of_files, (&budget, stay))?;
        // Many rows may have the same long text, which a file stores once.
        let most_rows = budget.most().checked_div(longest).map_or(usize::MAX, |n| n as usize);
        let mut waiting: Vec<_> = self.files.iter().cloned().zip(of_files).collect();
        waiting.reverse();
        Ok(Batches { waiting, current: None, most_rows, rest: None })
    }
}

pub(super) struct Batches {
    /// In reverse order.
    waiting: Vec<(Arc<ParquetFile>, Vec<usize>)>,
    current: Option<file::Batches>,
    most_rows: usize,
    /// Rows that [`take`](Self::take) has put back.
    rest: Option<RecordBatch>,
}

impl Batches {
    pub(super) fn next(&mut self) -> Result<Option<RecordBatch>, Error> {
        if let Some(rest) = self.rest.take() {
            return Ok(Some(rest));
        }
        loop {
            if let Some(current) = &mut self.current
                && let Some(batch) = current.next()?
            {
                return Ok(Some(batch));
            }
            let Some((file, roots)) = self.waiting.pop() else { return Ok(None) };
            self.current = Some(file.batches(&roots, self.most_rows)?);
        }
    }

    /// Returns the first `n` of `rows`, and puts the others back.
    pub(super) fn take(&mut self, rows: RecordBatch, n: usize) -> RecordBatch {
        if n < rows.num_rows() {
            self.rest = Some(rows.slice(n, rows.num_rows() - n));
        }
        rows.slice(0, n)
    }
}

/// Returns the files of a stage file: itself, or the parts of a folder in order.
///
/// # Errors
/// When the folder cannot be read.
pub fn part_files(path: &Path) -> Result<Vec<PathBuf>, Error> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    Ok(names_in(path)?.into_iter().map(|name| path.join(name)).collect())
}

pub(super) fn names_in(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let failed = |source| Error::read(folder, source);
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let name = PathBuf::from(entry.map_err(failed)?.file_name());
        let hidden = name.to_string_lossy().starts_with(['_', '.']);
        if !hidden && name.extension().is_some_and(|ending| ending == ENDING) {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

fn same_columns(first: &ParquetFile, other: &ParquetFile) -> Result<(), Error> {
    let columns = |file: &ParquetFile| {
        let fields = file.schema().fields().iter();
        let mut columns: Vec<String> =
            fields.map(|field| format!("{} ({})", field.name(), field.data_type())).collect();
        columns.sort();
        columns
    };
    let (expected, found) = (columns(first), columns(other));
    if expected == found {
        return Ok(());
    }
    let name = first.path().file_name().unwrap_or_default().to_string_lossy();
    let expected = format!("columns as in {name}: {}", expected.join(", "));
    Err(Error::new(other.path(), "", expected, found.join(", ")))
}
