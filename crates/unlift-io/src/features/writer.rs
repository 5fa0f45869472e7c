//! Writes features in hloc's layout.

use std::io::{self, Cursor, Seek, Write};
use std::path::Path;

use half::f16;
use unlift::descriptors::Values;

use super::h5::{Array, DEEPEST, Numbers, Writer, transposed};
use super::image::ImageFeatures;
use crate::atomic::{Access, OutputFile};
use crate::error::Error;
use crate::read::lines::quoted;

/// 1 if keypoints are in pixels of upright photos, else 0.
pub(super) const UPRIGHT: &str = "upright";

/// A feature file in hloc's layout that is written image by image, and moved to its place when it
/// is complete.
///
/// Each image is a group with `keypoints` `(N, 2)` and, if present, `descriptors` `(D, N)`,
/// `scores`, `scales` and `oris` `(N,)` and `image_size` `(2,)`; see `docs/formats.md`. Only names
/// stay in memory. The same images in the same order give the same bytes.
pub struct FeatureWriter {
    output: OutputFile,
    writer: Writer,
}

impl FeatureWriter {
    /// Starts the feature file `path`.
    ///
    /// # Errors
    /// When no file can be written there.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let mut output = OutputFile::create(path, Access::Usual)?;
        let writer = Writer::start(output.writer()).map_err(|e| Error::write(path, e))?;
        Ok(Self { output, writer })
    }

    /// Checks that an image can be written.
    ///
    /// # Errors
    /// When a part of the name is empty, `.` or `..`, the name exists or is inside another image,
    /// or a column has not one row per keypoint.
    pub fn check(&self, image: &ImageFeatures) -> Result<(), Error> {
        check(&self.writer, image, self.output.path())
    }

    /// Writes one image.
    ///
    /// # Errors
    /// When [`check`](Self::check) fails, or the disk fails.
    pub fn append(&mut self, image: &ImageFeatures) -> Result<(), Error> {
        let path = self.output.path().to_owned();
        self.check(image)?;
        write(&mut self.writer, self.output.writer(), image).map_err(|e| Error::write(&path, e))
    }

    /// Moves the file to its place.
    ///
    /// # Errors
    /// When the disk fails. No temporary file is left then.
    pub fn finish(mut self) -> Result<(), Error> {
        let path = self.output.path().to_owned();
        let finished = self.writer.finish(self.output.writer());
        finished.map_err(|e| Error::write(path, e))?;
        self.output.commit()
    }
}

/// Returns the bytes of a file with one image.
///
/// # Errors
/// When [`FeatureWriter::append`] would fail. Errors name `path`.
pub fn encode(image: &ImageFeatures, path: &Path) -> Result<Vec<u8>, Error> {
    let failed = |e| Error::write(path, e);
    let mut out = Cursor::new(Vec::new());
    let mut writer = Writer::start(&mut out).map_err(failed)?;
    check(&writer, image, path)?;
    write(&mut writer, &mut out, image).map_err(failed)?;
    writer.finish(&mut out).map_err(failed)?;
    Ok(out.into_inner())
}

fn check(writer: &Writer, image: &ImageFeatures, path: &Path) -> Result<(), Error> {
    let place = || format!("image {}", quoted(image.name.as_bytes()));
    let parts = || image.name.split('/');
    if parts().any(|part| part.is_empty() || part == "." || part == ".." || part.contains('\0')) {
        let expected = "a name whose parts are not empty, . or ..";
        return Err(Error::new(path, place(), expected, quoted(image.name.as_bytes())));
    }
    let deep = parts().count();
    if deep > DEEPEST {
        let expected = format!("a name of at most {DEEPEST} parts");
        return Err(Error::new(path, place(), expected, deep.to_string()));
    }
    if !writer.is_free(&image.name) {
        let found = "one that exists already or is inside another image";
        return Err(Error::new(path, place(), "a new name", found));
    }
    let n = image.keypoints.len();
    let columns = [
        ("descriptors", image.descriptors.as_ref().map(|rows| rows.len())),
        ("scores", image.scores.as_ref().map(Vec::len)),
        ("scales", image.scales.as_ref().map(Vec::len)),
        ("oris", image.orientations_deg.as_ref().map(Vec::len)),
    ];
    for (name, len) in columns {
        if let Some(len) = len.filter(|&len| len != n) {
            let place = format!("{}, {name}", place());
            return Err(Error::new(path, place, format!("{n}, one per keypoint"), len.to_string()));
        }
    }
    Ok(())
}

fn write(
    writer: &mut Writer,
    out: &mut (impl Write + Seek),
    image: &ImageFeatures,
) -> io::Result<()> {
    let n = image.keypoints.len() as u64;
    let mut put = |name: &str, shape: Vec<u64>, values: Numbers, attributes: &[(&str, f64)]| {
        writer.array(out, &image.name, name, &Array { shape, values }, attributes)
    };
    let places = image.keypoints.iter().flatten().map(|&value| value as f32).collect();
    let mut attributes = vec![(UPRIGHT, f64::from(image.upright))];
    attributes.extend(image.uncertainty_px.map(|value| ("uncertainty", value)));
    put("keypoints", vec![n, 2], Numbers::F32(places), &attributes)?;
    if let Some(rows) = &image.descriptors {
        let (dim, n_rows) = (rows.dim(), rows.len());
        let values = match rows.values() {
            Values::U8(values) => Numbers::U8(transposed(values, n_rows)),
            Values::F32(values) => match halves(values) {
                Some(halves) => Numbers::F16(transposed(&halves, n_rows)),
                None => Numbers::F32(transposed(values, n_rows)),
            },
        };
        put("descriptors", vec![dim as u64, n], values, &[])?;
    }
    let per_keypoint =
        [("scores", &image.scores), ("scales", &image.scales), ("oris", &image.orientations_deg)];
    for (name, values) in per_keypoint {
        if let Some(values) = values {
            put(name, vec![n], Numbers::F32(values.clone()), &[])?;
        }
    }
    if let Some(size) = image.size {
        put("image_size", vec![2], Numbers::I64(size.map(i64::from).to_vec()), &[])?;
    }
    Ok(())
}

/// Converts `values` to half floats, as hloc stores descriptors of networks, if all are exact.
fn halves(values: &[f32]) -> Option<Vec<f16>> {
    let exact = |&value: &f32| Some(f16::from_f32(value)).filter(|half| half.to_f32() == value);
    values.iter().map(exact).collect()
}
