//! Tests all deviations of a released map from docs/formats.md, and their error lines.

use crate::tables::{
    Columns, check, check_columns, float_lists, floats, ints, lists, maybe, message, texts, with,
    write,
};
use unlift_io::stage;

const LINES: &str = r#"{"kind":"released","version":1,"family":"lines","dimension":2,"unit":"m"}"#;

fn lines() -> Columns {
    vec![
        ("foot_x", floats([0.0, 1.0, 2.0])),
        ("foot_y", floats([0.0, 1.0, 2.0])),
        ("direction_x", floats([1.0, 0.6, 0.0])),
        ("direction_y", floats([0.0, 0.8, 1.0])),
    ]
}

fn released(meta: &str, columns: Columns) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.parquet");
    write(&path, meta, columns);
    message(&path, stage::read_released::<2>(&path))
}

#[test]
fn the_valid_file_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.parquet");
    write(&path, LINES, lines());
    assert_eq!(stage::read_released::<2>(&path).unwrap().n_records(), 3);
}

#[test]
fn metadata() {
    let swap = |from: &str, to: &str| {
        assert!(LINES.contains(from));
        released(&LINES.replace(from, to), lines())
    };
    let plus = |text: &str| swap("\"m\"", &format!("\"m\",{text}"));
    let kinds = "released, truth, neighborhoods, point_neighborhoods, recovered";
    let families = "lines, rays, axis_planes or axis_candidates";
    check(vec![
        (
            released("", vec![("a", floats([0.0]))]),
            "metadata unlift, family: expected lines, rays, axis_planes or axis_candidates, or the columns of one, \
             found nothing",
        ),
        (
            released("{", lines()),
            "metadata unlift: expected a JSON object, found EOF while parsing an object at line 1 column 1",
        ),
        (released("[1]", lines()), "metadata unlift: expected a JSON object, found [1]"),
        (swap("\"released\"", "\"truth\""), "expected a released map, found a truth file"),
        (
            swap("\"released\"", "\"map\""),
            &format!("metadata unlift, kind: expected one of {kinds}, found \"map\""),
        ),
        (swap("\"version\":1", "\"version\":2"), "metadata unlift, version: expected 1, found 2"),
        (
            swap("\"kind\":\"released\",\"version\":1", "\"version\":0"),
            "metadata unlift, version: expected 1, found 0",
        ),
        (
            swap("\"lines\"", "\"circles\""),
            &format!("metadata unlift, family: expected {families}, found \"circles\""),
        ),
        (
            swap("\"dimension\":2", "\"dimension\":3"),
            "metadata unlift, dimension: expected 2, found 3",
        ),
        (
            swap("\"dimension\":2", "\"dimension\":4"),
            "metadata unlift, dimension: expected 2 or 3, found 4",
        ),
        (
            swap("\"m\"", "\"cm\""),
            "metadata unlift, unit: expected m, px or kth_neighbor, found \"cm\"",
        ),
        (
            plus("\"origin\":[0,1,2]"),
            "metadata unlift, origin: expected a list of 2 numbers, found [0,1,2]",
        ),
        (
            plus("\"slots_per_record\":3"),
            "metadata unlift, slots_per_record: expected 1 or 2, found 3",
        ),
        (
            plus("\"fingerprint\":\"5ad0\""),
            "metadata unlift, fingerprint: expected 32 hexadecimal digits, the fingerprint of a released map, \
             found \"5ad0\"",
        ),
        (
            plus("\"slots_per_record\":0"),
            "metadata unlift, slots_per_record: expected a whole number of at least 1, found 0",
        ),
    ]);
}

/// A fingerprint that differs from the content is an error; without one the file is accepted.
#[test]
fn a_changed_map_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.parquet");
    write(&path, LINES, lines());
    let map = stage::read_released::<2>(&path).unwrap();
    let meta = LINES.replace("\"m\"", &format!("\"m\",\"fingerprint\":\"{}\"", map.fingerprint()));
    write(&path, &meta, lines());
    assert_eq!(stage::read_released::<2>(&path).unwrap(), map);
    let other = with(lines(), "foot_x", Some(floats([0.0, 1.0, 2.5])));
    let line = released(&meta, other);
    assert!(
        line.contains("metadata unlift, fingerprint: expected the fingerprint of the content, "),
        "{line}"
    );
    assert!(line.ends_with(&format!("found \"{}\"", map.fingerprint())), "{line}");
}

#[test]
fn columns() {
    let without = released(LINES, with(lines(), "foot_x", None));
    assert_eq!(without, "column foot_x: expected floats, found no such column");
    let text = texts([Some("1"), None, None]);
    let wide = ints([1, (1 << 53) + 1, 3]);
    let rows = [
        ("foot_x", text, ": expected floats, found type Utf8"),
        ("foot_x", wide, ", row 1: expected a number that is exact in f64, found 9007199254740993"),
        ("foot_x", floats([0.0, f64::NAN, 0.0]), ", row 1: expected a finite number, found NaN"),
        (
            "foot_x",
            maybe([Some(0.0), Some(1.0), None]),
            ", row 2: expected a finite number, found null",
        ),
        (
            "foot_x",
            floats([0.0, 0.0, 1e39]),
            "foot of record 2: expected coordinates in the range of f32, found [1e39, 0.0]",
        ),
        (
            "direction_y",
            floats([0.0, 0.8, 0.0]),
            "direction of record 2: expected a finite vector with length, found [0.0, 0.0]",
        ),
        (
            "descriptor",
            lists(&[&[1, 2], &[3, 4], &[5]]),
            ", row 2: expected 2 values as in every row, found 1",
        ),
        ("descriptor", lists(&[&[][..]; 3]), ", row 0: expected 1 values as in every row, found 0"),
        (
            "descriptor",
            lists(&[&[1, 2], &[3, 256], &[5, 6]]),
            ", row 1: expected a whole number below 256, found 256",
        ),
        (
            "descriptor",
            float_lists(&[&[1.0], &[f64::INFINITY], &[2.0]]),
            ", row 1: expected finite numbers in the range of f32, found inf",
        ),
        (
            "descriptor",
            lists(&[&[0][..]; 3]),
            "descriptors: expected real descriptors, found only zeros (dummies)",
        ),
        ("descriptor", ints([1, 2, 3]), ": expected lists of integers or floats, found type Int64"),
    ];
    check_columns(lines(), |columns| released(LINES, columns), rows);
}

#[test]
fn descriptors_of_two_slots() {
    let paired = LINES.replace("\"m\"", "\"m\",\"slots_per_record\":2");
    let first = || with(lines(), "descriptor_0", Some(lists(&[&[1], &[2], &[3]])));
    let missing = "column descriptor_1: expected lists of integers, found no such column";
    assert_eq!(released(&paired, first()), missing);
    let rows = [
        (
            "descriptor_1",
            float_lists(&[&[1.0], &[2.0], &[3.0]]),
            ": expected lists of integers, found type List(Float64)",
        ),
        (
            "descriptor_1",
            lists(&[&[1], &[2], &[3, 4]]),
            ", row 2: expected 1 values as in every row, found 2",
        ),
    ];
    check_columns(first(), |columns| released(&paired, columns), rows);
}

#[test]
fn other_families() {
    let meta = |family: &str| LINES.replace("\"lines\"", &format!("\"{family}\""));
    let rays = LINES.replace("\"lines\"", "\"rays\",\"centers\":[[0,0],[1,1]]");
    let centers = |text: &str| rays.replace("[[0,0],[1,1]]", text);
    let direction = || lines()[2..].to_vec();
    let planes = |axis, offset| {
        released(&meta("axis_planes"), vec![("axis", ints(axis)), ("offset", floats(offset))])
    };
    let point = || vec![("x", floats([0.0])), ("y", floats([0.0]))];
    check(vec![
        (
            released(&rays, with(direction(), "center", Some(ints([0, 1, 2])))),
            "column center, row 2: expected a whole number below 2, found 2",
        ),
        (released(&rays, direction()), "column center: expected integers, found no such column"),
        (
            released(&meta("rays"), direction()),
            "metadata unlift, centers: expected a list of lists of 2 numbers, found nothing",
        ),
        (
            released(&centers("[]"), direction()),
            "metadata unlift, centers: expected 1 to 255 centers, found []",
        ),
        (
            released(&centers("[[0,0],[1]]"), direction()),
            "metadata unlift, centers: expected a list of lists of 2 numbers, found [[0,0],[1]]",
        ),
        (
            planes([0, 1, 2], [0.0, 1.0, 2.0]),
            "column axis, row 2: expected a whole number below 2, found 2",
        ),
        (
            planes([0, 1, -1], [0.0, 1.0, 2.0]),
            "column axis, row 2: expected a whole number below 2, found -1",
        ),
        (
            planes([0, 1, 1], [0.0, 1e39, 2.0]),
            "offset of record 1: expected a finite number in the range of f32, found inf",
        ),
        (
            released(&meta("axis_candidates"), with(point(), "y", None)),
            "column y: expected floats, found no such column",
        ),
        (
            released(
                &meta("axis_candidates").replace("\"m\"", "\"m\",\"slots_per_record\":2"),
                point(),
            ),
            "slots per record: expected 1 to 1 for axis_candidates, found 2",
        ),
    ]);
}
