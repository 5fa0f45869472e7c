//! Reads many images from one stage file.

use super::header::{Kind, Meta};
use super::neighborhoods::neighborhoods_of;
use super::pages::Stay;
use super::parts::{Batches, Parts};
use super::recovered::recovered_of;
use super::released::released_of;
use super::table::Table;
use super::truth::truth_of;
use crate::Error;
use arrow_array::cast::AsArray;
use arrow_array::{Array, RecordBatch};
use std::collections::HashSet;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::path::Path;
use unlift::neighbors::Neighborhoods;
use unlift::recover::Recovered;
use unlift::released::Released;
use unlift::truth::{Original, Secret};

/// The column with the image of a row.
pub(super) const IMAGE: &str = "image";
/// The column with the metadata of an image, equal in all of its rows.
pub(super) const IMAGE_META: &str = "image_meta";

/// All columns that a stage file of images may have. Others are not decoded.
const COLUMNS: &str = "image image_meta foot_x foot_y direction_x direction_y center axis offset x y descriptor \
                       descriptor_0 descriptor_1 slot original swapped_axis descriptor_row dropped records scores \
                       status support evidence found error_scale point neighbors";

/// Returns true if the stage file `path` contains images: it has a column `image`.
///
/// # Errors
/// When it is not a Parquet file.
pub fn has_images(path: &Path) -> Result<bool, Error> {
    Ok(Table::open(path)?.has(IMAGE))
}

/// A reader of a stage file of images, whose rows are contiguous. One image and a few thousand rows
/// are in memory.
pub struct ImageFile<'a> {
    path: &'a Path,
    whole: Table<'a>,
    kind: Kind,
    batches: Batches,
    n_taken: u64,
    /// Hashes of the names so far, to detect rows that are not contiguous.
    seen: HashSet<u64>,
}

/// The rows of one image.
pub struct ImageRows<'a> {
    name: String,
    path: &'a Path,
    meta: Meta<'a>,
    held: Vec<RecordBatch>,
}

impl<'a> ImageFile<'a> {
    /// Opens `path`, a file of images of `kind`.
    ///
    /// # Errors
    /// When it is not a stage file of this kind, or has no column `image`.
    pub fn open(path: &'a Path, kind: Kind) -> Result<Self, Error> {
        let whole = Table::open_kind(path, kind)?;
        if !whole.has(IMAGE) {
            return Err(Error::new(path, format!("column {IMAGE}"), "text", "no such column"));
        }
        let parts = Parts::open(path)?;
        let fields = parts.schema().fields().iter().enumerate();
        let is_known = |name: &str| COLUMNS.split(' ').any(|known| known == name);
        let known = fields.filter(|(_, field)| is_known(field.name()));
        let roots: Vec<usize> = known.map(|(at, _)| at).collect();
        let batches = parts.batches(&roots, Stay::Whole)?;
        Ok(Self { path, whole, kind, batches, n_taken: 0, seen: HashSet::new() })
    }

    /// Reads the next image. Returns `None` at the end.
    ///
    /// # Errors
    /// When the file is damaged, a row names no image, or the rows of an image are not contiguous.
    pub fn next_image(&mut self) -> Result<Option<ImageRows<'a>>, Error> {
        let Some(first) = self.rows()? else { return Ok(None) };
        let name = self.name(&first, 0)?;
        let mut hasher = DefaultHasher::new();
        name.hash(&mut hasher);
        if !self.seen.insert(hasher.finish()) {
            let found = format!("{name} again");
            return Err(self.wrong("contiguous rows of each image", found));
        }
        let meta_text = self.meta_text(&first)?;
        let meta = self.whole.meta().of_image(meta_text.as_deref());
        let meta = meta.map_err(|error| error.within(&place(&name)))?;
        let mut held = Vec::new();
        let mut next = Some(first);
        while let Some(rows) = next.take() {
            let n = self.n_of(&rows, &name)?;
            let is_whole = n == rows.num_rows();
            self.n_taken += n as u64;
            let rows = self.batches.take(rows, n);
            if n > 0 {
                held.push(rows);
            }
            if is_whole {
                next = self.rows()?;
            }
        }
        Ok(Some(ImageRows { name, path: self.path, meta, held }))
    }

    /// Reads the next image, which must be `name` as in the file `of`.
    ///
    /// # Errors
    /// When [`next_image`](Self::next_image) fails, or the image is another one.
    pub fn expect(&mut self, name: &str, of: &Path) -> Result<ImageRows<'a>, Error> {
        match self.next_image()? {
            Some(rows) if rows.name == name => Ok(rows),
            other => {
                let expected = format!("image {name}, as in {}", of.display());
                let found = other.map_or("no more images".to_owned(), |rows| rows.name);
                Err(Error::new(self.path, "", expected, found))
            }
        }
    }

    /// Checks that no image follows, as in the file `of`.
    ///
    /// # Errors
    /// When one follows.
    pub fn expect_end(&mut self, of: &Path) -> Result<(), Error> {
        match self.next_image()? {
            None => Ok(()),
            Some(rows) => {
                let expected = format!("no more images, as in {}", of.display());
                Err(Error::new(self.path, "", expected, format!("image {}", rows.name)))
            }
        }
    }

    /// The kind of the file.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    fn rows(&mut self) -> Result<Option<RecordBatch>, Error> {
        loop {
            match self.batches.next()? {
                Some(batch) if batch.num_rows() == 0 => {}
                other => return Ok(other),
            }
        }
    }

    fn texts<'b>(&self, rows: &'b RecordBatch, name: &str) -> Result<Texts<'b>, Error> {
        let Some(column) = rows.column_by_name(name) else { return Ok(None) };
        if column.data_type().is_null() {
            return Ok(None);
        }
        let found = || format!("type {}", column.data_type());
        let texts = column.as_string_opt::<i32>();
        let wrong = || Error::new(self.path, format!("column {name}"), "text", found());
        texts.map(Some).ok_or_else(wrong)
    }

    fn name(&self, rows: &RecordBatch, row: usize) -> Result<String, Error> {
        let names = self.texts(rows, IMAGE)?.filter(|names| names.is_valid(row));
        let name = names.map(|names| names.value(row).to_owned());
        name.ok_or_else(|| self.wrong("the name of an image", "null".to_owned()))
    }

    fn meta_text(&self, rows: &RecordBatch) -> Result<Option<String>, Error> {
        let texts = self.texts(rows, IMAGE_META)?.filter(|texts| texts.is_valid(0));
        Ok(texts.map(|texts| texts.value(0).to_owned()))
    }

    fn n_of(&self, rows: &RecordBatch, name: &str) -> Result<usize, Error> {
        let names = self.texts(rows, IMAGE)?;
        let is_other = |row: &usize| {
            names.is_none_or(|names| names.is_null(*row) || names.value(*row) != name)
        };
        Ok((0..rows.num_rows()).find(is_other).unwrap_or(rows.num_rows()))
    }

    fn wrong(&self, expected: &str, found: String) -> Error {
        Error::new(self.path, format!("column {IMAGE}, row {}", self.n_taken), expected, found)
    }
}

type Texts<'b> = Option<&'b arrow_array::StringArray>;

fn place(name: &str) -> String {
    format!("image {name}")
}

impl ImageRows<'_> {
    /// The name of the image.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the released image.
    ///
    /// # Errors
    /// When `read_released` would fail. Errors name the image; rows are counted within it.
    pub fn released(self) -> Result<Released<2>, Error> {
        self.read(released_of)
    }

    /// Returns the ground truth of the image.
    ///
    /// # Errors
    /// When `read_truth` would fail.
    pub fn truth(self) -> Result<(Original<2>, Secret), Error> {
        self.read(truth_of)
    }

    /// Returns the neighborhoods of an image of `n_records` records with `slots_per_record` slots
    /// each.
    ///
    /// # Errors
    /// When `read_neighborhoods` would fail.
    pub fn neighborhoods(
        self,
        n_records: usize,
        slots_per_record: usize,
    ) -> Result<Neighborhoods, Error> {
        self.read(|table| neighborhoods_of(table, n_records, slots_per_record))
    }

    /// Returns the recovered points of the image.
    ///
    /// # Errors
    /// When `read_recovered` would fail.
    pub fn recovered(self) -> Result<Recovered<2>, Error> {
        self.read(|table| recovered_of(table, None))
    }

    fn read<T>(self, read: impl FnOnce(&Table<'_>) -> Result<T, Error>) -> Result<T, Error> {
        let table = Table::held(self.path, self.meta, self.held);
        read(&table).map_err(|error| error.within(&place(&self.name)))
    }
}
