//! Reads and writes features in hloc's layout: an HDF5 group per image, an array per kind of feature.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};

use half::f16;
use hdf5_pure::{
    AttrValue, Dataset, Datatype, DatatypeByteOrder, File, FileAccessProperties,
    FileCreateProperties, FileLocking, FixedPointLayout, FloatingPointLayout, Group,
    MemoryStrategy, MetadataCacheConfig, ReadSeekSource, SyncPolicy,
};
use unlift::Descriptors;
use unlift::descriptors::Values;

use super::ImageFeatures;
use super::links::{MAX_DEPTH, Target, links};
use crate::atomic::{Access, OutputFile};
use crate::error::Error;
use crate::input::{self, Budget};
use crate::read::lines::quoted;
use crate::read::npy::tuple;
use unlift::guard::caught;

type Groups = Vec<(String, Group)>;

/// Bytes of headers that are kept, because a header is read in a dozen pieces.
const CACHE: usize = 1 << 20;
const GROUPS: &str = "a group per image with keypoints and descriptors";
const KEYPOINTS: &str = "keypoints";
/// An attribute of `keypoints`: 1 if they are in pixels of upright photos, else 0.
const UPRIGHT: &str = "upright";
const UNCERTAINTY: &str = "uncertainty";

/// An open HDF5 file of features, which is read one array at a time.
pub(super) struct Hloc {
    path: PathBuf,
    budget: Budget,
    /// Paths and open handles of groups with arrays, by path: a search by path reads all names above.
    groups: Groups,
    /// Errors about links that lead to no group.
    pub broken: Vec<Error>,
}

impl Hloc {
    /// Opens `path` and finds its groups.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let (head, len) = input::head(path, 12)?;
        // Superblocks of version 3 say whether a writer has the file open.
        if head.len() == 12 && head.starts_with(b"\x89HDF") && head[8] == 3 && head[11] & 1 == 1 {
            let found = "one that its writer did not close (h5clear -s FILE)";
            return Err(Error::new(path, "", "a whole HDF5 file", found));
        }
        let budget = Budget::new(path, len);
        let mut all = Self { path: path.to_owned(), budget, groups: vec![], broken: vec![] };
        (all.groups, all.broken) = all.step("", || all.list(len))?;
        all.groups.sort_unstable_by(|(a, _), (b, _)| a.cmp(b));
        let Some((first, _)) = all.groups.first() else { return Ok(all) };
        let first = all.arrays(0).map_err(|error| error.within(&place(first)))?;
        let has = |name: &str| first.iter().any(|array| array == name);
        let found = match () {
            () if has(KEYPOINTS) => return Ok(all),
            () if has("matches0") || has("matches") => "matches of pairs of images",
            () if has("global_descriptor") => "global descriptors of whole images",
            () => return Ok(all),
        };
        Err(Error::new(path, "", GROUPS, found))
    }

    /// Lists all groups of the file of `len` bytes that contain arrays directly, and errors about broken links.
    fn list(&self, len: u64) -> Result<(Groups, Vec<Error>), Error> {
        let wrong =
            |error: hdf5_pure::Error| Error::new(&self.path, "", "a whole HDF5 file", error);
        let wrong_image = |name: &str, found: String| {
            Error::new(&self.path, place(name), "features of an image", found)
        };
        let source = ReadSeekSource::new(input::open(&self.path)?.0);
        let cached =
            FileAccessProperties::new().with_metadata_cache(MetadataCacheConfig::new(CACHE));
        let file = File::from_source_with_options(source.map_err(|e| wrong(e.into()))?, cached);
        let file = file.map_err(wrong)?;
        let whole = file.superblock().eof_address;
        if whole > len {
            let expected = format!("a whole HDF5 file of {whole} bytes");
            return Err(Error::new(&self.path, "", expected, format!("{len} bytes")));
        }
        let (mut groups, mut broken) = (Vec::new(), Vec::new());
        let raw = ReadSeekSource::new(input::open(&self.path)?.0)
            .map_err(|error| self.unreadable("", error.into()))?;
        let root = Some(file.superblock().root_group_address);
        let mut waiting = vec![(String::new(), file.root(), root, 0)];
        while let Some((path, group, address, depth)) = waiting.pop() {
            if depth > MAX_DEPTH {
                let place = format!("group {}", quoted(path.as_bytes()));
                let expected = format!("groups nested at most {MAX_DEPTH} deep");
                return Err(Error::new(&self.path, place, expected, "deeper ones, or a cycle"));
            }
            let refuse = |error| self.unreadable(&place(&path), error);
            let within = |name: &str| match &*path {
                "" => name.to_owned(),
                path => format!("{path}/{name}"),
            };
            let links = address.and_then(|at| links(&raw, at)).unwrap_or_default();
            for (name, target) in &links {
                if let Target::Unlistable(to) = target {
                    let to = quoted(to.as_bytes());
                    let way_out = "in the old form (write it with libver=\"latest\" of h5py)";
                    return Err(wrong_image(&within(name), format!("a link to {to} {way_out}")));
                }
            }
            let arrays = group.datasets().map_err(refuse)?;
            for (name, inside) in group.iter_groups().map_err(refuse)? {
                let hard = links.iter().find_map(|(link, target)| match target {
                    Target::Object(address) if *link == name => Some(*address),
                    _ => None,
                });
                waiting.push((within(&name), inside, hard, depth + 1));
            }
            // The library skips links by path.
            for (name, target) in &links {
                let (target, text) = match target {
                    Target::Object(_) | Target::Unlistable(_) => continue,
                    Target::Path(to) => {
                        let from = if to.starts_with('/') { &file.root() } else { &group };
                        (from.group(to).ok(), format!("a link to {}", quoted(to.as_bytes())))
                    }
                    Target::Elsewhere => (None, "a link to another file".to_owned()),
                };
                match target {
                    Some(target) => waiting.push((within(name), target, None, depth + 1)),
                    None => broken.push(wrong_image(&within(name), text)),
                }
            }
            if arrays.is_empty() {
                continue;
            }
            if !path.is_empty() {
                groups.push((path, group));
            } else if waiting.is_empty() {
                return Err(Error::new(&self.path, "", GROUPS, "arrays outside any group"));
            }
        }
        Ok((groups, broken))
    }

    /// Runs `step` and turns a panic of the library into an error.
    fn step<T>(&self, place: &str, step: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        let damaged = || Err(Error::new(&self.path, place, "readable HDF5", "damaged data"));
        caught(step).ok().unwrap_or_else(damaged)
    }

    fn unreadable(&self, place: &str, error: hdf5_pure::Error) -> Error {
        Error::new(&self.path, place, "readable HDF5", error)
    }

    /// The names of the images, sorted by bytes.
    pub fn names(&self) -> Vec<String> {
        self.groups.iter().map(|(name, _)| name.clone()).collect()
    }

    pub fn is_upright(&self) -> bool {
        !self.groups.is_empty() && self.attribute(0, UPRIGHT).is_ok_and(|value| value == Some(1.0))
    }

    /// Reads image `at` of [`names`](Self::names).
    pub fn get(&self, at: usize) -> Result<ImageFeatures, Error> {
        self.image(at).map_err(|error| error.within(&place(&self.groups[at].0)))
    }

    // The errors of the following name the array only.

    fn image(&self, at: usize) -> Result<ImageFeatures, Error> {
        let present = self.arrays(at)?;
        let has = |array: &str| present.iter().any(|name| name == array);
        let optional = |array: &'static str| has(array).then(|| self.array(at, array)).transpose();
        let Some(places) = optional(KEYPOINTS)? else {
            let found = format!("only {}", present.join(", "));
            return Err(Error::new(&self.path, "", "an array keypoints", found));
        };
        let keypoints = keypoints(&places)?;
        let n = keypoints.len();
        let per_keypoint = |array: &'static str| -> Result<Option<Vec<f32>>, Error> {
            let Some(array) = optional(array)? else { return Ok(None) };
            if array.shape != [n as u64] && array.shape != [n as u64, 1] {
                let expected = format!("one value per keypoint, ({n},)");
                return Err(array.wrong(expected, tuple(&array.shape)));
            }
            Ok(Some(array.values.into_iter().map(|value| value as f32).collect()))
        };
        let descriptors = optional("descriptors")?.map(|array| descriptors(&array, n));
        let size = optional("image_size")?.map(|array| size(&array));
        Ok(ImageFeatures {
            name: self.groups[at].0.clone(),
            size: size.transpose()?,
            descriptors: descriptors.transpose()?,
            scores: per_keypoint("scores")?,
            scales: per_keypoint("scales")?,
            orientations_deg: per_keypoint("oris")?,
            uncertainty_px: self.attribute(at, UNCERTAINTY)?,
            upright: self.attribute(at, UPRIGHT)? == Some(1.0),
            keypoints,
            photo: None,
        })
    }

    /// Returns the sorted names of the arrays of image `at`.
    fn arrays(&self, at: usize) -> Result<Vec<String>, Error> {
        let names = || self.groups[at].1.datasets().map_err(|error| self.unreadable("", error));
        let mut names = self.step("", names)?;
        names.sort_unstable();
        Ok(names)
    }

    fn array(&self, at: usize, name: &'static str) -> Result<Array<'_>, Error> {
        self.step(name, || {
            let refuse = |error| self.unreadable(name, error);
            let dataset = self.groups[at].1.dataset(name).map_err(refuse)?;
            let shape = dataset.shape().map_err(refuse)?;
            let count = shape.iter().fold(1u64, |n, &side| n.saturating_mul(side));
            // A header can declare any size. Values are widened to eight bytes at most.
            self.budget.admit(name, count.saturating_mul(8))?;
            let datatype = dataset.datatype().map_err(refuse)?;
            let Some(values) = numbers(&dataset, &datatype, count).map_err(refuse)? else {
                let expected = "floats of 16, 32 or 64 bits, or integers";
                return Err(Error::new(&self.path, name, expected, "another type"));
            };
            Ok(Array { path: &self.path, name, shape, datatype, values })
        })
    }

    fn attribute(&self, at: usize, key: &str) -> Result<Option<f64>, Error> {
        self.step(KEYPOINTS, || {
            let dataset = self.groups[at].1.dataset(KEYPOINTS);
            let attributes = dataset.and_then(|dataset| dataset.attrs());
            let attributes = attributes.map_err(|error| self.unreadable(KEYPOINTS, error))?;
            Ok(attributes.get(key).and_then(AttrValue::as_f64))
        })
    }
}

/// The place of an error about an image, or about the file if the name is empty.
fn place(image: &str) -> String {
    if image.is_empty() { String::new() } else { format!("image {}", quoted(image.as_bytes())) }
}

struct Array<'a> {
    path: &'a Path,
    name: &'static str,
    shape: Vec<u64>,
    datatype: Datatype,
    values: Vec<f64>,
}

impl Array<'_> {
    fn wrong(&self, expected: impl Display, found: impl Display) -> Error {
        Error::new(self.path, self.name, expected, found)
    }
}

/// The IEEE float of 16 bits, which hloc stores.
const HALF: FloatingPointLayout = FloatingPointLayout {
    bit_offset: 0,
    bit_precision: 16,
    exponent_location: 10,
    exponent_size: 5,
    mantissa_location: 0,
    mantissa_size: 10,
    exponent_bias: 15,
};

/// Reads `count` floats of 16, 32 or 64 bits, or integers. Returns `None` for other types.
fn numbers(
    dataset: &Dataset,
    datatype: &Datatype,
    count: u64,
) -> Result<Option<Vec<f64>>, hdf5_pure::Error> {
    use Datatype::{FixedPoint, FloatingPoint};
    use DatatypeByteOrder::{BigEndian, LittleEndian};
    let half = match datatype {
        _ if count == 0 => return Ok(Some(Vec::new())),
        FixedPoint { size: 1 | 2 | 4 | 8, .. } | FloatingPoint { size: 4 | 8, .. } => {
            return dataset.read_f64().map(Some);
        }
        FloatingPoint { size: 2, byte_order: LittleEndian, layout: HALF } => f16::from_le_bytes,
        FloatingPoint { size: 2, byte_order: BigEndian, layout: HALF } => f16::from_be_bytes,
        _ => return Ok(None),
    };
    let bytes = dataset.read_raw()?;
    Ok(Some(bytes.as_chunks().0.iter().map(|&bytes| half(bytes).to_f64()).collect()))
}

fn transposed<T: Copy, U>(values: &[T], rows: usize, converted: impl Fn(T) -> U) -> Vec<U> {
    let columns = values.len().checked_div(rows).unwrap_or(0);
    let mut transposed = Vec::with_capacity(values.len());
    for column in 0..columns {
        transposed.extend((0..rows).map(|row| converted(values[row * columns + column])));
    }
    transposed
}

/// Columns after x and y are ignored.
fn keypoints(array: &Array<'_>) -> Result<Vec<[f64; 2]>, Error> {
    let columns = match array.shape[..] {
        [_, columns] if columns >= 2 => columns as usize,
        // Some exporters write an image without keypoints like this.
        [0] | [0, _] | [2, 0] => return Ok(Vec::new()),
        _ => return Err(array.wrong("shape (N, 2)", tuple(&array.shape))),
    };
    let rows = array.values.chunks_exact(columns);
    let rows: Vec<[f64; 2]> = rows.map(|row| [row[0], row[1]]).collect();
    match rows.iter().position(|row| !row.iter().all(|value| value.is_finite())) {
        None => Ok(rows),
        Some(at) => {
            let found = format!("({}, {})", rows[at][0], rows[at][1]);
            Err(array.wrong(format!("finite coordinates in row {at}"), found))
        }
    }
}

/// Converts a `(D, N)` array to rows of `D` values. A square array is `(N, D)` if its rows, but not its columns, have equal norms.
fn descriptors(array: &Array<'_>, n: usize) -> Result<Descriptors, Error> {
    let expected = format!("shape (D, N) with N = {n}, one column per keypoint");
    let dim = match array.shape[..] {
        ref sides if n == 0 && sides.contains(&0) => {
            sides.iter().copied().max().unwrap_or(0).max(1) as usize
        }
        [dim, count] if count == n as u64 && dim > 0 => dim as usize,
        [count, _] if count == n as u64 => {
            let found = format!("{}, rows and columns exchanged", tuple(&array.shape));
            return Err(array.wrong(expected, found));
        }
        _ => return Err(array.wrong(expected, tuple(&array.shape))),
    };
    let is_rows = dim == n && has_equal_rows(&array.values, n);
    // Transposing a matrix of one row changes nothing.
    let sides = if is_rows { 1 } else { dim };
    let values = match array.datatype {
        Datatype::FixedPoint {
            size: 1, layout: FixedPointLayout { signed: false, .. }, ..
        } => Values::U8(transposed(&array.values, sides, |value| value as u8)),
        Datatype::FixedPoint { .. } if !array.values.is_empty() => {
            return Err(array.wrong("floats, or unsigned bytes", "other integers"));
        }
        _ => Values::F32(transposed(&array.values, sides, |value| value as f32)),
    };
    Descriptors::try_new(values, dim).map_err(|error| Error::core(array.path, error))
}

/// Returns whether the rows of a square matrix, but not its columns, have equal norms, up to the rounding of bytes and half floats.
fn has_equal_rows(values: &[f64], n: usize) -> bool {
    let spread = |at: &dyn Fn(usize, usize) -> usize| {
        let norm2 = |i: usize| (0..n).map(|j| values[at(i, j)] * values[at(i, j)]).sum::<f64>();
        let (sum, squares) =
            (0..n).map(norm2).fold((0.0, 0.0), |(sum, squares), x| (sum + x, squares + x * x));
        (squares * n as f64 / (sum * sum) - 1.0).max(0.0).sqrt()
    };
    spread(&|i, j| i * n + j) < 0.01 && spread(&|i, j| j * n + i) > 0.01
}

fn size(array: &Array<'_>) -> Result<[u32; 2], Error> {
    let side = |value: &f64| {
        let is_whole = (1.0..=f64::from(u32::MAX)).contains(value) && value.fract() == 0.0;
        is_whole.then_some(*value as u32)
    };
    let sides: Option<Vec<u32>> = array.values.iter().map(side).collect();
    sides.and_then(|sides| sides.try_into().ok()).ok_or_else(|| {
        let first = &array.values[..array.values.len().min(3)];
        array.wrong("width and height in pixels", tuple(first))
    })
}

/// An attribute of the root group of files that unlift writes.
const WRITER: &str = "written_by";

/// Returns true if unlift wrote the HDF5 file at `path`.
pub(crate) fn is_ours(path: &Path) -> bool {
    let is_ours = || {
        let attributes = File::open_streaming(path).ok()?.root().attrs().ok()?;
        Some(attributes.get(WRITER)?.as_str() == Some("unlift"))
    };
    caught(is_ours).ok().flatten().unwrap_or(false)
}

/// A feature file in hloc's layout that is written image by image, and moved to its place when it is complete.
///
/// Each image is a group with `keypoints` `(N, 2)` and, if present, `descriptors` `(D, N)`,
/// `scores`, `scales` and `oris` `(N,)` and `image_size` `(2,)`; see `docs/formats.md`. Names and
/// at most 64 MiB of values stay in memory. The same images in the same order give the same bytes.
pub struct FeatureWriter {
    // Dropped before `output`, which removes the file that it has open.
    file: File,
    output: OutputFile,
    /// The names of images, and (false) of the folders above them.
    is_image: BTreeMap<String, bool>,
    /// Bytes since the last commit.
    staged: usize,
}

const MAX_STAGED: usize = 64 << 20;

impl FeatureWriter {
    /// Starts the feature file `path`.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let output = OutputFile::create(path, Access::Usual)?;
        // `output` holds a lock already.
        let access = FileAccessProperties::new()
            .with_locking(FileLocking::Disabled)
            .with_memory_strategy(MemoryStrategy::Bounded)
            .with_sync_policy(SyncPolicy::OnClose);
        let file = File::create_with_options(&output.partial, FileCreateProperties::new(), access);
        let file = file.map_err(|error| failed(path, error))?;
        let writer = AttrValue::AsciiString("unlift".to_owned());
        file.root().set_attr(WRITER, writer).map_err(|error| failed(path, error))?;
        Ok(Self { file, output, is_image: BTreeMap::new(), staged: 0 })
    }

    /// Checks that an image can be written.
    ///
    /// # Errors
    /// When a part of the name is empty, `.` or `..`, the name exists, contains or is inside
    /// another image, or a column has not one row per keypoint.
    pub fn check(&self, image: &ImageFeatures) -> Result<(), Error> {
        let name = &image.name;
        let place = format!("image {}", quoted(name.as_bytes()));
        let wrong = |expected: &str, found: &dyn Display| {
            Err(Error::new(&self.output.path, &*place, expected, found))
        };
        let parts = || name.split('/');
        if parts().any(|part| matches!(part, "" | "." | "..") || part.contains('\0')) {
            return wrong("a name whose parts are not empty, . or ..", &quoted(name.as_bytes()));
        }
        let depth = parts().count();
        if depth > MAX_DEPTH {
            return wrong(&format!("a name of at most {MAX_DEPTH} parts"), &depth);
        }
        let n = image.keypoints.len();
        let lengths = [
            ("descriptors", image.descriptors.as_ref().map(|rows| rows.len())),
            ("scores", image.scores.as_ref().map(Vec::len)),
            ("scales", image.scales.as_ref().map(Vec::len)),
            ("oris", image.orientations_deg.as_ref().map(Vec::len)),
        ];
        if let Some((array, Some(len))) =
            lengths.into_iter().find(|(_, len)| len.is_some_and(|len| len != n))
        {
            let place = format!("{place}, {array}");
            let expected = format!("{n}, one per keypoint");
            return Err(Error::new(&self.output.path, place, expected, len));
        }
        let is_image = |folder: &str| self.is_image.get(folder) == Some(&true);
        if self.is_image.contains_key(name) || folders(name).any(is_image) {
            let found = "one that exists already, or contains or is inside another image";
            return wrong("a new name", &found);
        }
        Ok(())
    }

    /// Writes one image.
    ///
    /// # Errors
    /// When [`check`](Self::check) fails.
    pub fn append(&mut self, image: &ImageFeatures) -> Result<(), Error> {
        self.check(image)?;
        self.stage(image).map_err(|error| failed(&self.output.path, error))
    }

    fn stage(&mut self, image: &ImageFeatures) -> Result<(), hdf5_pure::Error> {
        let root = self.file.root();
        for folder in folders(&image.name) {
            if self.is_image.insert(folder.to_owned(), false).is_none() {
                root.create_group(folder)?;
            }
        }
        self.is_image.insert(image.name.clone(), true);
        let columns = columns(image);
        self.staged += columns.iter().map(|(.., bytes)| bytes.len()).sum::<usize>();
        root.create_group_with(&image.name, |group| {
            for (name, shape, datatype, bytes) in columns {
                group.create_dataset(name, |dataset| {
                    let count = shape.iter().product();
                    dataset.with_raw_data(datatype, bytes, count).with_shape(&shape);
                    if name == KEYPOINTS {
                        dataset.set_attr(UPRIGHT, AttrValue::F64(f64::from(image.upright)));
                        if let Some(value) = image.uncertainty_px {
                            dataset.set_attr(UNCERTAINTY, AttrValue::F64(value));
                        }
                    }
                });
            }
        })?;
        if self.staged > MAX_STAGED {
            self.file.commit()?;
            self.staged = 0;
        }
        Ok(())
    }

    /// Moves the file to its place. If that fails, no temporary file is left.
    pub fn finish(self) -> Result<(), Error> {
        let Self { output, file, .. } = self;
        file.commit().and_then(|()| file.close()).map_err(|error| failed(&output.path, error))?;
        output.commit()
    }
}

fn failed(path: &Path, error: hdf5_pure::Error) -> Error {
    let source = match error {
        hdf5_pure::Error::Io(source) => source,
        other => std::io::Error::other(other.to_string()),
    };
    Error::write(path, source)
}

/// The folders above an image, the outermost first.
fn folders(name: &str) -> impl Iterator<Item = &str> {
    name.match_indices('/').map(|(at, _)| &name[..at])
}

/// The name, the shape, the type and the bytes of an array to write.
type Column = (&'static str, Vec<u64>, Datatype, Vec<u8>);

fn columns(image: &ImageFeatures) -> Vec<Column> {
    let n = image.keypoints.len() as u64;
    let floats = |values: &[f32]| values.iter().flat_map(|x| x.to_le_bytes()).collect();
    let single = hdf5_pure::make_f32_type;
    let places: Vec<f32> = image.keypoints.iter().flatten().map(|&value| value as f32).collect();
    let mut columns: Vec<Column> = vec![(KEYPOINTS, vec![n, 2], single(), floats(&places))];
    if let Some(rows) = &image.descriptors {
        let (datatype, bytes) = match rows.values() {
            Values::U8(values) => {
                (hdf5_pure::make_u8_type(), transposed(values, rows.len(), |value| value))
            }
            Values::F32(values) => {
                let values = transposed(values, rows.len(), |value| value);
                let byte_order = DatatypeByteOrder::LittleEndian;
                let half = Datatype::FloatingPoint { size: 2, byte_order, layout: HALF };
                let halves = halves(&values).map(|halves| (half, halves));
                halves.unwrap_or_else(|| (single(), floats(&values)))
            }
        };
        columns.push(("descriptors", vec![rows.dim() as u64, n], datatype, bytes));
    }
    let per_keypoint =
        [("scores", &image.scores), ("scales", &image.scales), ("oris", &image.orientations_deg)];
    for (name, values) in per_keypoint {
        columns.extend(values.as_ref().map(|values| (name, vec![n], single(), floats(values))));
    }
    if let Some(size) = image.size {
        let bytes = size.iter().flat_map(|&side| i64::from(side).to_le_bytes()).collect();
        columns.push(("image_size", vec![2], hdf5_pure::make_i64_type(), bytes));
    }
    columns
}

/// Returns the bytes of `values` as half floats, as hloc stores descriptors of networks, if all are exact.
fn halves(values: &[f32]) -> Option<Vec<u8>> {
    let exact = |&value: &f32| Some(f16::from_f32(value)).filter(|half| half.to_f32() == value);
    let halves: Vec<f16> = values.iter().map(exact).collect::<Option<_>>()?;
    Some(halves.into_iter().flat_map(f16::to_le_bytes).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn square_descriptors_are_rows_or_columns_by_their_norms() {
        const N: usize = 64;
        let mut rows = vec![0.0_f32; N * N];
        for (at, row) in rows.chunks_exact_mut(N).enumerate() {
            (row[0], row[1]) = (at as f32).sin_cos();
        }
        let read = |values: Vec<f32>| {
            let values = values.into_iter().map(f64::from).collect();
            let (path, name, datatype) = (Path::new(""), "", hdf5_pure::make_f32_type());
            let array = Array { path, name, shape: vec![N as u64; 2], datatype, values };
            descriptors(&array, N).unwrap().values().clone()
        };
        assert_eq!(read(transposed(&rows, N, |value| value)), Values::F32(rows.clone()));
        assert_eq!(read(rows.clone()), Values::F32(rows));
        // Without equal norms, the layout decides: (D, N).
        let odd: Vec<f32> = (0..N * N).map(|at| ((at * at) % 101) as f32).collect();
        assert_eq!(read(transposed(&odd, N, |value| value)), Values::F32(odd));
    }
}
