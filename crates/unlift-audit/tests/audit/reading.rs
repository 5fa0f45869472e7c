//! Notes and doubts about how a map was read, in its audit and in gates.

use std::path::{Path, PathBuf};

use unlift::audit::Plan;
use unlift::synthetic::room;
use unlift_audit::{Input, Map, Preparation, maps};
use unlift_report::Document;

use crate::audited;

/// Writes a room in which every `every`th point has no position.
fn room_with_gaps(folder: &Path, every: usize) -> PathBuf {
    let mut points = room(1, 400).points;
    points.iter_mut().step_by(every).for_each(|point| point[1] = f64::NAN);
    let path = folder.join("map.csv");
    let text: String = points.iter().map(|[x, y, z]| format!("{x},{y},{z}\n")).collect();
    std::fs::write(&path, text).unwrap();
    path
}

fn audit(map: &Path) -> Document {
    let preparation = Preparation { k: 10, ..Preparation::default() };
    let prepared = maps::open(map, None, &preparation).expect("a map");
    let map = Map::new(&prepared);
    let mut plan = Plan { k: 10, inlier_ratios: vec![0.5], ..map.plan.clone() };
    plan.schemes.retain(|scheme| scheme.name() == "olc");
    let input = Input::Map(Map { plan, ..map });
    audited(&prepared, &input, &["olc:1.0<=100"]).expect("an audit").document
}

#[test]
fn points_that_are_left_out_are_counted_and_many_of_them_let_no_gate_hold() {
    let dir = tempfile::tempdir().unwrap();
    let document = audit(&room_with_gaps(dir.path(), 50));
    assert_eq!(document.notes[0], "8 of 400 points have no place");
    assert_eq!((document.input.n_points, document.gates[0].passed), (392, true));

    let document = audit(&room_with_gaps(dir.path(), 10));
    let doubt = "40 of 400 points have no place: what is audited is not the whole map";
    assert!(document.notes.iter().any(|note| note == doubt), "{:?}", document.notes);
    assert!(!document.gates[0].passed);
    assert_eq!(document.gates[0].reason.as_deref(), Some(doubt));
}

#[test]
fn rows_are_those_of_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let map = room_with_gaps(dir.path(), 50);
    let all = Preparation { k: 10, ..Preparation::default() };
    let rows = maps::open(&map, None, &all).unwrap().rows;
    let expected: Vec<u32> = (0..400).filter(|row| row % 50 != 0).collect();
    assert_eq!(rows, expected);
    let some = Preparation { max_points: Some(100), ..all };
    let rows = maps::open(&map, None, &some).unwrap().rows;
    assert!(rows.len() == 100 && rows.is_sorted() && rows.iter().all(|row| row % 50 != 0));
}
