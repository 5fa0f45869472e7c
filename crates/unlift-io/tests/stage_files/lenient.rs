//! Tests files of other programs that deviate without loss: they are read.

use crate::tables::{
    Columns, floats, ints, lists, maybe, maybe_ints, maybe_lists, message, texts, with, write,
};
use arrow_array::{Float64Array, Int64Array, ListArray, NullArray};
use arrow_schema::DataType;
use std::path::PathBuf;
use std::sync::Arc;
use unlift::Unit;
use unlift::recover::Status;
use unlift::truth::DropReason;
use unlift_io::stage::{self, ImageFile, Kind};

fn place() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.parquet");
    (folder, path)
}

fn points() -> Columns {
    vec![("x", ints([0, 1, 2])), ("y", floats([0.0, 1.0, 0.1])), ("z", floats([0.5, 1.0, 2.0]))]
}

const UNIT: &str = r#"{"unit":"m"}"#;

#[test]
fn of_a_released_map_columns_tell_all_but_the_unit() {
    let (_folder, path) = place();
    let lines = || {
        let mut columns: Columns = Vec::new();
        for (name, column) in
            ["foot_x", "foot_y", "foot_z", "direction_x", "direction_y", "direction_z"]
                .into_iter()
                .zip(points().into_iter().chain(points()))
        {
            columns.push((name, column.1));
        }
        columns
    };
    write(&path, UNIT, lines());
    let map = stage::read_released::<3>(&path).unwrap();
    assert_eq!((map.obfuscation().family(), map.unit()), ("lines", Unit::Meter));
    assert_eq!((map.slots_per_record(), map.origin()), (1, [0.0; 3]));
    let header = stage::peek(&path).unwrap();
    assert_eq!((header.kind, header.dimension), (Kind::Released, Some(3)));
    // It declares no kind, so it is never replaced as a file of unlift.
    assert_eq!(stage::declared_kind(&path), None);

    write(&path, "", lines());
    let line = message(&path, stage::read_released::<3>(&path));
    assert_eq!(line, "metadata unlift, unit: expected m, px or kth_neighbor, found nothing");
    let line = message(&path, stage::read_released::<2>(&path));
    assert_eq!(line, "expected 2 dimensions, found columns of 3");
    let line = message(&path, stage::read_truth::<3>(&path));
    assert_eq!(line, "expected a truth file, found a released map");

    // In 2D the default unit is pixels.
    write(&path, "", points()[..2].to_vec());
    let map = stage::read_released::<2>(&path).unwrap();
    assert_eq!((map.obfuscation().family(), map.unit()), ("axis_candidates", Unit::Pixel));
    // Rounded to f32, as documented.
    let unlift::released::Obfuscation::AxisCandidates(candidates) = map.obfuscation() else {
        panic!("{} is not candidates", map.obfuscation().family());
    };
    assert_eq!(candidates.position()[2], [2.0, 0.1_f32]);

    let planes = vec![("axis", ints([0, 2])), ("offset", floats([1.0, 2.0]))];
    write(&path, UNIT, planes.clone());
    let line = message(&path, stage::read_released::<3>(&path));
    assert_eq!(line, "metadata unlift, dimension: expected 2 or 3, found nothing");
    write(&path, r#"{"unit":"m","dimension":3}"#, planes);
    assert_eq!(stage::read_released::<3>(&path).unwrap().n_records(), 2);
}

#[test]
fn descriptors_of_nobody_are_none() {
    let (_folder, path) = place();
    let nothing = ListArray::new_null(
        Arc::new(arrow_schema::Field::new("element", DataType::Float64, true)),
        3,
    );
    for column in [Arc::new(nothing) as arrow_array::ArrayRef, Arc::new(NullArray::new(3))] {
        write(&path, UNIT, with(points(), "descriptor", Some(column)));
        assert_eq!(stage::read_released::<3>(&path).unwrap().descriptors(), None);
    }
    let some = maybe_lists([Some(vec![Some(1), Some(2)]), None, Some(vec![Some(3), Some(4)])]);
    write(&path, UNIT, with(points(), "descriptor", Some(some)));
    let line = message(&path, stage::read_released::<3>(&path));
    assert_eq!(line, "column descriptor, row 1: expected 2 values as in every row, found 0");
}

#[test]
fn a_truth_is_its_points_in_the_order_of_slots() {
    let (_folder, path) = place();
    write(&path, UNIT, points());
    let (original, secret) = stage::read_truth::<3>(&path).unwrap();
    assert_eq!(original.reveal().positions()[1], [1.0, 1.0, 1.0]);
    assert_eq!((secret.n_slots(), secret.slots_per_record()), (3, 1));
    assert_eq!(secret.descriptor_row(), [0, 1, 2]);
    assert!(secret.hidden().iter().enumerate().all(|(slot, id)| id.index() == slot));

    // A reason for a point that is in no record, and null columns.
    let dropped = texts([None, Some("other"), None]);
    let mut columns = with(points(), "dropped", Some(dropped));
    columns.push(("slot", Arc::new(NullArray::new(3))));
    columns.push(("swapped_axis", Arc::new(Int64Array::new_null(3))));
    columns.push(("descriptor_row", Arc::new(Float64Array::new_null(3))));
    write(&path, UNIT, columns);
    let (_, secret) = stage::read_truth::<3>(&path).unwrap();
    assert_eq!((secret.n_slots(), secret.hidden()[1].0), (2, 2));
    assert_eq!(
        (secret.dropped()[0].original.0, secret.dropped()[0].reason),
        (1, DropReason::Other)
    );
    assert_eq!(secret.swapped_axis(), None);

    // pandas converts integers with nulls to floats.
    let slots = maybe([Some(1.0), Some(f64::NAN), Some(0.0)]);
    let with_slots = |reasons| {
        let columns = with(points(), "slot", Some(slots.clone()));
        with(columns, "dropped", reasons)
    };
    write(&path, UNIT, with_slots(Some(texts([None, Some("odd_point"), None]))));
    let (_, secret) = stage::read_truth::<3>(&path).unwrap();
    assert_eq!(secret.hidden().iter().map(|id| id.0).collect::<Vec<_>>(), [2, 0]);

    // Points that are missing from the shares would make a map look safer.
    write(&path, UNIT, with_slots(None));
    let line = message(&path, stage::read_truth::<3>(&path));
    let end = "other, as slot is null, found null";
    assert!(line.starts_with("column dropped, row 1: ") && line.ends_with(end), "{line}");
    write(&path, UNIT, with(points(), "slot", Some(floats([0.0, 1.0, 1.5]))));
    let line = message(&path, stage::read_truth::<3>(&path));
    assert_eq!(line, "column slot, row 2: expected a whole number below 3, found 1.5");
}

/// The order of rows does not state which descriptor belongs to which of two points.
#[test]
fn records_of_two_points_need_their_descriptor_rows() {
    let (_folder, path) = place();
    let two = || points().into_iter().map(|(name, column)| (name, column.slice(0, 2))).collect();
    let meta = r#"{"unit":"m","slots_per_record":2}"#;
    write(&path, meta, two());
    let line = message(&path, stage::read_truth::<3>(&path));
    let expected =
        "column descriptor_row, row 0: expected a number, as there is a slot, found null";
    assert_eq!(line, expected);
    write(&path, meta, with(two(), "descriptor_row", Some(ints([1, 0]))));
    assert_eq!(stage::read_truth::<3>(&path).unwrap().1.slots_per_record(), 2);
}

#[test]
fn lists_may_be_null_and_without_scores() {
    let (_folder, path) = place();
    let rows = maybe_lists([Some(vec![Some(1)]), None, Some(vec![])]);
    let scores = Arc::new(NullArray::new(3));
    write(
        &path,
        "",
        vec![("records", rows), ("scores", scores), ("slot", floats([2.0, 1.0, 0.0]))],
    );
    let read = stage::read_neighborhoods(&path, 3, 1).unwrap();
    assert_eq!((read.of(0).len(), read.of(1).len(), read.of(2)[0].0), (0, 0, 1));
    assert_eq!(read.scores(), None);
    let unscored = maybe_lists([None, None, None]);
    write(&path, "", vec![("records", lists(&[&[1], &[0], &[]])), ("scores", unscored)]);
    assert_eq!(stage::read_neighborhoods(&path, 3, 1).unwrap().scores(), None);
    let scored = maybe_lists([Some(vec![Some(3)]), Some(vec![Some(4)]), None]);
    write(&path, "", vec![("records", lists(&[&[1], &[0], &[]])), ("scores", scored)]);
    let read = stage::read_neighborhoods(&path, 3, 1).unwrap();
    assert_eq!(read.scores(), Some(&[3.0, 4.0][..]));
}

#[test]
fn lost_positions_are_null_or_nan() {
    let (_folder, path) = place();
    let found: Columns = vec![
        ("x", maybe([Some(1.0), None, Some(f64::NAN)])),
        ("y", maybe([Some(2.0), Some(f64::NAN), None])),
        ("z", maybe([Some(3.0), None, None])),
        ("status", texts([None, Some("degenerate"), None])),
        ("support", maybe_ints([None, None, None])),
        ("evidence", maybe([Some(f64::NAN), None, Some(1.0)])),
        ("found", maybe([Some(0.5), None, None])),
        ("error_scale", maybe([Some(0.1), None, Some(f64::NAN)])),
        ("axis", maybe_ints([Some(2), None, None])),
        ("descriptor_row", Arc::new(Int64Array::new_null(3))),
    ];
    // The default unit is that of the map they are compared with.
    write(&path, "", found.clone());
    let read = stage::read_recovered_in::<3>(&path, Unit::KthNeighbor).unwrap();
    assert_eq!(read.status(), [Status::Ok, Status::Degenerate, Status::NoSupport]);
    assert_eq!((read.position(0), read.unit()), (Some([1.0, 2.0, 3.0]), Unit::KthNeighbor));
    assert_eq!((read.support()[0], read.evidence()[0]), (0, 0.0));
    assert_eq!(read.confidence().map(|c| c[0].found), Some(0.5));
    assert!(read.axis().is_some() && read.descriptor_row().is_none());
    let line = message(&path, stage::read_recovered::<3>(&path));
    assert_eq!(line, "metadata unlift, unit: expected m, px or kth_neighbor, found nothing");

    let unsure = with(found, "found", Some(maybe([None, Some(0.1), None])));
    write(&path, UNIT, unsure);
    let line = message(&path, stage::read_recovered::<3>(&path));
    assert_eq!(line, "column found, row 0: expected a probability, found null");
}

/// Errors about images in one file name the image.
#[test]
fn images_are_told_by_name() {
    let (_folder, path) = place();
    let of = |names, rows: [f64; 3], meta: Option<&'static str>| {
        let columns = vec![
            ("image", texts(names)),
            ("x", floats(rows)),
            ("y", floats([0.0, 1.0, 2.0])),
            ("image_meta", texts([meta; 3])),
        ];
        write(&path, "", columns);
        let mut images = ImageFile::open(&path, Kind::Released).unwrap();
        let read = || -> Result<Vec<usize>, unlift_io::Error> {
            let mut sizes = Vec::new();
            while let Some(image) = images.next_image()? {
                sizes.push(image.released()?.n_records());
            }
            Ok(sizes)
        };
        let mut read = read;
        read()
    };
    let good = [Some("a"), Some("a"), Some("b")];
    assert_eq!(of(good, [0.0; 3], None).unwrap(), [2, 1]);
    let line = |result| message(&path, result);
    let found = line(of(good, [0.0, f64::NAN, 0.0], None));
    assert_eq!(found, "image a, column x, row 1: expected a finite number, found NaN");
    let found = line(of([Some("a"), Some("b"), Some("a")], [0.0; 3], None));
    assert_eq!(found, "column image, row 2: expected contiguous rows of each image, found a again");
    let found = line(of([Some("a"), None, Some("b")], [0.0; 3], None));
    assert_eq!(found, "column image, row 1: expected the name of an image, found null");
    let found = line(of(good, [0.0; 3], Some(r#"{"bounds":[0,1]}"#)));
    let expected = "image a, metadata unlift, bounds: expected a low and a high corner of 2 numbers, found [0,1]";
    assert_eq!(found, expected);
    let found = line(of(good, [0.0; 3], Some("{")));
    assert!(
        found.starts_with("image a, metadata unlift: expected a JSON object, found "),
        "{found}"
    );
    write(&path, "", points()[..2].to_vec());
    let found = message(&path, ImageFile::open(&path, Kind::Released));
    assert_eq!(found, "column image: expected text, found no such column");
}
