//! `docs/claims.py` on a miniature of 7-Scenes: the paper's figures beside those of an audit.

use std::path::Path;
use std::process::Command;

use crate::common::{Place, texts};
use crate::layouts;

#[test]
fn the_papers_figures_stand_beside_ours() {
    if Command::new("python3").arg("--version").output().is_err() {
        return eprintln!("skipped: no python3");
    }
    let place = Place::empty();
    let photos = layouts::seven_scenes(&place, "d/chess", 5);
    // The map is half as large as the room.
    layouts::model(&place, "d/7scenes_sfm_triangulated/chess/triangulated", &photos, 2.0);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/claims.py");
    let claims = |line: &str| {
        let mut python = Command::new("python3");
        python.arg(&script).args(line.split(' ')).current_dir(place.path("."));
        texts(&python.args(["--unlift", env!("CARGO_BIN_EXE_unlift")]).output().unwrap())
    };
    let (text, stderr) = claims("d --table 1,7 --images 2 --out claims.csv --work o");
    assert!(
        stderr.contains("not here: fire, heads, office, pumpkin, redkitchen, stairs: "),
        "{stderr}"
    );
    let map = place.json("o/chess/map-sift-oracle/audit.json");
    assert_eq!(map["input"]["scale_m_per_unit"], 2.0);
    let images = place.json("o/chess/images-sift-oracle/audit.json");
    assert_eq!(images["input"]["images"]["used"], 2);
    let largest = |audit: &serde_json::Value, scheme: &str, threshold: &str| {
        let rows = audit["results"].as_array().unwrap().iter();
        let of = rows.filter(|row| row["scheme"] == scheme && row["inlier_ratio"] == 0.5);
        of.filter_map(|row| row["recovered_percent"][threshold].as_f64()).fold(0.0, f64::max)
    };
    let table = place.text("claims.csv");
    for (row, audit, scheme, threshold) in [
        ("7,7-scenes 3D,sift,cp,oracle 0.5,% within 0.1 m,67.7,", &map, "cp", "0.1"),
        ("1,7-scenes 2D,sift,lines2d,oracle 0.5,% within 10 px,", &images, "lines2d", "10"),
    ] {
        let line = table.lines().find_map(|line| line.strip_prefix(row)).expect(row);
        let ours: Vec<f64> = line.split(',').rev().take(3).filter_map(|x| x.parse().ok()).collect();
        let expected = largest(audit, scheme, threshold);
        assert!((ours[2] - expected).abs() < 0.1 && ours[0] == 1.0, "{line}: {expected}");
    }
    assert_eq!(text.lines().count(), table.lines().count());
    assert!(
        claims("--list").0.contains("table 13: density attacks on maps: 12-scenes; 18 figures")
    );
    assert!(claims("empty").1.contains("expected folders of scenes in empty, or --scale"));
}
