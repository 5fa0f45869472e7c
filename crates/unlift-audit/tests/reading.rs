//! Notes and doubts about how a map was read, in its audit and in gates.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::time::Instant;

use unlift::audit::Plan;
use unlift::synthetic::room;
use unlift_audit::{Gate, Job, Preparation, maps};
use unlift_report::Document;

/// A table of a room in which every `every`th point has no position.
fn table(every: usize) -> String {
    room(1, 400).points.iter().enumerate().fold(String::new(), |mut text, (at, [x, y, z])| {
        match at % every {
            0 => writeln!(text, "{x},nan,{z}"),
            _ => writeln!(text, "{x},{y},{z}"),
        }
        .expect("text");
        text
    })
}

fn audit(map: &Path) -> Document {
    let preparation = Preparation { k: 10, ..Preparation::default() };
    let (input, prepared) = maps::open(map, None, &preparation).expect("a map");
    let job = Job::new(map, &input, &prepared, Path::new(""), Instant::now()).expect("a job");
    let mut plan = Plan { k: 10, inlier_ratios: vec![0.5], ..job.plan.clone() };
    plan.schemes.retain(|scheme| scheme.name() == "olc");
    let gates = vec![Gate::parse("olc:1.0<=100").expect("a gate")];
    maps::find(Job { plan, gates, ..job }, None).expect("an audit").document
}

#[test]
fn points_that_are_left_out_are_counted_and_many_of_them_let_no_gate_hold() {
    let dir = tempfile::tempdir().unwrap();
    let map = dir.path().join("map.csv");
    fs::write(&map, table(50)).unwrap();
    let document = audit(&map);
    assert_eq!(document.notes[0], "8 of 400 points have no place");
    assert_eq!((document.input.n_points, document.gates[0].passed), (392, true));

    fs::write(&map, table(10)).unwrap();
    let document = audit(&map);
    let doubt = "40 of 400 points have no place: what is audited is not the whole map";
    assert!(document.notes.iter().any(|note| note == doubt), "{:?}", document.notes);
    assert!(!document.gates[0].passed);
    assert_eq!(document.gates[0].reason.as_deref(), Some(doubt));
}

#[test]
fn rows_are_those_of_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let map = dir.path().join("map.csv");
    fs::write(&map, table(50)).unwrap();
    let all = Preparation { k: 10, ..Preparation::default() };
    let rows = maps::open(&map, None, &all).unwrap().1.rows;
    let expected: Vec<u32> = (0..400).filter(|row| row % 50 != 0).collect();
    assert_eq!(rows, expected);
    let some = Preparation { max_points: Some(100), ..all };
    let rows = maps::open(&map, None, &some).unwrap().1.rows;
    assert!(rows.len() == 100 && rows.is_sorted() && rows.iter().all(|row| row % 50 != 0));
}

/// LAS of a room with coordinates in degrees, or projected.
fn las(system: &[u8]) -> Vec<u8> {
    let points = room(1, 400).points;
    let mut file = vec![0; 227];
    let mut put = |at: usize, bytes: &[u8]| file[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, b"LASF");
    put(24, &[1, 2]);
    put(94, &227u16.to_le_bytes());
    put(96, &(227 + 54 + system.len() as u32).to_le_bytes());
    put(100, &1u32.to_le_bytes());
    put(105, &20u16.to_le_bytes());
    put(107, &(points.len() as u32).to_le_bytes());
    (0..3).for_each(|axis| put(131 + 8 * axis, &1e-4_f64.to_le_bytes()));
    let mut record = [0; 54];
    record[2..17].copy_from_slice(b"LASF_Projection");
    record[18..20].copy_from_slice(&2112u16.to_le_bytes());
    record[20..22].copy_from_slice(&(system.len() as u16).to_le_bytes());
    file.extend(record);
    file.extend(system);
    for point in points {
        point.iter().for_each(|x| file.extend(((x * 1e4) as i32).to_le_bytes()));
        file.extend([0; 8]);
    }
    file
}

#[test]
fn degrees_are_refused_with_a_scale_and_let_no_gate_hold() {
    let dir = tempfile::tempdir().unwrap();
    let map = dir.path().join("map.las");
    fs::write(&map, las(b"GEOGCS[\"WGS 84\",UNIT[\"degree\",0.017]]")).unwrap();
    let meters = Preparation { scale: Some(1.0), k: 10, ..Preparation::default() };
    let line = maps::open(&map, None, &meters).unwrap_err().to_string();
    assert!(line.contains("--scale 1: expected a map with lengths, found degrees"), "{line}");
    let document = audit(&map);
    let reason = document.gates[0].reason.as_deref().unwrap_or_default();
    assert!(!document.gates[0].passed && reason.starts_with("coordinates are degrees"), "{reason}");
    fs::write(&map, las(b"PROJCS[\"UTM\",GEOGCS[\"WGS 84\"]]")).unwrap();
    maps::open(&map, None, &meters).unwrap();
    assert!(audit(&map).gates[0].passed);
}

#[test]
fn colors_stay_with_their_points() {
    let dir = tempfile::tempdir().unwrap();
    let (mut points, mut descriptors) = (String::new(), b"P3DESC01".to_vec());
    let n = 200_usize;
    let color = |row: usize| [row as u8, (row / 3) as u8, 255 - row as u8];
    for ([x, y, z], row) in room(1, n).points.iter().zip(0..n) {
        // The last words are an error and no track. One point has no position.
        let y = if row == 20 { f64::NAN } else { *y };
        let [red, green, blue] = color(row);
        writeln!(points, "{} {x} {y} {z} {red} {green} {blue} 0.5", row + 1).unwrap();
    }
    descriptors.extend((n as u64).to_le_bytes());
    descriptors.extend([128_u32, 1].map(u32::to_le_bytes).concat());
    (0..n as u64).for_each(|row| descriptors.extend((row + 1).to_le_bytes()));
    descriptors.extend((0..n * 128).map(|at| (at * 37 % 101) as u8));
    let at = |name: &str| dir.path().join(name);
    for (name, bytes) in [
        ("cameras.txt", Vec::new()),
        ("images.txt", Vec::new()),
        ("points3D.txt", points.into_bytes()),
        ("descriptors.bin", descriptors),
    ] {
        fs::write(at(name), bytes).unwrap();
    }
    let preparation =
        Preparation { k: 5, max_points: Some(60), colors: true, ..Preparation::default() };
    let prepared = maps::open(dir.path(), Some(&at("descriptors.bin")), &preparation).unwrap().1;
    let expected: Vec<[u8; 3]> = prepared.rows.iter().map(|&row| color(row as usize)).collect();
    assert_eq!(prepared.rows.len(), 60);
    assert!(prepared.rows.iter().any(|&row| row > 20), "rows after the one that is left out");
    assert_eq!(prepared.descriptors.unwrap().colors(), Some(&*expected));
}
