//! Tests all deviations of neighborhoods, recovered points and ground truth from docs/formats.md.

use crate::tables::{
    Columns, check, check_columns, float_lists, floats, ints, lists, maybe, maybe_ints,
    maybe_lists, message, texts, write,
};
use unlift_io::stage;

#[test]
fn neighborhoods() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lists.parquet");
    let read = |columns: Columns| {
        write(&path, "", columns);
        message(&path, stage::read_neighborhoods(&path, 3, 1))
    };
    let good = || lists(&[&[1], &[0, 2], &[]]);
    let of_points = vec![("point", ints([0])), ("neighbors", lists(&[&[1]]))];
    check(vec![
        (
            read(vec![("record", good())]),
            "column records: expected lists of integers, found no such column",
        ),
        (
            read(vec![("records", lists(&[&[1], &[0]]))]),
            "expected 3 rows, one per slot of the released map, found 2",
        ),
        (read(of_points), "expected neighborhoods of slots, found neighborhoods of points"),
    ]);
    let of = |second: &[i64]| lists(&[&[1], second, &[]]);
    let with_null = maybe_lists([Some(vec![]), Some(vec![Some(0), None]), None]);
    let no_slot = maybe_ints([Some(0), None, Some(2)]);
    let rows = [
        (
            "records",
            float_lists(&[&[1.0], &[], &[]]),
            ": expected lists of integers, found type List(Float64)",
        ),
        ("records", of(&[0, 3]), ", row 1: expected a whole number below 3, found 3"),
        ("records", of(&[0, -1]), ", row 1: expected a whole number below 3, found -1"),
        ("records", of(&[0, 1]), ", slot 1: expected other records, found its own record 1"),
        ("records", of(&[0, 0]), ", slot 1: expected each record once, found record 0 twice"),
        ("records", of(&[0, 2, 0, 2]), ", row 1: expected at most 3 values, found 4"),
        ("records", with_null, ", row 1: expected a list of numbers, found null in the list"),
        ("slot", ints([0, 1, 1]), ", row 2: expected each slot once, found 1 as in row 1"),
        ("slot", ints([0, 1, 3]), ", row 2: expected a whole number below 3, found 3"),
        ("slot", no_slot, ", row 1: expected a whole number below 3, found null"),
        (
            "scores",
            float_lists(&[&[0.5], &[0.5], &[]]),
            ", row 1: expected 2 values, one for each of records, found 1",
        ),
        (
            "scores",
            float_lists(&[&[f64::NAN], &[0.5, 0.5], &[]]),
            ", row 0: expected finite numbers in the range of f32, found NaN",
        ),
    ];
    check_columns(vec![("records", good())], read, rows);
}

#[test]
fn point_neighborhoods() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.parquet");
    let read = |columns: Columns| {
        write(&path, "", columns);
        message(&path, stage::read_point_neighborhoods(&path, 4))
    };
    let rows = [
        ("point", ints([1, 4]), ", row 1: expected a whole number below 4, found 4"),
        ("point", ints([1, 1]), ", row 1: expected each point once, found 1 as in row 0"),
        ("neighbors", lists(&[&[0, 4], &[]]), ", row 0: expected a whole number below 4, found 4"),
        (
            "neighbors",
            lists(&[&[0, 1], &[]]),
            ", point 1: expected other points, found its own point 1",
        ),
        (
            "neighbors",
            lists(&[&[0, 0], &[]]),
            ", point 1: expected each point once, found point 0 twice",
        ),
    ];
    let good = vec![("point", ints([1, 2])), ("neighbors", lists(&[&[0], &[0]]))];
    check_columns(good, read, rows);
    let five = vec![("point", ints([0, 1, 2, 3, 3])), ("neighbors", lists(&[&[][..]; 5]))];
    assert_eq!(read(five), "expected at most 4 rows, one per point of the map, found 5");
}

#[test]
fn recovered() {
    const META: &str = r#"{"kind":"recovered","version":1,"dimension":2,"unit":"m"}"#;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recovered.parquet");
    let read = |meta: &str, columns: Columns| {
        write(&path, meta, columns);
        message(&path, stage::read_recovered::<2>(&path))
    };
    let good =
        || -> Columns { vec![("x", maybe([Some(1.0), None])), ("y", maybe([Some(2.0), None]))] };
    let swap = |from: &str, to: &str| read(&META.replace(from, to), good());
    check(vec![
        (swap("recovered", "truth"), "expected a file of recovered points, found a truth file"),
        (
            swap("\"m\"", "\"m\",\"delta\":-1"),
            "metadata unlift, delta: expected a number of at least 0, found -1",
        ),
        (
            swap("\"m\"", "\"m\",\"rows_by\":\"point\""),
            "metadata unlift, rows_by: expected one of slots, descriptor_rows, either, found \"point\"",
        ),
    ]);
    let infinite = f64::INFINITY;
    let status = |first, second| texts([Some(first), Some(second)]);
    let rows = [
        (
            "x",
            maybe([Some(1.0), Some(infinite)]),
            ", row 1: expected a finite number, NaN or null, found inf",
        ),
        ("y", maybe([None, None]), ", row 0: expected a number as in x, found null"),
        ("y", maybe([Some(1.0), Some(1.0)]), ", row 1: expected null as in x, found 1"),
        (
            "y",
            maybe([Some(1e39), None]),
            ", row 0: expected a number in the range of f32 about the origin, found 1e39",
        ),
        (
            "status",
            status("ok", "lost"),
            ", row 1: expected one of ok, too_few_neighbors, degenerate, no_support, found lost",
        ),
        ("status", status("ok", "ok"), ", row 1: expected a reason, as x is null, found ok"),
        (
            "status",
            status("degenerate", "degenerate"),
            ", row 0: expected ok, as x is not null, found degenerate",
        ),
        (
            "axis",
            maybe_ints([None, Some(0)]),
            ", row 0: expected a whole number below 2, as there is a position, found null",
        ),
        ("axis", ints([0, 2]), ", row 1: expected a whole number below 2, found 2"),
        ("support", ints([65536, 0]), ", row 0: expected a whole number below 65536, found 65536"),
        ("slot", ints([1, 1]), ", row 1: expected each slot once, found 1 as in row 0"),
        ("descriptor_row", ints([0, 2]), ", row 1: expected a whole number below 2, found 2"),
        (
            "evidence",
            floats([0.0, infinite]),
            ", row 1: expected a finite number, NaN or null, found inf",
        ),
    ];
    check_columns(good(), |columns| read(META, columns), rows);
}

#[test]
fn truth() {
    const META: &str = r#"{"kind":"truth","version":1,"dimension":2,"unit":"m"}"#;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("truth.parquet");
    let good: Columns = vec![
        ("slot", maybe_ints([Some(0), Some(1), None])),
        ("original", ints([2, 0, 1])),
        ("x", floats([0.0, 1.0, 2.0])),
        ("y", floats([0.0, 1.0, 2.0])),
        ("descriptor_row", maybe_ints([Some(1), Some(0), None])),
        ("dropped", texts([None, None, Some("odd_point")])),
    ];
    write(&path, META, good.clone());
    // Files of earlier versions do not state the number of slots per record; crossed rows imply
    // two.
    let (_, secret) = stage::read_truth::<2>(&path).unwrap();
    assert_eq!((secret.slots_per_record(), secret.map()), (2, None));
    let read = |columns: Columns| {
        write(&path, META, columns);
        message(&path, stage::read_truth::<2>(&path))
    };
    let two = |first, second| maybe_ints([Some(first), second, None]);
    let odd = Some("odd_point");
    let rows = [
        ("slot", two(0, Some(2)), ": expected slots below 2, the number of slots, found 2"),
        ("slot", two(0, Some(0)), ", row 1: expected each slot once, found 0 as in row 0"),
        ("original", ints([2, 2, 1]), ", row 1: expected each original once, found 2 as in row 0"),
        ("original", ints([2, 0, 3]), ", row 2: expected a whole number below 3, found 3"),
        (
            "dropped",
            texts([None, None, Some("bored")]),
            ", row 2: expected one of odd_point, coincident_pair, rejected_pair, on_center, thinned, other, as slot is null, found bored",
        ),
        (
            "dropped",
            texts([None, odd, odd]),
            ", row 1: expected null, as there is a slot, found odd_point",
        ),
        (
            "descriptor_row",
            two(1, None),
            ", row 1: expected a number, as there is a slot, found null",
        ),
        ("descriptor_row", two(1, Some(2)), "descriptor row of slot 1: expected below 2, found 2"),
        (
            "descriptor_row",
            two(1, Some(1)),
            "descriptor row of slot 1: expected a row of record 0, each once, found 1",
        ),
        ("swapped_axis", two(1, Some(2)), ", row 1: expected a whole number below 2, found 2"),
        (
            "swapped_axis",
            two(1, None),
            ", row 1: expected a number, as there is a slot, found null",
        ),
    ];
    check_columns(good, read, rows);
}
