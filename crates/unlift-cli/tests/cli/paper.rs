//! `unlift paper` on miniatures of its datasets: what is found, missing or refused.

use std::fs;

use serde_json::Value;

use crate::common::Place;
use crate::layouts;

/// Returns our number for this table, scheme, measure and ratio.
fn ours(paper: &Value, (table, scheme): (u64, &str), measure: &str, ratio: Option<f64>) -> f64 {
    let numbers = paper["numbers"].as_array().unwrap().iter();
    let mut fits = numbers.filter(|number| {
        (number["table"].as_u64(), number["scheme"].as_str()) == (Some(table), Some(scheme))
            && number["measure"] == measure
            && number["features"] == "sift"
            && number["inlier_ratio"].as_f64() == ratio
    });
    let number = fits.next().unwrap_or_else(|| panic!("table {table}: {scheme}, {measure}"));
    assert!(fits.next().is_none(), "one number: {number}");
    number["ours"].as_f64().unwrap_or_else(|| panic!("nothing of ours: {number}"))
}

/// Returns the largest share of an audit.
fn largest(audit: &Value, scheme: &str, ratio: f64, threshold: &str) -> f64 {
    let rows = audit["results"].as_array().unwrap().iter();
    let of = rows.filter(|row| {
        row["scheme"] == scheme && row["neighbors"] == "oracle" && row["inlier_ratio"] == ratio
    });
    of.filter_map(|row| row["recovered_percent"][threshold].as_f64()).fold(0.0, f64::max)
}

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-3, "{found}, expected {expected}");
}

fn names(audit: &Value) -> Vec<&str> {
    let images = audit["images"].as_array().unwrap().iter();
    images.map(|image| image["name"].as_str().unwrap()).collect()
}

/// Runs `paper` on a dataset in `d`, and returns stdout.
fn table_of(place: &Place, line: &str) -> String {
    place.ends(&format!("paper --quiet --out o --dataset {line}"), 0).0
}

#[test]
fn seven_scenes_with_a_published_map() {
    let place = Place::empty();
    let photos = layouts::seven_scenes(&place, "d/chess", 5);
    // The map is half as large as the room.
    layouts::model(&place, "d/7scenes_sfm_triangulated/chess/triangulated", &photos, 2.0);
    place.write("d/fire/TestSplit.txt", "sequence3\n");
    place.write("d/fire/seq-03.zip", "");
    let line = "7scenes d --images 2 --parts maps,images,estimated";
    let text = table_of(&place, line);
    for expected in [
        "table 1: images of 7-scenes, SIFT: percent within 5 px / percent within 10 px / percent within 25 px; mean of 1 \
         of 7 scenes",
        "table 7: maps of 7-scenes, SIFT: percent within 0.10 m / percent within 0.25 m; mean of 1 of 7 scenes",
        "missing: all tables: 5 of 7 scenes (heads, office, pumpkin, redkitchen, stairs): https://",
        "missing: tables 1, 4: photos of fire: seq-03 is still packed (unzip seq-03.zip): https://",
        "missing: table 7: maps of fire, looked for in SCENE and 7scenes_sfm_triangulated/SCENE",
        "missing: table 4, superpoint: ",
        "estimated ",
        " [47.3/68.1]",
        "figures: o/paper.json; pages of 2 audits below o\n",
    ] {
        assert!(text.contains(expected), "{expected}\n--\n{text}");
    }
    let (paper, map) = (place.json("o/paper.json"), place.json("o/chess/map/audit.json"));
    near(map["input"]["scale_m_per_unit"].as_f64().unwrap(), 2.0);
    let found = ours(&paper, (7, "olc"), "percent within 0.25 m", Some(0.1));
    near(found, largest(&map, "olc", 0.1, "0.25"));
    assert!(found > 0.0);
    // Two of the five photos of the split, and no depth images.
    let images = place.json("o/chess/images/audit.json");
    assert_eq!(names(&images), [&*photos[1], &*photos[3]]);
    let found = ours(&paper, (1, "cp2d"), "percent within 10 px", Some(0.5));
    near(found, largest(&images, "cp2d", 0.5, "10"));
    let estimated = ours(&paper, (4, "lines2d"), "percent within 25 px", None);
    assert!(estimated > 0.0 && estimated <= 100.0, "{estimated}");
    // A second run writes the same bytes.
    let files = || ["o/paper.json", "o/paper.csv"].map(|name| place.bytes(name));
    let before = files();
    let whole = table_of(&place, &format!("{line} --threads 1 --json"));
    assert!(files() == before);
    assert_eq!(serde_json::from_str::<Value>(&whole).unwrap(), paper);
    let n_numbers = paper["numbers"].as_array().unwrap().len();
    assert_eq!(place.text("o/paper.csv").lines().count(), 1 + n_numbers);
}

#[test]
fn twelve_scenes_by_its_first_sequence() {
    let place = Place::empty();
    layouts::twelve_scenes(&place, "d/apt1/kitchen", 2, 4);
    let text = table_of(&place, "12scenes d --parts maps,images");
    for expected in [
        "table 5: images of 12-scenes, SIFT: ",
        "missing: table 8: maps of apt1/kitchen, looked for in SCENE (",
        "not here: table 13",
    ] {
        assert!(text.contains(expected), "{expected}\n--\n{text}");
    }
    let images = place.json("o/apt1/kitchen/images/audit.json");
    assert_eq!(names(&images), ["frame-000000.color.jpg", "frame-000001.color.jpg"]);
    // `--models` names another folder of maps; the poses beside the photos give their scale.
    let frames: Vec<String> = (0..4).map(|at| format!("data/frame-{at:06}.color.jpg")).collect();
    layouts::model(&place, "m/apt1/kitchen/sparse/0", &frames, 0.25);
    table_of(&place, "12scenes d --models m --parts maps --max-points 150");
    let (paper, map) = (place.json("o/paper.json"), place.json("o/apt1/kitchen/map/audit.json"));
    near(map["input"]["scale_m_per_unit"].as_f64().unwrap(), 0.25);
    assert_eq!(map["options"]["max_points"], 150);
    let found = ours(&paper, (8, "plane"), "percent within 0.25 m", Some(1.0));
    near(found, largest(&map, "plane", 1.0, "0.25"));
}

#[test]
fn cambridge_in_the_pixels_of_the_paper() {
    let place = Place::empty();
    let photos = ["seq1/frame00001.png", "seq1/frame00002.png"];
    layouts::cambridge(&place, "d/ShopFacade", &photos);
    fs::remove_file(place.path("d/ShopFacade/seq1/frame00002.png")).unwrap();
    let text = table_of(&place, "cambridge d --scenes ShopFacade --parts maps,images");
    let one = "missing: table 1: photos of ShopFacade: 1 of the 2 photos of dataset_test.txt";
    assert!(text.contains(one), "{text}");
    assert!(!text.contains("all tables"), "only one scene was asked for: {text}");
    let [paper, images, map] =
        ["paper.json", "ShopFacade/images/audit.json", "ShopFacade/map/audit.json"]
            .map(|name| place.json(&format!("o/{name}")));
    // Photos have twice the usual size, so 10 pixels of the paper are 20.
    let found = ours(&paper, (1, "lines2d"), "percent within 10 px", Some(1.0));
    near(found, largest(&images, "lines2d", 1.0, "20"));
    near(map["input"]["scale_m_per_unit"].as_f64().unwrap(), 1.0);
    let found = ours(&paper, (9, "ppl+"), "percent within 0.50 m", Some(0.5));
    near(found, largest(&map, "ppl+", 0.5, "0.50"));
}

#[test]
fn pictures_of_photos_and_of_maps_with_descriptors() {
    let place = Place::empty();
    let photos = layouts::seven_scenes(&place, "d/heads", 4);
    layouts::model(&place, "d/heads/sparse/0", &photos, 1.0);
    let text = table_of(&place, "7scenes d --images 1 --parts pictures");
    let missing = "missing: table 10: descriptors of the map of heads: database.db";
    assert!(text.contains(missing), "{text}");
    assert!(text.contains("table 3: images of 7-scenes, SIFT: SSIM; "), "{text}");
    let paper = place.json("o/paper.json");
    let ssim = |scheme, ratio| ours(&paper, (3, scheme), "SSIM", ratio);
    assert!(ssim("none", None) > 0.0 && ssim("cp2d", Some(0.2)) <= 1.0);
    assert!(!place.path("o/heads/map").exists());

    layouts::database(&place, "d/heads/database.db", &photos);
    fs::remove_file(place.path("d/heads/TestSplit.txt")).unwrap();
    // One photo suffices here, and takes a quarter of the time.
    photos[1..].iter().for_each(|name| fs::remove_file(place.path("d/heads").join(name)).unwrap());
    let text = table_of(&place, "7scenes d --parts pictures");
    assert!(text.contains("table 10: maps of 7-scenes, SIFT: SSIM / PSNR / LPIPS"), "{text}");
    let paper = place.json("o/paper.json");
    let lpips = |scheme, ratio| ours(&paper, (10, scheme), "LPIPS", ratio);
    assert!(lpips("none", None) > 0.0 && lpips("plane", Some(0.1)) > 0.0);
}

#[test]
fn what_is_wrong_is_one_line() {
    let place = Place::empty();
    fs::create_dir(place.path("empty")).unwrap();
    place.write("a/chess/TestSplit.txt", "sequence1\nseq-02\n");
    place.write("b/apt1/kitchen/split.txt", "sequence0\n");
    fs::create_dir(place.path("b/apt1/kitchen/data")).unwrap();
    place.write("c/OldHospital/dataset_test.txt", "a\nb\n\n../x.png 1 2 3 1 0 0 0\n");
    place.write("e/OldHospital/dataset_test.txt", "\n");
    for (line, code, expected) in [
        (
            "7scenes empty",
            3,
            "empty: expected a folder of chess, fire, heads, office, pumpkin, redkitchen, stairs, found none of them",
        ),
        ("7scenes nowhere", 3, "nowhere: expected a file or folder, found nothing"),
        ("7scenes a", 3, "a/chess/TestSplit.txt:2: expected sequenceN, found \"seq-02\""),
        (
            "12scenes b",
            3,
            "b/apt1/kitchen/split.txt:1: expected a first sequence as sequence0 [frames=N] .., found \"sequence0\"",
        ),
        (
            "cambridge c",
            3,
            "c/OldHospital/dataset_test.txt:4: expected a photo, X Y Z and W P Q R, found \"../x.png 1 2 3 1 0 0 0\"",
        ),
        (
            "cambridge e --scenes Street",
            2,
            "--scenes: expected some of KingsCollege, OldHospital, ShopFacade, StMarysChurch, GreatCourt, found Street",
        ),
        (
            "cambridge e",
            3,
            "e: expected photos of a test split, or a map of a scene in meters, found none",
        ),
    ] {
        let told = place.complains(&format!("paper --quiet --out o --dataset {line}"), code);
        assert!(!place.path("o").exists(), "{line}");
        assert_eq!(told.lines().last(), Some(&*format!("unlift: {expected}")), "{told}");
    }
}

#[test]
fn a_map_of_another_scene_is_refused_and_others_go_on() {
    let place = Place::empty();
    let photos = layouts::seven_scenes(&place, "d/chess", 6);
    layouts::model(&place, "d/chess/sfm", &photos, 1.0);
    let pose = |at: usize| format!("d/chess/{}", photos[at].replace("color.png", "pose.txt"));
    // The poses of the photos are turned: no scale fits.
    for at in 0..photos.len() {
        let text = format!("1 0 0 {}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", at * at * at);
        place.write(&pose(at), text);
    }
    let line = "paper --dataset 7scenes d --parts maps,images --images 1 --quiet --out o";
    let (text, stderr) = place.ends(line, 3);
    assert!(text.contains("table 1: images"), "{text}");
    assert!(
        stderr.contains("images.txt: expected camera distances that have one ratio"),
        "{stderr}"
    );
    assert!(text.contains("failed: chess, map: "), "{text}");
    // `--scale` overrides the poses.
    place.ends(&format!("{line} --scale 1"), 0);
    place.write(&pose(2), "1 0 0\n");
    let told = "pose.txt:1: expected 4 numbers of a row of a pose, found \"1 0 0\"";
    assert!(place.ends(line, 3).1.contains(told));
}
