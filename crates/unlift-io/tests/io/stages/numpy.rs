//! Runs the Python of docs/formats.md, and reads with NumPy what unlift writes and the reverse.

use std::path::Path;
use std::process::Command;

use unlift::recover::Status;
use unlift::released::{Lines, Obfuscation};
use unlift::truth::DropReason;
use unlift::{RecordId, Unit};
use unlift_io::stage::{self, ImageFile, Kind};

use super::round_trip::values_come_back;

/// The data that the document assumes: 12 points on a grid.
const GIVEN: &str = r#"
import numpy as np
points = np.array([[x, y, z] for x in range(3) for y in range(2) for z in range(2)], float)
records = np.array([[r for r in range(10) if r != own] for own in range(10)])
near = np.array([[q for q in range(12) if q != p] for p in range(12)])
photos = {f"a/{n}.jpg": ((640, 480), np.full((n, 2), 9.0 * n), np.ones((n, 2))) for n in (3, 1, 2000)}
back = np.where(np.arange(10)[:, None] % 5 == 4, np.nan, points[:10])
"#;

fn run(folder: &Path, script: &str) -> Option<String> {
    let python =
        |script: &str| Command::new("python3").args(["-c", script]).current_dir(folder).output();
    if !python("import numpy").is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: python3 with numpy is not installed");
        return None;
    }
    let output = python(script).unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}\nof the script\n{script}");
    Some(String::from_utf8(output.stdout).unwrap())
}

#[test]
fn the_snippets_of_the_document_run() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let document = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats.md");
    let document = std::fs::read_to_string(document).unwrap();
    let blocks = document.split("```python\n").skip(1);
    let snippets: Vec<&str> = blocks.filter_map(|block| block.split("```").next()).collect();
    let [own, write, read] = snippets[..] else { panic!("{} snippets", snippets.len()) };
    if run(folder.path(), &format!("{GIVEN}{own}{write}")).is_none() {
        return;
    }
    let released = stage::read_released::<3>(&at("mine.npz")).unwrap();
    assert_eq!((released.n_records(), released.unit()), (10, Unit::Meter));
    assert_eq!(stage::scheme_name(&at("mine.npz")).unwrap().as_deref(), Some("my-lines"));
    let (original, secret) = stage::read_truth::<3>(&at("truth.npz")).unwrap();
    assert_eq!((original.len(), secret.n_slots(), secret.slots_per_record()), (12, 10, 1));
    assert_eq!((secret.map(), secret.dropped()[0].reason), (None, DropReason::Other));
    assert_eq!(original.reveal().positions()[5], [1.0, 0.0, 1.0]);
    // Each line passes through its point.
    let Obfuscation::Lines(lines) = released.obfuscation() else { panic!("lines") };
    for (slot, hidden) in secret.hidden().iter().enumerate() {
        let point = original.reveal().positions()[hidden.index()];
        let through = Lines::through(&[point], &[lines.direction()[slot].map(f64::from)]).unwrap();
        let apart = (0..3).map(|c| (through.foot()[0][c] - lines.foot()[slot][c]).abs());
        assert!(apart.fold(0.0, f32::max) < 1e-5, "slot {slot}");
    }
    let lists = stage::read_neighborhoods(&at("neighborhoods.npz"), 10, 1).unwrap();
    assert_eq!(lists.of(2)[..3], [0, 1, 3].map(RecordId));
    let points = stage::read_point_neighborhoods(&at("points.npz"), 12).unwrap();
    assert_eq!(points.of(1)[..2], [0, 2].map(RecordId));
    let back = stage::read_recovered::<3>(&at("back.npz"), None).unwrap();
    assert_eq!(back.status().iter().filter(|&&status| status == Status::Ok).count(), 8);
    assert_eq!((back.position(1), back.position(4)), (Some([0.0, 0.0, 1.0]), None));
    let images = at("images.npz");
    assert!(stage::has_images(&images).unwrap() && !stage::has_images(&at("back.npz")).unwrap());
    let mut images = ImageFile::open(&images, Kind::Released).unwrap();
    for n in [3, 1, 2000] {
        let image = images.next_image().unwrap().unwrap();
        assert_eq!(image.name(), format!("a/{n}.jpg"));
        let image = image.released().unwrap();
        assert_eq!((image.n_records(), image.unit()), (n, Unit::Pixel));
        assert_eq!(image.bounds().unwrap().high, [639.5, 479.5]);
    }
    assert!(images.next_image().unwrap().is_none());

    // The last snippet reads what unlift wrote.
    stage::write_released(&at("released.npz"), &released, None).unwrap();
    stage::write_neighborhoods(&at("neighborhoods.npz"), &lists).unwrap();
    stage::write_truth(&at("truth.npz"), &original, &secret).unwrap();
    stage::write_recovered(&at("recovered.npz"), &back).unwrap();
    let printed = run(folder.path(), &format!("import json, numpy as np\n{read}")).unwrap();
    assert!(printed.starts_with("80% of 10 lines, ") && printed.ends_with(" m\n"), "{printed}");
}

/// NumPy rewrites files of every kind and family: compressed, in Fortran's order, big-endian and wider. The values stay.
#[test]
fn numpy_writes_the_same_values_in_every_form() {
    let folder = tempfile::tempdir().unwrap();
    let rewrite = r#"
import numpy as np
arrays, wide = dict(np.load("a.npz")), {"f": ">f8", "i": ">i8", "u": "<i8"}
of = lambda a: np.asfortranarray(a.astype(wide[a.dtype.kind])) if a.dtype.kind in wide else a
np.savez_compressed("a.npz", **{name: of(array) for name, array in arrays.items()})
"#;
    if run(folder.path(), "").is_some() {
        // Descriptors of floats stay floats, those of bytes become whole numbers.
        let change = |_: &Path| drop(run(folder.path(), rewrite));
        values_come_back::<3>(folder.path(), &[30, 31], change);
    }
}
