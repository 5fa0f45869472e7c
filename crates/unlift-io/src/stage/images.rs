//! Stage files of many images: the arrays of an image are below its name, `a.jpg/foot`.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::vec::IntoIter;

use serde_json::{Map, Value};
use unlift::neighbors::Neighborhoods;
use unlift::recover::Recovered;
use unlift::released::Released;
use unlift::truth::{Original, Secret};

use super::arrays::Arrays;
use super::kind::Kind;
use super::lists::neighborhoods_of;
use super::meta::{KEY, to_text};
use super::recovered::recovered_of;
use super::released::released_of;
use super::truth::truth_of;
use super::write::{Written, Zip};
use super::{lists, recovered, released, truth};
use crate::Error;
use crate::atomic::OutputFile;

/// A reader of a stage file of images. The arrays of an image are unpacked when it is read.
pub struct ImageFile<'a> {
    file: Arrays<'a>,
    /// The next images, with the index and name of each array.
    waiting: IntoIter<(String, Vec<(usize, String)>)>,
}

/// The arrays of one image. Readers fail as those of maps do, with the name of the image; rows are counted within it.
pub struct ImageRows<'a> {
    name: String,
    arrays: Arrays<'a>,
}

impl<'a> ImageFile<'a> {
    /// Opens `path`, a file of images of `kind`.
    ///
    /// # Errors
    /// When it is not a stage file of this kind, has no images, or the arrays of an image do not follow one another.
    pub fn open(path: &'a Path, kind: Kind) -> Result<Self, Error> {
        let file = Arrays::open(path)?;
        if let Some(other) = file.meta.kind()?.filter(|its| *its != kind) {
            return Err(Error::new(path, "", kind, other));
        }
        let mut images: Vec<(String, Vec<(usize, String)>)> = Vec::new();
        let mut names = HashSet::new();
        for (at, name) in &file.arrays {
            let Some((image, array)) = name.rsplit_once('/') else {
                if name == KEY {
                    continue;
                }
                let expected = "arrays below the names of images, as a.jpg/foot";
                return Err(Error::new(path, "", expected, format!("array {name}")));
            };
            let array = (*at, array.to_owned());
            match images.last_mut() {
                Some((last, arrays)) if last == image => arrays.push(array),
                _ if names.insert(image) => images.push((image.to_owned(), vec![array])),
                _ => {
                    let found = format!("image {image} again");
                    return Err(Error::new(path, "", "the arrays of each image together", found));
                }
            }
        }
        if images.is_empty() {
            return Err(Error::new(path, "", "arrays of images, as a.jpg/foot", "none"));
        }
        Ok(Self { file, waiting: images.into_iter() })
    }

    /// Opens the next image. Returns `None` at the end.
    ///
    /// # Errors
    /// When its metadata is wrong.
    pub fn next_image(&mut self) -> Result<Option<ImageRows<'a>>, Error> {
        let Some((name, arrays)) = self.waiting.next() else { return Ok(None) };
        let arrays = self.file.of_image(arrays).map_err(|error| error.within(&place(&name)))?;
        Ok(Some(ImageRows { name, arrays }))
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
                Err(Error::new(self.file.path, "", expected, found))
            }
        }
    }

    /// Checks that no image follows, as in the file `of`.
    pub fn expect_end(&mut self, of: &Path) -> Result<(), Error> {
        match self.waiting.as_slice().first() {
            None => Ok(()),
            Some((name, _)) => {
                let expected = format!("no more images, as in {}", of.display());
                Err(Error::new(self.file.path, "", expected, format!("image {name}")))
            }
        }
    }
}

fn place(name: &str) -> String {
    format!("image {name}")
}

impl ImageRows<'_> {
    /// The name of the image.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the released image.
    pub fn released(self) -> Result<Released<2>, Error> {
        self.read(released_of)
    }

    /// Returns the ground truth of the image.
    pub fn truth(self) -> Result<(Original<2>, Secret), Error> {
        self.read(truth_of)
    }

    /// Returns the neighborhoods of an image of `n_records` records with `slots_per_record` slots each.
    pub fn neighborhoods(
        self,
        n_records: usize,
        slots_per_record: usize,
    ) -> Result<Neighborhoods, Error> {
        self.read(|arrays| neighborhoods_of(arrays, n_records, slots_per_record))
    }

    /// Returns the recovered points of the image.
    pub fn recovered(self) -> Result<Recovered<2>, Error> {
        self.read(|arrays| recovered_of(arrays, None))
    }

    fn read<T>(self, read: impl FnOnce(&Arrays<'_>) -> Result<T, Error>) -> Result<T, Error> {
        read(&self.arrays).map_err(|error| error.within(&place(&self.name)))
    }
}

/// Metadata keys of the file. All others are stored per image.
const OF_ALL: [&str; 5] = ["kind", "version", "unit", "family", "slots_per_record"];

/// A writer of a stage file of images, into an [`OutputFile`] that the caller commits.
///
/// Nothing is kept in memory but names. The same images in the same order give the same bytes. Images without rows are not stored.
pub struct ImageWriter<'a> {
    path: PathBuf,
    zip: Zip<'a>,
    /// The metadata of the file, which the first image decides.
    of_all: Option<Map<String, Value>>,
}

impl<'a> ImageWriter<'a> {
    /// Starts a file of images.
    pub fn start(output: &'a mut OutputFile) -> Self {
        let path = output.path.clone();
        Self { path, zip: Zip::new(&mut output.writer), of_all: None }
    }

    /// Adds a released image.
    ///
    /// # Errors
    /// When its family differs from the first image.
    pub fn released(&mut self, name: &str, released: &Released<2>) -> Result<(), Error> {
        self.append(name, Ok(released::written(released)))
    }

    /// Adds the ground truth of an image.
    ///
    /// # Errors
    /// When the secret does not belong to these points.
    pub fn truth(
        &mut self,
        name: &str,
        original: &Original<2>,
        secret: &Secret,
    ) -> Result<(), Error> {
        self.append(name, truth::written(&self.path, original, secret))
    }

    /// Adds the neighborhoods of an image.
    pub fn neighborhoods(&mut self, name: &str, lists: &Neighborhoods) -> Result<(), Error> {
        self.append(name, Ok(lists::written(lists)))
    }

    /// Adds the recovered points of an image.
    ///
    /// # Errors
    /// When an evidence or delta is not finite.
    pub fn recovered(&mut self, name: &str, recovered: &Recovered<2>) -> Result<(), Error> {
        self.append(name, recovered::written(&self.path, recovered))
    }

    /// Completes the file. The caller must then commit its [`OutputFile`].
    ///
    /// # Errors
    /// When no image had rows.
    pub fn finish(self) -> Result<(), Error> {
        if self.of_all.is_none() {
            return Err(Error::new(self.path, "", "an image with points", "none"));
        }
        self.zip.finish().map_err(|source| Error::write(&self.path, source))
    }

    fn append(&mut self, name: &str, written: Result<Written<'_>, Error>) -> Result<(), Error> {
        let written = written.map_err(|error| error.within(&place(name)))?;
        if written.n_rows == 0 {
            return Ok(());
        }
        let failed = |source| Error::write(&self.path, source);
        let (of_all, own): (Map<_, _>, Map<_, _>) =
            written.meta.clone().into_iter().partition(|(key, _)| OF_ALL.contains(&key.as_str()));
        if self.of_all.is_none() {
            self.zip.text(KEY, &to_text(&of_all)).map_err(failed)?;
            self.of_all = Some(of_all);
        } else if self.of_all.as_ref() != Some(&of_all) {
            let expected = "the family and unit of the first image";
            return Err(Error::new(&self.path, place(name), expected, to_text(&of_all)));
        }
        if !own.is_empty() {
            self.zip.text(&format!("{name}/{KEY}"), &to_text(&own)).map_err(failed)?;
        }
        self.zip.arrays(&format!("{name}/"), written).map_err(failed)
    }
}
