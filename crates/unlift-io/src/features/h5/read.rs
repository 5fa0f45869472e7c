//! Reads HDF5 with the library `hdf5_pure`.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use half::f16;
use hdf5_pure::{
    AttrValue, Chunk, DType, Dataset, Datatype, DatatypeByteOrder, File, Group, Source,
};

use super::links::{Target, links};
use super::source::{self, Bounded};
use super::{Array, DEEPEST, Numbers, shape_text};
use crate::error::Error;
use crate::guard::without_panic;
use crate::input::{Budget, size};
use crate::read::lines::quoted;

/// A header can declare any size in a few bytes.
const MOST_VALUES: u64 = 1 << 28;
/// The least memory in bytes for a group besides its path, a chunk besides its bytes, and a value.
const PER_GROUP: u64 = 256;
const PER_CHUNK: u64 = 128;
const PER_VALUE: u64 = 8;

/// Groups with their paths, broken links, arrays outside groups.
type Listed = (Vec<(String, Group)>, Vec<Error>, Vec<String>);

fn within(path: &str, name: &str) -> String {
    if path.is_empty() { name.to_owned() } else { format!("{path}/{name}") }
}

/// An open HDF5 file, which is read one array at a time.
pub(crate) struct FeatureStore {
    path: PathBuf,
    len: u64,
    budget: Budget,
    paths: Vec<String>,
    /// Open handles: finding a group by path searches all names of the groups above it.
    groups: Vec<Group>,
    /// Errors about links that lead to no group.
    broken: Vec<Error>,
    alone: Vec<String>,
}

impl FeatureStore {
    /// Opens `path` and finds its groups.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let (source, len) = Bounded::open(path)?;
        let mut store = Self {
            path: path.to_owned(),
            len,
            budget: Budget::new(path, len),
            paths: Vec::new(),
            groups: Vec::new(),
            broken: Vec::new(),
            alone: Vec::new(),
        };
        let (mut groups, broken, alone) = store.step("", "", || {
            let file = File::from_source(source).map_err(|error| match error {
                hdf5_pure::Error::Io(source) => Error::read(path, source),
                other => Error::new(path, "", "a whole HDF5 file", other.to_string()),
            })?;
            let whole = file.superblock().eof_address;
            if whole > len {
                let expected = format!("a whole HDF5 file of {whole} bytes");
                return Err(Error::new(path, "", expected, format!("{len} bytes")));
            }
            store.list(&file)
        })?;
        groups.sort_unstable_by(|(a, _), (b, _)| a.cmp(b));
        (store.paths, store.groups) = groups.into_iter().unzip();
        (store.broken, store.alone) = (broken, alone);
        Ok(store)
    }

    /// Lists all groups that contain arrays directly, broken links, and arrays outside groups.
    fn list(&self, file: &File) -> Result<Listed, Error> {
        let (mut found, mut broken, mut alone) = (Vec::new(), Vec::new(), Vec::new());
        let root = file.root();
        let raw = Bounded::open(&self.path)?.0;
        let raw = |at: u64, n: u64| raw.read_exact_at(at, usize::try_from(n).ok()?).ok();
        let mut waiting = vec![(String::new(), root, 0)];
        // By header address: the group contains arrays, and it contains groups.
        let mut seen: HashMap<u64, [bool; 2]> = HashMap::new();
        let mut memory = 0;
        while let Some((path, group, depth)) = waiting.pop() {
            let place = || format!("group {}", quoted(path.as_bytes()));
            if depth > DEEPEST {
                let expected = format!("groups nested at most {DEEPEST} deep");
                return Err(Error::new(&self.path, place(), expected, "deeper ones, or a cycle"));
            }
            // The library keeps a copy of the path.
            memory += PER_GROUP + 2 * path.len() as u64;
            self.budget.admit("list of groups", memory)?;
            let refuse = |error| self.refuse(&path, "", error);
            // Opening the empty name, the group itself, reads its header only, which gives the
            // address.
            let (itself, address) = source::first_read(|| group.group(""));
            itself.map_err(refuse)?;
            let [arrays, _] = match address.and_then(|address| seen.get(&address)) {
                // A second link to an image is a second image. A second link to a group of groups
                // could make exponentially many paths.
                Some([_, true]) => {
                    let expected = "one link to each group of groups";
                    let found = "a second link, or a cycle";
                    return Err(Error::new(&self.path, place(), expected, found));
                }
                Some(&known) => known,
                None => {
                    let links = address.and_then(|at| links(raw, at)).unwrap_or_default();
                    if let Some((name, Target::Old(to))) =
                        links.iter().find(|(_, target)| matches!(target, Target::Old(_)))
                    {
                        let found = format!(
                            "a link to {} in the old form (write it with libver=\"latest\" of h5py)",
                            quoted(to.as_bytes())
                        );
                        return Err(self.no_image(&within(&path, name), found));
                    }
                    let datasets = group.datasets().map_err(refuse)?;
                    let mut inside: Vec<_> = group.iter_groups().map_err(refuse)?.collect();
                    for (name, target) in links {
                        match self.target(file, &group, &target) {
                            Ok(group) => inside.push((name, group)),
                            Err(found) => broken.push(self.no_image(&within(&path, &name), found)),
                        }
                    }
                    let holds = [!path.is_empty() && !datasets.is_empty(), !inside.is_empty()];
                    if path.is_empty() {
                        alone = datasets;
                    }
                    for (name, inside) in inside {
                        let path = within(&path, &name);
                        memory += PER_GROUP + 2 * path.len() as u64;
                        self.budget.admit("list of groups", memory)?;
                        waiting.push((path, inside, depth + 1));
                    }
                    seen.extend(address.map(|address| (address, holds)));
                    holds
                }
            };
            if arrays {
                found.push((path, group));
            }
        }
        Ok((found, broken, alone))
    }

    /// Returns the group that a link leads to, or a description of the broken link.
    fn target(&self, file: &File, group: &Group, target: &Target) -> Result<Group, String> {
        let (Target::Path(to) | Target::Old(to)) = target else {
            return Err("a link to another file".to_owned());
        };
        let found = if to.starts_with('/') { file.group(to) } else { group.group(to) };
        found.map_err(|_| format!("a link to {}", quoted(to.as_bytes())))
    }

    fn no_image(&self, path: &str, found: String) -> Error {
        self.error(path, "", "features of an image", found)
    }

    pub fn broken(&self) -> &[Error] {
        &self.broken
    }

    pub fn alone(&self) -> &[String] {
        &self.alone
    }

    /// Runs `step`, limits how much it reads, and turns a panic of the library into an error.
    fn step<T>(
        &self,
        path: &str,
        name: &str,
        step: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        let panicked = || Err(self.error(path, name, "readable HDF5", "damaged data"));
        source::bounded(self.len, || without_panic(step).unwrap_or_else(panicked))
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Paths of all groups that contain arrays directly, sorted by bytes.
    pub fn paths(&self) -> &[String] {
        &self.paths
    }

    pub fn names(&self, at: usize) -> Result<Vec<String>, Error> {
        let path = &self.paths[at];
        let mut names = self.step(path, "", || {
            self.groups[at].datasets().map_err(|error| self.refuse(path, "", error))
        })?;
        names.sort_unstable();
        Ok(names)
    }

    /// Reads the array `name` of the group `at`: floats of 16, 32 or 64 bits, or integers.
    pub fn array(&self, at: usize, name: &str) -> Result<Array, Error> {
        self.step(&self.paths[at], name, || self.read(at, name))
    }

    fn read(&self, at: usize, name: &str) -> Result<Array, Error> {
        let path = &self.paths[at];
        let refuse = |error| self.refuse(path, name, error);
        let dataset = self.groups[at].dataset(name).map_err(refuse)?;
        let shape = dataset.shape().map_err(refuse)?;
        let values = shape.iter().try_fold(1u64, |n, &side| n.checked_mul(side));
        let Some(count) = values.filter(|&n| n <= MOST_VALUES) else {
            let expected = format!("at most {MOST_VALUES} values");
            return Err(self.error(path, name, expected, shape_text(&shape)));
        };
        if count > 0 {
            self.admit(at, name, &dataset, &shape)?;
        }
        let datatype = dataset.datatype().map_err(refuse)?;
        let values = match dataset.dtype().map_err(refuse)? {
            DType::U8 if count == 0 => Numbers::U8(Vec::new()),
            _ if count == 0 => Numbers::F32(Vec::new()),
            DType::F32 => Numbers::F32(dataset.read_f32().map_err(refuse)?),
            DType::F64 => Numbers::F64(dataset.read_f64().map_err(refuse)?),
            DType::U8 => Numbers::U8(dataset.read_u8().map_err(refuse)?),
            DType::I8 | DType::I16 | DType::I32 | DType::I64 => {
                Numbers::I64(dataset.read_i64().map_err(refuse)?)
            }
            DType::U16 | DType::U32 | DType::U64 => {
                Numbers::I64(dataset.read_i64().map_err(refuse)?)
            }
            _ => match half_order(&datatype) {
                Some(from_bytes) => {
                    let bytes = dataset.read_raw().map_err(refuse)?;
                    let halves = bytes.as_chunks::<2>().0.iter();
                    Numbers::F16(halves.map(|&half| from_bytes(half)).collect())
                }
                None => {
                    let expected = "floats of 16, 32 or 64 bits, or integers";
                    return Err(self.error(path, name, expected, "another type"));
                }
            },
        };
        if values.len() as u64 != count {
            let found = format!("{} values", values.len());
            return Err(self.error(path, name, format!("{count} values"), found));
        }
        Ok(Array { shape, values })
    }

    /// Checks the memory for the array and for decoding it.
    fn admit(&self, at: usize, name: &str, dataset: &Dataset, shape: &[u64]) -> Result<(), Error> {
        let path = &self.paths[at];
        let refuse = |error| self.refuse(path, name, error);
        let product = |sides: &[u64], each: u64| {
            sides.iter().fold(each, |product, &side| product.saturating_mul(side))
        };
        let element = dataset.element_size().map_err(refuse)?;
        let place = self.place(path, name);
        self.budget.admit(&*place, product(shape, element.max(PER_VALUE)))?;
        let Some(chunk) = dataset.chunk_shape().map_err(refuse)? else { return Ok(()) };
        if chunk.len() != shape.len() || chunk.contains(&0) {
            return Err(self.error(path, name, "chunks of the same rank", shape_text(&chunk)));
        }
        let sides = shape.iter().zip(&chunk).map(|(&side, &chunk)| side.div_ceil(chunk));
        let most = product(&sides.collect::<Vec<_>>(), 1);
        // Every chunk is decoded whole, and the last ones extend over the edge.
        let each = product(&chunk, element).saturating_add(PER_CHUNK);
        self.budget.admit(&*place, most.saturating_mul(each))?;
        let stored = dataset.chunks().map_err(refuse)?;
        if stored.len() as u64 > most {
            let expected = format!("at most {most} chunks");
            return Err(self.error(path, name, expected, stored.len().to_string()));
        }
        // The library allocates what an index declares before it reads.
        let end = |chunk: &Chunk| chunk.address.saturating_add(chunk.storage_size);
        if let Some(end) = stored.iter().map(end).find(|&end| end > self.len) {
            let expected = format!("chunks within the {} bytes of the file", self.len);
            return Err(self.error(path, name, expected, format!("one that ends at {end}")));
        }
        Ok(())
    }

    pub fn number(&self, at: usize, name: &str, key: &str) -> Result<Option<f64>, Error> {
        let path = &self.paths[at];
        self.step(path, name, || {
            let refuse = |error| self.refuse(path, name, error);
            let dataset = self.groups[at].dataset(name).map_err(refuse)?;
            let attributes = dataset.attrs().map_err(refuse)?;
            Ok(attributes.get(key).and_then(AttrValue::as_f64))
        })
    }

    fn refuse(&self, path: &str, name: &str, error: hdf5_pure::Error) -> Error {
        if source::is_spent() {
            let most = size(source::most(self.len));
            let expected = format!("at most {most} to read in a file of {}", size(self.len));
            return self.error(path, name, expected, "parts that are read again and again");
        }
        self.error(path, name, "readable HDF5", error.to_string())
    }

    /// Returns an error about the image `path` and its array `name`, which may be empty.
    pub fn error(
        &self,
        path: &str,
        name: &str,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Error {
        Error::new(&self.path, self.place(path, name), expected, found)
    }

    fn place(&self, path: &str, name: &str) -> String {
        match (path, name) {
            ("", _) => String::new(),
            (_, "") => format!("image {}", quoted(path.as_bytes())),
            _ => format!("image {}, {name}", quoted(path.as_bytes())),
        }
    }
}

/// Returns the decoder of `datatype` if it is the IEEE float of 16 bits.
fn half_order(datatype: &Datatype) -> Option<fn([u8; 2]) -> f16> {
    let Datatype::FloatingPoint { size: 2, byte_order, layout } = datatype else { return None };
    let bits = (layout.exponent_location, layout.exponent_size, layout.mantissa_size);
    if bits != (10, 5, 10) || layout.exponent_bias != 15 {
        return None;
    }
    match byte_order {
        DatatypeByteOrder::LittleEndian => Some(f16::from_le_bytes),
        DatatypeByteOrder::BigEndian => Some(f16::from_be_bytes),
        _ => None,
    }
}
