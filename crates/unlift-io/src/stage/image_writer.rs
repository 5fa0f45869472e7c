//! Writes many images to one stage file.

use super::header::{Kind, to_text};
use super::images::{IMAGE, IMAGE_META};
use super::write::{Written, properties, to_io, writer};
use super::{neighborhoods, recovered, released, truth};
use crate::Error;
use crate::atomic::OutputFile;
use arrow_array::{ArrayRef, RecordBatch, StringArray, new_null_array};
use arrow_schema::DataType::{Float32, UInt8, UInt32, Utf8};
use arrow_schema::{Field, Schema, SchemaRef};
use parquet::arrow::ArrowWriter;
use parquet::errors::ParquetError;
use serde_json::{Map, Value};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use unlift::neighbors::Neighborhoods;
use unlift::recover::Recovered;
use unlift::released::Released;
use unlift::truth::{Original, Secret};

/// Rows of a row group: up to about 8 MB of descriptors are in memory.
const GROUP_ROWS: usize = 1 << 16;

/// Metadata keys of the file. All others are stored per image.
const OF_ALL: [&str; 6] = ["kind", "version", "dimension", "unit", "family", "slots_per_record"];

/// A writer of a stage file of images, into an [`OutputFile`] that the caller commits.
///
/// Memory holds one row group. The same images in the same order give the same bytes. Images
/// without rows are not stored.
pub struct ImageWriter<'a> {
    path: PathBuf,
    kind: Kind,
    /// Until the first image defines the columns.
    file: Option<&'a mut BufWriter<File>>,
    started: Option<Started<'a>>,
}

struct Started<'a> {
    of_all: Map<String, Value>,
    schema: SchemaRef,
    writer: ArrowWriter<&'a mut BufWriter<File>>,
}

impl<'a> ImageWriter<'a> {
    /// Starts a file of images of `kind`.
    pub fn start(output: &'a mut OutputFile, kind: Kind) -> Self {
        let path = output.path().to_owned();
        Self { path, kind, file: Some(output.writer()), started: None }
    }

    /// Adds a released image.
    ///
    /// # Errors
    /// When its family or type of descriptors differs from the first image, or the disk fails.
    pub fn released(&mut self, name: &str, released: &Released<2>) -> Result<(), Error> {
        let written = released::written(&self.path, released)?;
        self.append(name, written)
    }

    /// Adds the ground truth of an image.
    ///
    /// # Errors
    /// When the secret does not belong to these points, or the disk fails.
    pub fn truth(
        &mut self,
        name: &str,
        original: &Original<2>,
        secret: &Secret,
    ) -> Result<(), Error> {
        let written = truth::written(&self.path, original, secret);
        let written = written.map_err(|error| error.within(&format!("image {name}")))?;
        self.append(name, written)
    }

    /// Adds the neighborhoods of an image.
    ///
    /// # Errors
    /// When the disk fails.
    pub fn neighborhoods(&mut self, name: &str, lists: &Neighborhoods) -> Result<(), Error> {
        self.append(name, neighborhoods::written(lists))
    }

    /// Adds the recovered points of an image.
    ///
    /// # Errors
    /// When an evidence or delta is not finite, or the disk fails.
    pub fn recovered(&mut self, name: &str, recovered: &Recovered<2>) -> Result<(), Error> {
        let written = recovered::written(&self.path, recovered);
        let written = written.map_err(|error| error.within(&format!("image {name}")))?;
        self.append(name, written)
    }

    /// Completes the file. The caller must then commit its [`OutputFile`].
    ///
    /// # Errors
    /// When no image had rows, or the disk fails.
    pub fn finish(self) -> Result<(), Error> {
        let Some(started) = self.started else {
            return Err(Error::new(self.path, "", "an image with points", "none"));
        };
        let closed = started.writer.close();
        closed.map(drop).map_err(|error| failed(&self.path, error))
    }

    fn append(&mut self, name: &str, written: Written<'_>) -> Result<(), Error> {
        let n_rows = written.n_rows;
        if n_rows == 0 {
            return Ok(());
        }
        let (of_all, own): (Map<_, _>, Map<_, _>) =
            written.meta.clone().into_iter().partition(|(key, _)| OF_ALL.contains(&key.as_str()));
        if let Some(file) = self.file.take() {
            let started = Started::with(file, &self.path, self.kind, &of_all, written.fields())?;
            self.started = Some(started);
        }
        let Some(started) = &mut self.started else { unreachable!("started by the first image") };
        let names = written.fields().iter().map(|field| field.name().clone());
        let mut named: Vec<(String, ArrayRef)> = names.zip(written.rows(&(0..n_rows))).collect();
        let texts = |text: &str| {
            Arc::new(StringArray::from_iter_values(std::iter::repeat_n(text, n_rows))) as ArrayRef
        };
        named.push((IMAGE.to_owned(), texts(name)));
        named.push((IMAGE_META.to_owned(), texts(&to_text(own))));
        let mut in_order: Vec<ArrayRef> = Vec::new();
        for field in started.schema.fields() {
            let at = named.iter().position(|(name, _)| name == field.name());
            let column = at.map(|at| named.swap_remove(at).1);
            in_order.push(column.unwrap_or_else(|| new_null_array(field.data_type(), n_rows)));
        }
        match RecordBatch::try_new(started.schema.clone(), in_order) {
            Ok(batch) if started.of_all == of_all && named.is_empty() => {
                started.writer.write(&batch).map_err(|error| failed(&self.path, error))
            }
            _ => {
                let expected = "the family and type of descriptors of the first image";
                Err(Error::new(&self.path, format!("image {name}"), expected, "others"))
            }
        }
    }
}

impl<'a> Started<'a> {
    /// Starts a file with the columns of the first image, and the columns that only some images
    /// have.
    fn with(
        file: &'a mut BufWriter<File>,
        path: &Path,
        kind: Kind,
        of_all: &Map<String, Value>,
        fields: &[Field],
    ) -> Result<Self, Error> {
        let mut all = vec![Field::new(IMAGE, Utf8, false), Field::new(IMAGE_META, Utf8, false)];
        all.extend(fields.iter().map(|field| field.clone().with_nullable(true)));
        let scores = || Field::new_list("scores", Field::new("element", Float32, false), true);
        let sometimes = match kind {
            Kind::Neighborhoods => vec![scores()],
            Kind::Recovered => vec![
                Field::new("found", Float32, true),
                Field::new("error_scale", Float32, true),
                Field::new("axis", UInt8, true),
                Field::new("descriptor_row", UInt32, true),
            ],
            Kind::Truth => vec![Field::new("swapped_axis", UInt8, true)],
            Kind::Released | Kind::PointNeighborhoods => Vec::new(),
        };
        for field in sometimes {
            if !all.iter().any(|other| other.name() == field.name()) {
                all.push(field);
            }
        }
        let properties = properties(to_text(of_all.clone()), &all, GROUP_ROWS);
        let schema = Arc::new(Schema::new(all));
        let writer = writer(file, schema.clone(), properties);
        let writer = writer.map_err(|error| failed(path, error))?;
        Ok(Self { of_all: of_all.clone(), schema, writer })
    }
}

fn failed(path: &Path, error: ParquetError) -> Error {
    Error::write(path, to_io(error))
}
