//! Tests of files that list, declare or compress far more than they contain, and of large valid
//! files.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use super::messages::{self, UNDEFINED};
use super::source::READ_SO_FAR;
use super::tree::{self, Entry};
use super::write::superblock;
use super::{Array, FeatureStore, Numbers, Writer};

fn images(n: usize) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let mut writer = Writer::start(&mut out).unwrap();
    let none = Array { shape: vec![0, 2], values: Numbers::F32(Vec::new()) };
    for at in 0..n {
        writer.array(&mut out, &format!("{at:06}.jpg"), "keypoints", &none, &[]).unwrap();
    }
    writer.finish(&mut out).unwrap();
    out.into_inner()
}

fn opened(bytes: &[u8]) -> Result<FeatureStore, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("f");
    fs::write(&path, bytes).unwrap();
    FeatureStore::open(&path).map_err(|error| shown(&path, &error))
}

fn shown(path: &Path, error: &crate::Error) -> String {
    error.to_string().replace(path.to_str().unwrap(), "f")
}

struct Pieces(Vec<u8>);

impl Pieces {
    fn new() -> Self {
        Self(vec![0; 96])
    }

    fn put(&mut self, bytes: &[u8]) -> u64 {
        let at = self.0.len() as u64;
        self.0.extend(bytes);
        at
    }

    /// Adds a group. `members` are names and header offsets.
    fn group(&mut self, members: &[(&str, u64)]) -> (u64, [u64; 2]) {
        let entry = |&(name, header)| Entry { name, header, group: None };
        let entries: Vec<Entry<'_>> = members.iter().map(entry).collect();
        let (bytes, names) = tree::names(&entries, self.0.len() as u64);
        self.put(&bytes);
        (self.put(&messages::group(names[0], names[1])), names)
    }

    fn finish(mut self, (header, names): (u64, [u64; 2])) -> Vec<u8> {
        let start = superblock(self.0.len() as u64, header, names);
        self.0[..start.len()].copy_from_slice(&start);
        self.0
    }

    fn image(&mut self) -> u64 {
        let array = Array { shape: vec![1, 2], values: Numbers::F32(vec![1.0, 2.0]) };
        let values = self.put(&array.values.bytes());
        let dataset = self.put(&messages::dataset(&array, values, 8, &[]));
        self.group(&[("keypoints", dataset)]).0
    }
}

#[test]
fn what_is_read_grows_with_images_and_not_with_their_square() {
    let cost = |n: usize| {
        let before = READ_SO_FAR.get();
        let store = opened(&images(n)).unwrap();
        assert_eq!(store.paths().len(), n);
        for at in 0..n {
            assert_eq!(store.names(at).unwrap(), ["keypoints"]);
            assert_eq!(store.array(at, "keypoints").unwrap().shape, [0, 2]);
        }
        READ_SO_FAR.get() - before
    };
    let (few, many) = (cost(400), cost(1600));
    assert!(many < 5 * few, "{few} and {many} bytes for 400 and 1,600 images");
}

#[test]
fn groups_with_more_paths_than_can_be_walked_are_refused() {
    let mut file = Pieces::new();
    let mut inner = file.image();
    let mut group = (0, [0; 2]);
    // Every group has two links to the previous one: 2^40 paths.
    for _ in 0..41 {
        group = file.group(&[("a", inner), ("b", inner)]);
        inner = group.0;
    }
    let line = opened(&file.finish(group)).err().unwrap();
    let expected = ": expected one link to each group of groups, found a second link, or a cycle";
    assert!(line.starts_with("f: group \"b/b/b/") && line.ends_with(expected), "{line}");
}

#[test]
fn an_image_with_two_names_is_two_images() {
    let mut file = Pieces::new();
    let image = file.image();
    let root = file.group(&[("a", image), ("b", image)]);
    let bytes = file.finish(root);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("f");
    fs::write(&path, bytes).unwrap();
    let store = FeatureStore::open(&path).unwrap();
    assert_eq!(store.paths(), ["a", "b"]);
    assert_eq!(store.array(0, "keypoints").unwrap(), store.array(1, "keypoints").unwrap());
}

/// h5py writes a soft link in this form by default.
#[test]
fn a_link_in_a_group_of_the_old_form_is_told() {
    let mut file = Pieces::new();
    let image = file.image();
    let start = file.0.len();
    let root = file.group(&[("a.jpg", image), ("b.jpg", UNDEFINED)]);
    // The second entry of the leaf points to the text at byte 8 of the heap, "a.jpg", instead of an
    // object.
    let leaf = file.0[start..].windows(4).position(|word| word == b"SNOD").unwrap();
    let entry = start + leaf + 8 + 40;
    file.0[entry + 16] = 2;
    file.0[entry + 24] = 8;
    let line = opened(&file.finish(root)).err().unwrap();
    let expected = "f: image \"b.jpg\": expected features of an image, found a link to \"a.jpg\" in the old form (write it with \
                    libver=\"latest\" of h5py)";
    assert_eq!(line, expected);
}

#[test]
fn a_list_whose_nodes_are_the_same_again_and_again_is_refused() {
    let spent = "f: expected at most 256 MiB to read in a file of";
    let mut wrong = Vec::new();
    // One long name for all entries, or a short one for far more of them.
    for (name, levels) in [("x".repeat(100_000), 3), ("x".to_owned(), 12)] {
        let mut file = Pieces::new();
        let image = file.image();
        let entry = Entry { name: &name, header: image, group: None };
        let (bytes, [_, heap]) = tree::names(&[entry], file.0.len() as u64);
        file.put(&bytes);
        let mut leaf = b"SNOD\x01\0\x08\0".to_vec();
        (0..8).for_each(|_| leaf.extend(Entry { name: "", header: image, group: None }.bytes(8)));
        let mut child = file.put(&leaf);
        for level in 0..levels {
            child = file.put(&tree::node(level, &[(child, 8); 32], 0, [UNDEFINED; 2]));
        }
        let header = file.put(&messages::group(child, heap));
        let line = opened(&file.finish((header, [child, heap]))).err();
        if !line.as_ref().is_some_and(|line| line.starts_with(spent)) {
            wrong.push(line);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn arrays_that_take_more_than_the_file_may_are_refused_before_they_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("f");
    let line = |place: &str| {
        let store = FeatureStore::open(&path).unwrap();
        let line = shown(&path, &store.array(0, "keypoints").unwrap_err());
        let start = "f: image \"a\", keypoints: expected at most 256 MiB in memory of a file of ";
        assert!(line.starts_with(start) && line.ends_with(place), "{line}");
    };
    // No values are stored.
    let mut out = Cursor::new(Vec::new());
    let mut writer = Writer::start(&mut out).unwrap();
    let array = Array { shape: vec![1 << 27, 2], values: Numbers::F32(Vec::new()) };
    writer.array(&mut out, "a", "keypoints", &array, &[]).unwrap();
    writer.finish(&mut out).unwrap();
    fs::write(&path, out.into_inner()).unwrap();
    line("found 2 GiB");
    // Values that deflate to a thousandth of their size.
    let mut builder = hdf5_pure::FileBuilder::new();
    let mut group = builder.create_group("a");
    group
        .create_dataset("keypoints")
        .with_u8_data(&vec![0; 40 << 20])
        .with_shape(&[20 << 20, 2])
        .with_chunks(&[1 << 20, 2])
        .with_deflate(9);
    builder.add_group(group.finish());
    builder.write(&path).unwrap();
    line("found 320 MiB");
}
