//! Runs the snippets of docs/formats.md with python3 and pyarrow, and reads their output.

use crate::python::{python, run};
use std::path::Path;
use unlift::recover::Status;
use unlift::released::{Lines, Obfuscation};
use unlift::truth::DropReason;
use unlift::{RecordId, Unit};
use unlift_io::stage::{self, ImageFile, Kind};

/// The data that the document assumes: 12 points on a grid and a line through each, of which all
/// but the last two are released, in reverse order.
const GIVEN: &str = r#"
import numpy as np
points = np.array([[x, y, z] for x in range(3) for y in range(2) for z in range(2)], float)
hidden, left_out = list(range(9, -1, -1)), [10, 11]
towards = np.random.default_rng(0).normal(size=points.shape)
foot, direction = points[hidden], towards[hidden]
records = [[r for r in range(10) if r != own] for own in range(10)]
near = [[q for q in range(12) if q != p] for p in range(12)]
photos = {f"{n}.jpg": ((640, 480), np.full((n, 2), 9.0 * n), np.ones((n, 2))) for n in (3, 1, 20000)}
found = np.where(np.arange(10)[:, None] % 5 == 4, np.nan, points[hidden])
"#;

/// The part that writes and the part that reads.
fn snippets() -> (String, String) {
    let document = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats.md");
    let document = std::fs::read_to_string(document).unwrap();
    let of = |text: &str| -> Vec<String> {
        let blocks = text.split("```python\n").skip(1);
        blocks.map(|block| block.split("```").next().unwrap().to_owned()).collect()
    };
    let (write, read) = document.split_once("**Read**").unwrap();
    let (write, read) = (of(write), of(read));
    assert!(write.len() >= 3 && read.len() >= 3, "{} and {}", write.len(), read.len());
    (write.concat(), read.concat())
}

#[test]
fn what_the_snippets_write_is_read_and_the_other_way_round() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (write, read) = snippets();
    run(&python, folder.path(), &format!("{GIVEN}{write}"));

    let released = stage::read_released::<3>(&at("map.parquet")).unwrap();
    let Obfuscation::Lines(lines) = released.obfuscation() else {
        panic!("{} is not lines", released.obfuscation().family());
    };
    assert_eq!(lines.len(), 10);
    let widen = |rows: &[[f32; 3]]| -> Vec<_> { rows.iter().map(|r| r.map(f64::from)).collect() };
    assert_eq!(*lines, Lines::through(&widen(lines.foot()), &widen(lines.direction())).unwrap());
    let lists = stage::read_neighborhoods(&at("neighborhoods.parquet"), 10, 1).unwrap();
    assert_eq!(lists.of(2)[..3], [0, 1, 3].map(RecordId));
    let (original, secret) = stage::read_truth::<3>(&at("truth.parquet")).unwrap();
    assert_eq!((original.len(), secret.n_slots(), secret.slots_per_record()), (12, 10, 1));
    assert_eq!((secret.hidden()[0].0, secret.dropped()[1].original.0), (9, 11));
    assert_eq!(secret.dropped()[0].reason, DropReason::Other);
    assert_eq!(original.reveal().positions()[5], [1.0, 0.0, 1.0]);
    let points = stage::read_point_neighborhoods(&at("points.parquet"), 12).unwrap();
    assert_eq!(points.of(1)[..2], [0, 2]);
    let found = stage::read_recovered::<3>(&at("found.parquet")).unwrap();
    assert_eq!(found.status().iter().filter(|&&status| status == Status::Ok).count(), 8);
    assert_eq!((found.position(0), found.position(4)), (Some([2.0, 0.0, 1.0]), None));
    let images = at("images.parquet");
    let mut images = ImageFile::open(&images, Kind::Released).unwrap();
    for n in [3, 1, 20000] {
        let image = images.next_image().unwrap().unwrap();
        assert_eq!(image.name(), format!("{n}.jpg"));
        let image = image.released().unwrap();
        assert_eq!((image.n_records(), image.unit()), (n, Unit::Pixel));
        assert_eq!(image.bounds().unwrap().high, [639.5, 479.5]);
    }
    assert!(images.next_image().unwrap().is_none());

    // The snippets read what unlift wrote.
    stage::write_released(&at("released.parquet"), &released).unwrap();
    stage::write_neighborhoods(&at("neighborhoods.parquet"), &lists).unwrap();
    stage::write_truth(&at("truth.parquet"), &original, &secret).unwrap();
    stage::write_recovered(&at("recovered.parquet"), &found).unwrap();
    let import = "import json, pyarrow as pa, pyarrow.parquet as pq\n";
    let told = run(&python, folder.path(), &format!("{import}{read}"));
    let expected = "10 lines of 1 points, in m, 10 lists\n80.0% of 10 points, half within 0.00 m\n";
    assert_eq!(told, expected);
}
