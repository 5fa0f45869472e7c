//! Every way neighborhoods, recovered points and truth can differ from docs/formats.md.

use crate::tables::{
    Columns, check, float_lists, floats, ints, lists, maybe, maybe_ints, maybe_lists, message,
    texts, with, write,
};
use arrow_array::ArrayRef;
use unlift_io::stage;

#[test]
fn neighborhoods() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lists.parquet");
    let read = |columns: Columns| {
        write(&path, "", columns);
        message(&path, stage::read_neighborhoods(&path, 3, 1))
    };
    let records = |column: ArrayRef| read(vec![("records", column)]);
    let good = || lists(&[&[1], &[0, 2], &[]]);
    let slots = |column: ArrayRef| read(vec![("records", good()), ("slot", column)]);
    let scores = |rows: &[&[f64]]| read(vec![("records", good()), ("scores", float_lists(rows))]);
    check(vec![
        (
            read(vec![("record", good())]),
            "column records: expected lists of integers, found no such column",
        ),
        (
            records(float_lists(&[&[1.0], &[], &[]])),
            "column records: expected lists of integers, found type List(Float64)",
        ),
        (
            records(lists(&[&[1], &[0]])),
            "expected 3 rows, one per slot of the released map, found 2",
        ),
        (
            records(lists(&[&[1], &[0, 3], &[]])),
            "column records, row 1: expected a whole number below 3, found 3",
        ),
        (
            records(lists(&[&[1], &[0, -1], &[]])),
            "column records, row 1: expected a whole number below 3, found -1",
        ),
        (
            records(lists(&[&[1], &[0, 1], &[]])),
            "column records, slot 1: expected other records, found its own record 1",
        ),
        (
            records(lists(&[&[1], &[0, 0], &[]])),
            "column records, slot 1: expected each record once, found record 0 twice",
        ),
        (
            records(lists(&[&[1], &[0, 2, 0, 2], &[]])),
            "column records, row 1: expected at most 3 values, found 4",
        ),
        (
            records(maybe_lists([Some(vec![Some(1)]), Some(vec![Some(0), None]), Some(vec![])])),
            "column records, row 1: expected a list of numbers, found null in the list",
        ),
        (
            slots(ints([0, 1, 1])),
            "column slot, row 2: expected each slot once, found 1 as in row 1",
        ),
        (slots(ints([0, 1, 3])), "column slot, row 2: expected a whole number below 3, found 3"),
        (
            slots(maybe_ints([Some(0), None, Some(2)])),
            "column slot, row 1: expected a whole number below 3, found null",
        ),
        (
            scores(&[&[0.5], &[0.5], &[]]),
            "column scores, row 1: expected 2 values, one for each of records, found 1",
        ),
        (
            scores(&[&[f64::NAN], &[0.5, 0.5], &[]]),
            "column scores, row 0: expected finite numbers in the range of f32, found NaN",
        ),
        (
            read(vec![("point", ints([0])), ("neighbors", lists(&[&[1]]))]),
            "expected neighborhoods of slots, found neighborhoods of points",
        ),
    ]);
}

#[test]
fn point_neighborhoods() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.parquet");
    let read = |points: ArrayRef, neighbors: ArrayRef| {
        write(&path, "", vec![("point", points), ("neighbors", neighbors)]);
        message(&path, stage::read_point_neighborhoods(&path, 4))
    };
    check(vec![
        (
            read(ints([4]), lists(&[&[1]])),
            "column point, row 0: expected a whole number below 4, found 4",
        ),
        (
            read(ints([1, 1]), lists(&[&[0], &[0]])),
            "column point, row 1: expected each point once, found 1 as in row 0",
        ),
        (
            read(ints([1]), lists(&[&[0, 4]])),
            "column neighbors, row 0: expected a whole number below 4, found 4",
        ),
        (
            read(ints([1]), lists(&[&[0, 1]])),
            "column neighbors, point 1: expected other points, found its own point 1",
        ),
        (
            read(ints([1]), lists(&[&[0, 0]])),
            "column neighbors, point 1: expected each point once, found point 0 twice",
        ),
        (
            read(ints([0, 1, 2, 3, 3]), lists(&[&[], &[], &[], &[], &[]])),
            "expected at most 4 rows, one per point of the map, found 5",
        ),
    ]);
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
    let plus = |name, column| read(META, with(good(), name, Some(column)));
    let statuses = "ok, too_few_neighbors, degenerate, no_support";
    check(vec![
        (
            read(&META.replace("recovered", "truth"), good()),
            "expected a file of recovered points, found a truth file",
        ),
        (
            read(&META.replace("\"m\"", "\"m\",\"delta\":-1"), good()),
            "metadata unlift, delta: expected a number of at least 0, found -1",
        ),
        (
            read(&META.replace("\"m\"", "\"m\",\"rows_by\":\"point\""), good()),
            "metadata unlift, rows_by: expected one of slots, descriptor_rows, either, found \"point\"",
        ),
        (
            plus("x", maybe([Some(1.0), Some(f64::INFINITY)])),
            "column x, row 1: expected a finite number, NaN or null, found inf",
        ),
        (plus("y", maybe([None, None])), "column y, row 0: expected a number as in x, found null"),
        (
            plus("y", maybe([Some(1.0), Some(1.0)])),
            "column y, row 1: expected null as in x, found 1",
        ),
        (
            plus("y", maybe([Some(1e39), None])),
            "column y, row 0: expected a number in the range of f32 about the origin, found 1e39",
        ),
        (
            plus("status", texts([Some("ok"), Some("lost")])),
            &format!("column status, row 1: expected one of {statuses}, found lost"),
        ),
        (
            plus("axis", maybe_ints([None, Some(0)])),
            "column axis, row 0: expected a whole number below 2, as there is a position, found null",
        ),
        (
            plus("status", texts([Some("ok"), Some("ok")])),
            "column status, row 1: expected a reason, as x is null, found ok",
        ),
        (
            plus("status", texts([Some("degenerate"), Some("degenerate")])),
            "column status, row 0: expected ok, as x is not null, found degenerate",
        ),
        (
            plus("support", ints([65536, 0])),
            "column support, row 0: expected a whole number below 65536, found 65536",
        ),
        (
            plus("axis", ints([0, 2])),
            "column axis, row 1: expected a whole number below 2, found 2",
        ),
        (
            plus("slot", ints([1, 1])),
            "column slot, row 1: expected each slot once, found 1 as in row 0",
        ),
        (
            plus("descriptor_row", ints([0, 2])),
            "column descriptor_row, row 1: expected a whole number below 2, found 2",
        ),
        (
            plus("evidence", floats([0.0, f64::INFINITY])),
            "column evidence, row 1: expected a finite number, NaN or null, found inf",
        ),
    ]);
}

#[test]
fn truth() {
    const META: &str = r#"{"kind":"truth","version":1,"dimension":2,"unit":"m"}"#;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("truth.parquet");
    let good = || -> Columns {
        vec![
            ("slot", maybe_ints([Some(0), Some(1), None])),
            ("original", ints([2, 0, 1])),
            ("x", floats([0.0, 1.0, 2.0])),
            ("y", floats([0.0, 1.0, 2.0])),
            ("descriptor_row", maybe_ints([Some(1), Some(0), None])),
            ("dropped", texts([None, None, Some("odd_point")])),
        ]
    };
    write(&path, META, good());
    // Files of earlier versions do not say how many points share a record; crossed rows do.
    let (_, secret) = stage::read_truth::<2>(&path).unwrap();
    assert_eq!((secret.slots_per_record(), secret.map()), (2, None));
    let plus = |name, column| {
        write(&path, META, with(good(), name, Some(column)));
        message(&path, stage::read_truth::<2>(&path))
    };
    check(vec![
        (
            plus("slot", maybe_ints([Some(0), Some(2), None])),
            "column slot: expected slots below 2, as many have one, found 2",
        ),
        (
            plus("slot", maybe_ints([Some(0), Some(0), None])),
            "column slot, row 1: expected each slot once, found 0 as in row 0",
        ),
        (
            plus("original", ints([2, 2, 1])),
            "column original, row 1: expected each original once, found 2 as in row 0",
        ),
        (
            plus("original", ints([2, 0, 3])),
            "column original, row 2: expected a whole number below 3, found 3",
        ),
        (
            plus("dropped", texts([None, None, Some("bored")])),
            "column dropped, row 2: expected one of odd_point, coincident_pair, rejected_pair, on_center, other, as slot is null, found bored",
        ),
        (
            plus("dropped", texts([None, Some("odd_point"), Some("odd_point")])),
            "column dropped, row 1: expected null, as there is a slot, found odd_point",
        ),
        (
            plus("descriptor_row", maybe_ints([Some(1), None, None])),
            "column descriptor_row, row 1: expected a number, as there is a slot, found null",
        ),
        (
            plus("descriptor_row", maybe_ints([Some(1), Some(2), None])),
            "descriptor row of slot 1: expected below 2, found 2",
        ),
        (
            plus("descriptor_row", maybe_ints([Some(1), Some(1), None])),
            "descriptor row of slot 1: expected a row of record 0, each once, found 1",
        ),
        (
            plus("swapped_axis", maybe_ints([Some(1), Some(2), None])),
            "column swapped_axis, row 1: expected a whole number below 2, found 2",
        ),
        (
            plus("swapped_axis", maybe_ints([Some(1), None, None])),
            "column swapped_axis, row 1: expected a number, as there is a slot, found null",
        ),
    ]);
}
