//! Splits a stage file into a folder of parts.

use super::header::{Kind, Meta};
use super::manifest::{MANIFEST, Manifest, Part};
use super::pages::Stay;
use super::parts::{ENDING, Parts, names_in};
use super::table::Table;
use super::write::{GROUP_ROWS, properties, write_batches};
use crate::Error;
use crate::atomic::{self, Access, OutputSet, Rules, write_file};
use arrow_schema::Field;
use std::fs;
use std::path::{Path, PathBuf};

/// A stage file (or folder of parts) that is split into parts and a manifest, for engines that read
/// many files in parallel.
///
/// The order of rows and the types of columns do not change. Every part has the metadata of the
/// whole.
#[derive(Debug)]
pub struct Split<'a> {
    path: &'a Path,
    parts: Parts<'a>,
    kind: Kind,
    rows: u64,
    names: Vec<String>,
}

impl<'a> Split<'a> {
    /// Opens `path`, to be split into parts of `rows` rows, rounded up to an even number, so that
    /// both slots of a paired line are in one part.
    ///
    /// # Errors
    /// When it is not a stage file, or its parts do not match.
    pub fn open(path: &'a Path, rows: u64) -> Result<Self, Error> {
        let kind = Table::open(path)?.kind()?;
        let parts = Parts::open(path)?;
        let mut names: Vec<&str> =
            parts.schema().fields().iter().map(|f| f.name().as_str()).collect();
        names.sort_unstable();
        if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            let place = format!("column {}", twice[0]);
            return Err(Error::new(path, place, "one of this name", "two columns of this name"));
        }
        let rows = rows.clamp(1, u64::MAX - 1).next_multiple_of(2);
        let n_parts = parts.n_rows().div_ceil(rows).max(1);
        let names = (0..n_parts).map(|at| format!("part-{at:06}.{ENDING}")).collect();
        Ok(Self { path, parts, kind, rows, names })
    }

    /// The kind of the file and its parts.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// The total number of rows.
    pub fn n_rows(&self) -> u64 {
        self.parts.n_rows()
    }

    /// The number of parts. A file without rows has one empty part.
    pub fn n_parts(&self) -> usize {
        self.names.len()
    }

    /// Starts the outputs in the folder `out`.
    ///
    /// # Errors
    /// When it contains other parts, or cannot be written.
    pub fn outputs(&self, out: &Path, rules: Rules) -> Result<OutputSet, Error> {
        refuse_others(out, &self.names)?;
        let part = (self.names[0].as_str(), atomic::Kind::Stage(self.kind));
        OutputSet::create(out, rules, self.access(), &[part, (MANIFEST, atomic::Kind::Manifest)])
    }

    /// Writes the parts and the manifest. A few thousand rows and the current row group are in
    /// memory.
    ///
    /// # Errors
    /// When reading or writing fails. No temporary file is left then.
    pub fn write(self, mut outputs: OutputSet) -> Result<(), Error> {
        let access = self.access();
        let Self { path, parts, kind, rows, names } = self;
        let meta_text = parts.meta_text().unwrap_or("{}").to_owned();
        let schema = parts.schema().clone();
        let fields: Vec<Field> =
            schema.fields().iter().map(|field| field.as_ref().clone()).collect();
        let roots: Vec<usize> = (0..fields.len()).collect();
        let mut batches = parts.batches(&roots, Stay::Rows)?;
        let mut written = Vec::with_capacity(names.len());
        for (at, name) in (0..).zip(names) {
            let staged = outputs.stage(&name, atomic::Kind::Stage(kind))?;
            let n_rows = rows.min(parts.n_rows() - at * rows);
            let mut left = n_rows;
            let properties = properties(meta_text.clone(), &fields, GROUP_ROWS);
            write_batches((&staged, access), schema.clone(), properties, || {
                let rows = if left > 0 { batches.next()? } else { None };
                Ok(rows.map(|rows| {
                    let all = rows.num_rows();
                    let n = usize::try_from(left).map_or(all, |left| left.min(all));
                    left -= n as u64;
                    batches.take(rows, n)
                }))
            })?;
            let found = fs::metadata(&staged).map_err(|source| Error::write(&staged, source))?;
            written.push(Part { file: name, n_rows, n_bytes: found.len() });
        }
        let staged = outputs.stage(MANIFEST, atomic::Kind::Manifest)?;
        let manifest = Manifest::new(Meta::parse(path, Some(&meta_text))?.into_object(), written);
        write_file(&staged, access, |to| manifest.write(to))?;
        outputs.commit()
    }

    fn access(&self) -> Access {
        match self.kind {
            Kind::Released => Access::Usual,
            _ => Access::Private,
        }
    }
}

fn refuse_others(out: &Path, names: &[String]) -> Result<(), Error> {
    if !out.is_dir() {
        return Ok(());
    }
    let found = names_in(out)?;
    let is_own = |name: &&PathBuf| names.binary_search_by(|own| Path::new(own).cmp(name)).is_ok();
    match found.iter().find(|name| !is_own(name)) {
        None => Ok(()),
        Some(other) => {
            let (expected, found) = ("a folder without other parts", other.display().to_string());
            Err(Error::new(out, "", expected, found))
        }
    }
}
