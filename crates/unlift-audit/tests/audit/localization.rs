//! Localization in audits of a COLMAP model: bound, held-out images, gates.

use std::path::Path;
use std::sync::Arc;

use tempfile::TempDir;
use unlift::Descriptors;
use unlift::descriptors::Values;
use unlift::geometry::camera::{Camera, Intrinsics, Pose};
use unlift::localization::Localization;
use unlift::obfuscate::{Change, Changed, Mitigation};
use unlift::recover::Builtin;
use unlift::seed::{Draws, Stage};
use unlift_audit::localization::{self, Localize};
use unlift_audit::{Audited, Input, Map, Preparation, Prepared, Quiet, maps};
use unlift_io::features::{FeatureWriter, ImageFeatures};

use crate::{audited, plan};

const N_IMAGES: u32 = 12;
const DIM: usize = 32;

/// Returns the camera of an image: on a line, looking along +y.
fn camera(image: u32) -> Camera {
    let center = [1.5 + 0.2 * f64::from(image), 0.4 + 0.05 * f64::from(image % 3), 1.2];
    let rotation = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
    let intrinsics = Intrinsics { focal: [500.0; 2], principal: [320.0, 240.0] };
    Camera { intrinsics, pose: Pose { rotation, center } }
}

/// Writes a COLMAP model of random points, and features of its images with noise of half a pixel and similar descriptors.
fn model() -> TempDir {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let mut draws = Draws::new(4, Stage::Shapes, 0);
    let mut point = |_| [draws.between(0.0, 5.0), draws.between(3.0, 5.0), draws.between(0.0, 2.5)];
    let points: Vec<[f64; 3]> = (0..1_500).map(&mut point).collect();
    let (mut images, mut tracks) = (String::new(), vec![String::new(); points.len()]);
    let mut writer = FeatureWriter::create(&folder.join("features.h5")).unwrap();
    for image in 0..N_IMAGES {
        let (camera, name) = (camera(image), format!("{image:02}.jpg"));
        // A quarter turn about x.
        let half = 0.5_f64.sqrt();
        let [x, y, z] = camera.pose.translation();
        images += &format!("{} {half} {half} 0 0 {x} {y} {z} 1 {name}\n\n", image + 1);
        let [mut of_places, mut of_values] =
            [1, 2].map(|seed| Draws::new(seed, Stage::Shapes, image.into()));
        let (mut keypoints, mut values) = (Vec::new(), Vec::new());
        for (row, point) in points.iter().enumerate() {
            let is_seen =
                |p: &[f64; 2]| (1.0..639.0).contains(&p[0]) && (1.0..479.0).contains(&p[1]);
            let Some(place) = camera.project(point).filter(is_seen) else { continue };
            tracks[row] += &format!(" {} {}", image + 1, keypoints.len());
            keypoints.push(place.map(|p| p - 0.5 + 0.3 * of_places.normal()));
            let mut own = Draws::new(3, Stage::Shapes, row as u64);
            values.extend((0..DIM).map(|_| (own.normal() + 0.2 * of_values.normal()) as f32));
        }
        let descriptors = Some(Descriptors::try_new(Values::F32(values), DIM).unwrap());
        let size = Some([640, 480]);
        let image = ImageFeatures { name, size, keypoints, descriptors, ..Default::default() };
        writer.append(&image).unwrap();
    }
    writer.finish().unwrap();
    let line = |(row, ([x, y, z], track)): (usize, (&[f64; 3], &String))| {
        format!("{} {x} {y} {z} 0 0 0 0.5{track}\n", row + 1)
    };
    let points: String = points.iter().zip(&tracks).enumerate().map(line).collect();
    std::fs::write(folder.join("cameras.txt"), "1 PINHOLE 640 480 500 500 320 240\n").unwrap();
    std::fs::write(folder.join("images.txt"), images).unwrap();
    std::fs::write(folder.join("points3D.txt"), points).unwrap();
    temporary
}

fn open(folder: &Path) -> Prepared {
    let preparation = Preparation { scale: Some(1.0), k: 20, ..Preparation::default() };
    maps::open(folder, None, &preparation).unwrap()
}

fn audit(folder: &Path, mitigate: &[&str], gates: &[&str], held_out: bool) -> Audited {
    let prepared = open(folder);
    let mut plan = plan(&["olc", "plane"]);
    let change = |text: &&str| {
        let tracks = Some(Arc::clone(&prepared.cameras.tracks));
        Change::Mitigation(Mitigation::parse(text).unwrap(), tracks)
    };
    let changes: Vec<Change> = mitigate.iter().map(change).collect();
    plan.schemes.extend(Changed::all(&plan.schemes[..1], &changes));
    plan.solvers = vec![Arc::new(Builtin::Consensus)];
    let held_out = held_out.then(|| (folder.join("features.h5"), 4));
    let localize = Localize { held_out, protections: Vec::new() };
    let map = Map { plan, localize: Some(localize), ..Map::new(&prepared) };
    audited(&prepared, &Input::Map(map), gates).unwrap()
}

fn of<'a>(audited: &'a Audited, scheme: &str) -> &'a Localization {
    audited.document.localization.iter().find(|one| one.scheme == scheme).expect(scheme)
}

#[test]
fn an_audit_of_a_model_with_tracks_says_what_protection_costs() {
    let folder = model();
    let gates = ["olc:localization<=2.0", "olc:localization<=1.1", "plane:localization<=5"];
    let audited = audit(folder.path(), &["thin:1/4", "bits:2"], &gates, false);
    audited.document.check().unwrap();
    let names: Vec<&str> =
        audited.document.localization.iter().map(|one| one.scheme.as_str()).collect();
    let all = ["none", "olc", "plane", "olc_thin4", "olc_bits2", "lines2d", "cp2d", "dcl2d"];
    assert_eq!(names, all);
    assert_eq!(of(&audited, "none").multiple, Some(1.0));
    // One row of two per match costs about the root of two; a quarter of the points twice that.
    let olc = of(&audited, "olc").multiple.unwrap();
    let thin = of(&audited, "olc_thin4").multiple.unwrap();
    assert!((1.2..1.8).contains(&olc), "{olc}");
    assert!((1.8..2.3).contains(&(thin / olc)), "{thin}, {olc}");
    let plane = of(&audited, "plane");
    assert_eq!((plane.multiple, plane.failed_percent), (None, 100.0));
    assert!(of(&audited, "olc_bits2").is_unknown());
    let passed: Vec<bool> = audited.document.gates.iter().map(|gate| gate.passed).collect();
    assert_eq!(passed, [true, false, false]);
    let reason = audited.document.gates[2].reason.as_deref();
    assert_eq!(reason, Some("plane: most images do not localize"));
    // Names and poses of images do not appear.
    let page = audited.page(true).unwrap();
    assert!(page.contains("What protection costs") && !page.contains("03.jpg"));
    assert!(page.contains("olc_bits2, whose descriptors are changed"));
}

#[test]
fn held_out_images_are_localized() {
    let folder = model();
    let audited = audit(folder.path(), &["bits:1"], &["all:localization<=4"], true);
    audited.document.check().unwrap();
    let held_out = |scheme: &str| of(&audited, scheme).held_out.as_ref().unwrap();
    let none = held_out("none");
    assert_eq!((none.n_images, none.multiple), (3, Some(1.0)));
    assert!(none.right_matches > 0.9 * none.matches && none.matches > 100.0, "{none:?}");
    // Noise of 0.4 px over some hundred points 3 m away.
    assert!(none.center_error.unwrap() < 0.01, "{none:?}");
    for scheme in ["olc", "lines2d", "olc_bits1"] {
        let one = held_out(scheme);
        assert!(one.center_error.unwrap() < 0.02, "{scheme}: {one:?}");
        assert_eq!(one.recall_percent["5 cm, 5 deg"], 100.0, "{scheme}");
    }
    assert!(held_out("plane").center_error.is_none());
    assert!(held_out("olc_bits1").matches < held_out("olc").matches);
    // The plane does not localize, so a gate on all schemes fails.
    assert!(!audited.document.gates[0].passed);
}

#[test]
fn photos_of_another_size_are_refused() {
    let folder = model();
    let camera = "1 PINHOLE 1280 960 1000 1000 640 480\n";
    std::fs::write(folder.path().join("cameras.txt"), camera).unwrap();
    let Prepared { cameras, original, .. } = open(folder.path());
    let features = folder.path().join("features.h5");
    let error =
        localization::open(&features, 4, &cameras, &original, &Quiet).err().unwrap().to_string();
    let expected = "expected 1280 x 960 pixels, as its camera in the model, found 640 x 480";
    assert!(error.ends_with(expected), "{error}");
}

#[test]
fn a_model_without_tracks_is_silent_and_a_gate_on_it_is_told() {
    let folder = model();
    std::fs::remove_file(folder.path().join("images.txt")).unwrap();
    let prepared = open(folder.path());
    assert!(prepared.cameras.views.is_empty());
    let input = Input::Map(Map::new(&prepared));
    let error = audited(&prepared, &input, &["olc:localization<=2"]).err().unwrap().to_string();
    let expected = "--gate olc:localization<=2: expected a COLMAP model with cameras and tracks, not in tiles, found none";
    assert_eq!(error, expected);
}
