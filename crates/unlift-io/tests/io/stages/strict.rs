//! Malformed and damaged files: one line each, without a panic.

use std::fs;
use std::path::Path;

use unlift::Unit;
use unlift_io::stage::{self, ImageFile, Kind};
use unlift_io::{Error, read};

use super::maps;
use crate::{archive, npy, write};

fn floats(shape: &str, values: &[f64]) -> Vec<u8> {
    npy("'<f8'", shape, &values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())
}

fn whole(shape: &str, values: &[i64]) -> Vec<u8> {
    npy("'<i8'", shape, &values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())
}

fn text(text: &str) -> Vec<u8> {
    let letters: Vec<u8> = text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
    npy(&format!("'<U{}'", letters.len() / 4), "()", &letters)
}

type Arrays = Vec<(&'static str, Vec<u8>)>;

/// Returns the arrays with one replaced, added or, without bytes, removed.
fn with(mut arrays: Arrays, name: &'static str, bytes: Vec<u8>) -> Arrays {
    arrays.retain(|(old, _)| *old != name);
    if !bytes.is_empty() {
        arrays.push((name, bytes));
    }
    arrays
}

/// Returns the error line of reading a file, after the name of the file.
fn line<T>(bytes: impl AsRef<[u8]>, read: impl Fn(&Path) -> Result<T, Error>) -> String {
    let (_dir, path) = write("a.npz", bytes);
    let line = read(&path).err().expect("an error").to_string();
    line.replace(&format!("{}: ", path.display()), "")
}

/// Checks that reading `arrays` fails with `expected` after the name of the file.
fn refused<T>(arrays: &Arrays, read: impl Fn(&Path) -> Result<T, Error>, expected: &str) {
    assert_eq!(line(archive(arrays), read), expected);
}

fn lines() -> Arrays {
    vec![
        ("unlift", text(r#"{"unit": "m"}"#)),
        ("foot", floats("(2, 3)", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])),
        ("direction", floats("(2, 3)", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0])),
    ]
}

#[test]
#[rustfmt::skip] // One row per line.
fn released_maps() {
    let read = stage::read_released::<3>;
    for (name, bytes, expected) in [
        ("direction", vec![], "array direction: expected an array of shape (2, 3), found no such array"),
        ("foot", vec![], "expected a released map, with one of the arrays foot, center, offset, position, found arrays unlift, direction"),
        ("direction", floats("(3, 3)", &[1.0; 9]), "array direction: expected shape (2, 3), found (3, 3)"),
        ("foot", floats("(2, 2)", &[1.0; 4]), "array foot: expected shape (n, 3), found (2, 2)"),
        ("foot", npy("'<c8'", "(2, 3)", &[0; 48]), "array foot: expected numbers, found dtype <c8"),
        ("foot", floats("(2, 3)", &[1.0; 5]), "array foot: expected 2 rows of 24 bytes, found 40 bytes"),
        ("foot", floats("(2, 3)", &[1.0, 2.0, 3.0, 4.0, f64::NAN, 6.0]), "array foot, row 1: expected a finite number, found NaN"),
        ("feet", floats("(1,)", &[1.0]), "array feet: expected only unlift, foot, direction, center, centers, regions, axis, offset, position, descriptor, descriptor_subspace, descriptor_words, public_descriptor, origin, bounds, found an unknown array"),
        ("descriptor", whole("(2, 2)", &[0, 1, 2, 256]), "array descriptor, row 1: expected a whole number below 256, or a float, found 256.0"),
        ("public_descriptor", floats("(2, 2)", &[1.0; 4]), "arrays: expected one of descriptor, descriptor_subspace and descriptor_words, and public_descriptor beside the last two, found public_descriptor"),
        ("descriptor_subspace", floats("(2, 2)", &[1.0; 4]), "array descriptor_subspace: expected shape (2, 1, d, d), found (2, 2)"),
        ("descriptor_words", whole("(2, 1, 1)", &[0, 0]), "array descriptor_words, row 0: expected a whole number below 0, found 0.0"),
        ("unlift", vec![], "metadata unlift, unit: expected m, px or kth_neighbor, found nothing"),
        ("unlift", text("[1]"), "metadata unlift: expected a JSON object, found [1]"),
        ("unlift", npy("'<U2'", "(1,)", &[0; 8]), "array unlift: expected a text without dimensions, as np.array(json.dumps(..)), found shape (1,)"),
        ("unlift", floats("()", &[1.0]), "array unlift: expected a text without dimensions, as np.array(json.dumps(..)), found dtype <f8"),
        ("unlift", text(r#"{"unit": "cm"}"#), "metadata unlift, unit: expected m, px or kth_neighbor, found \"cm\""),
        ("unlift", text(r#"{"unit": "m", "slots": 2}"#), "metadata unlift: expected only kind, version, unit, family, scheme, fingerprint, rows_by, lists_by, slots_per_record, delta, epsilon, of_bytes, confidence_unknown, found slots"),
        ("unlift", text(r#"{"unit": "m", "version": 2}"#), "metadata unlift, version: expected 1, found 2"),
        ("unlift", text(r#"{"unit": "m", "kind": "truth"}"#), "expected a released map, found a truth file"),
        ("unlift", text(r#"{"unit": "m", "family": "curves"}"#), "metadata unlift, family: expected one of lines, rays, axis_planes, axis_candidates, found \"curves\""),
    ] {
        refused(&with(lines(), name, bytes), read, expected);
    }
    let stated = with(lines(), "unlift", text(r#"{"unit": "m", "fingerprint": "00112233445566778899aabbccddeeff"}"#));
    let found = line(archive(&stated), read);
    assert!(found.ends_with("or none (the file was changed), found \"00112233445566778899aabbccddeeff\""), "{found}");
    let unit = || ("unlift", text(r#"{"unit": "m"}"#));
    let rays = vec![unit(), ("centers", floats("(0, 3)", &[])), ("center", whole("(1,)", &[0])), ("direction", floats("(1, 3)", &[1.0; 3]))];
    refused(&rays, read, "array centers: expected 1 to 255 rows, found 0 rows");
    let planes = vec![unit(), ("axis", floats("(1,)", &[1.0])), ("offset", floats("(1,)", &[1.0]))];
    refused(&planes, read, "array axis: expected whole numbers, found dtype <f8");
}

#[test]
#[rustfmt::skip] // One row per line.
fn lists() {
    let lists = |values: &[i64]| vec![("records", whole("(3, 2)", values))];
    let scores = |values: &[f64]| with(lists(&[1, 2, 0, -1, 0, 1]), "scores", floats("(3, 2)", values));
    let read = |path: &Path| stage::read_neighborhoods(path, 3, 1);
    for (arrays, expected) in [
        (lists(&[1, 2, 0, 3, 0, 1]), "array records, row 1: expected a whole number below 3, or -1 for none, found 3.0"),
        (lists(&[1, 2, 0, 1, 0, 1]), "neighborhood of slot 1: expected other records, found its own record 1"),
        (lists(&[1, 1, 0, 2, 0, 1]), "neighborhood of slot 0: expected each record once, found record 1 twice"),
        (vec![("records", whole("(2, 1)", &[1, 0]))], "array records: expected shape (3, k), found (2, 1)"),
        (scores(&[1.0, 2.0, f64::NAN, 4.0, 5.0, 6.0]), "neighborhood score 2: expected a finite number, found NaN"),
        (vec![("neighbors", whole("(3, 1)", &[1, 2, 0]))], "expected neighborhoods of slots, found neighborhoods of points"),
    ] {
        refused(&arrays, read, expected);
    }
    let read = |path: &Path| stage::read_point_neighborhoods(path, 3);
    refused(&vec![("neighbors", whole("(3, 1)", &[1, 2, 2]))], read, "neighborhood of slot 2: expected other records, found its own record 2");
}

#[test]
#[rustfmt::skip] // One row per line.
fn recovered_points() {
    let position = || vec![("position", floats("(2, 2)", &[1.0, 2.0, f64::NAN, f64::NAN]))];
    let read = |path: &Path| stage::read_recovered::<2>(path, None);
    for (name, bytes, expected) in [
        ("position", floats("(1, 2)", &[1.0, f64::NAN]), "array position, row 0: expected 2 numbers, or 2 NaN if lost, found [1.0, NaN]"),
        ("position", floats("(1, 2)", &[1e300, 1.0]), "array position, row 0: expected a number in the range of f32, or NaN if lost, found 1e300"),
        ("status", whole("(2,)", &[0, 0]), "recovered slot 1: expected a position if and only if its status is ok, found ok"),
        ("evidence", floats("(2,)", &[0.0, f64::INFINITY]), "array evidence, row 1: expected a finite number, found inf"),
        ("found", floats("(2,)", &[0.5, 0.5]), "array error_scale: expected an array of shape (2,), found no such array"),
        ("axis", whole("(2,)", &[-1, -1]), "array axis, row 0: expected an axis, as there is a position, found -1"),
        ("descriptor_row", whole("(2,)", &[0, 2]), "array descriptor_row, row 1: expected a whole number below 2, found 2.0"),
        ("slot", whole("(2,)", &[0, 1]), "expected a file of recovered points, found a truth file"),
    ] {
        refused(&with(position(), name, bytes), read, expected);
    }
    let confident = |found: f64, scale: f64| with(with(position(), "found", floats("(2,)", &[found, f64::NAN])), "error_scale", floats("(2,)", &[scale, f64::NAN]));
    refused(&confident(1.5, 0.1), read, "array found, row 0: expected a probability, found 1.5");
    refused(&confident(f64::NAN, 0.1), read, "array found, row 0: expected a probability, found NaN");
    refused(&confident(0.5, -1.0), read, "array error_scale, row 0: expected a length, found -1.0");
    let in_3d = |path: &Path| stage::read_recovered::<3>(path, Some(Unit::Meter));
    refused(&position(), in_3d, "array position: expected shape (n, 3), found (2, 2)");
}

#[test]
#[rustfmt::skip] // One row per line.
fn truth() {
    let position = || vec![
        ("unlift", text(r#"{"unit": "m"}"#)), ("position", floats("(3, 3)", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])),
        ("slot", whole("(3,)", &[1, -1, 0])),
    ];
    let read = stage::read_truth::<3>;
    for (name, bytes, expected) in [
        ("slot", whole("(3,)", &[0, 0, -1]), "array slot, row 1: expected each slot once, found 0 as in row 0"),
        ("slot", whole("(3,)", &[0, -1, 2]), "array slot, row 2: expected slots below 2, the number of slots, found 2"),
        ("dropped", whole("(3,)", &[0, 0, 0]), "array dropped, row 1: expected the code of a reason, as there is no slot, found 0"),
        ("dropped", whole("(3,)", &[6, 6, 0]), "array dropped, row 0: expected 0, as there is a slot, found 6"),
        ("swapped_axis", whole("(3,)", &[0, 1, 2]), "array swapped_axis, row 1: expected -1, as there is no slot, found 1"),
        ("descriptor_row", whole("(3,)", &[-1, -1, 0]), "array descriptor_row, row 0: expected a number, as there is a slot, found -1"),
        ("unlift", text(r#"{"unit": "m", "slots_per_record": 2}"#), "array descriptor_row: expected the descriptor row of each point, as records have two slots, found no such array"),
        ("unlift", text(r#"{"unit": "m", "slots_per_record": 3}"#), "metadata unlift, slots_per_record: expected 1 or 2, found 3"),
    ] {
        refused(&with(position(), name, bytes), read, expected);
    }
}

#[test]
#[rustfmt::skip] // One row per line.
fn images() {
    let feet = || floats("(1, 2)", &[1.0, 2.0]);
    let image = || vec![("a.jpg/foot", feet()), ("a.jpg/direction", feet()), ("b.jpg/foot", feet()), ("b.jpg/direction", feet())];
    let all = |path: &Path| {
        let mut images = ImageFile::open(path, Kind::Released)?;
        while let Some(rows) = images.next_image()? {
            rows.released()?;
        }
        Ok(())
    };
    refused(&with(image(), "b.jpg/direction", vec![]), all, "image b.jpg, array direction: expected an array of shape (1, 2), found no such array");
    refused(&with(image(), "a.jpg/foot", feet()), all, "expected the arrays of each image together, found image a.jpg again");
    refused(&with(image(), "foot", feet()), all, "expected arrays below the names of images, as a.jpg/foot, found array foot");
    refused(&with(image(), "b.jpg/unlift", text("{")), all, "image b.jpg, metadata unlift: expected a JSON object, found EOF while parsing an object at line 1 column 1");
    let next = |name: &'static str| move |path: &Path| ImageFile::open(path, Kind::Released)?.expect(name, Path::new("r.npz")).map(drop);
    refused(&image(), next("b.jpg"), "expected image b.jpg, as in r.npz, found a.jpg");
    let end = |path: &Path| ImageFile::open(path, Kind::Released)?.expect_end(Path::new("r.npz"));
    refused(&image(), end, "expected no more images, as in r.npz, found image a.jpg");
}

#[test]
fn maps_and_stage_files_are_not_confused() {
    let (_dir, path) = write("a.npz", "");
    stage::write_released(&path, &maps::released::<3>(1, 5)[0], None).unwrap();
    let found = line(fs::read(&path).unwrap(), read::open);
    assert_eq!(found, "expected points of a map, found a released map");
    let points = archive(&[("points", floats("(1, 3)", &[1.0; 3]))]);
    let found = line(points, stage::read_released::<3>);
    assert!(found.ends_with("foot, center, offset, position, found arrays points"), "{found}");
    let expected = "expected an archive of NumPy arrays (.npz), found an empty file";
    assert_eq!(line("", stage::kind), expected);
    assert!(line("ply\n", stage::kind).ends_with("found another file"));
    // An array that unpacks to more than the budget, from few bytes.
    let large = npy("'<i8'", "(1, 34000000)", &vec![0; 8 * 34_000_000]);
    let found = line(archive(&[("records", large)]), |path| stage::read_neighborhoods(path, 1, 1));
    let expected = "array records: expected at most 256 MiB in memory of a file";
    assert!(found.starts_with(expected), "{found}");
}

/// Feet and directions as they are written, in the map's frame.
#[test]
fn published_positions_are_not_in_normal_form() {
    let (_dir, path) = write("a.npz", archive(&with(lines(), "origin", floats("(3,)", &[9.0; 3]))));
    let feet = [[10.0, 11.0, 12.0], [13.0, 14.0, 15.0]];
    let ends = [[11.0, 11.0, 12.0], [13.0, 15.0, 15.0]];
    assert_eq!(stage::published_positions::<3>(&path).unwrap(), [feet, ends]);
}
