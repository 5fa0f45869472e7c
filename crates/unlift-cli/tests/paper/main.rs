//! The paper's tables on miniatures of its datasets: what is found, what is missing, what is refused.

#[path = "../common/mod.rs"]
mod common;
mod layouts;

use std::fs;

use common::Place;
use serde_json::Value;

fn json(place: &Place, file: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(place.path(file)).expect(file)).unwrap()
}

/// Our number of this table, scheme, measure and ratio.
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

/// The largest share of an audit.
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

#[test]
fn seven_scenes_with_a_published_map() {
    let place = Place::with_photos(&[]);
    let root = place.path("d");
    let names = layouts::seven_scenes(&root.join("chess"), 5);
    // The map is half as large as the room.
    layouts::model(&root.join("7scenes_sfm_triangulated/chess/triangulated"), &names, 2.0);
    layouts::put(&root.join("fire/TestSplit.txt"), "sequence3\n");
    layouts::put(&root.join("fire/seq-03.zip"), "");
    let line = "paper --dataset 7scenes d --images 2 --parts maps,images,estimated --quiet --out o";
    let (text, _) = place.ends(line, 0);
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
    let (paper, map) = (json(&place, "o/paper.json"), json(&place, "o/chess/map/audit.json"));
    near(map["input"]["scale_m_per_unit"].as_f64().unwrap(), 2.0);
    for (ratio, typed, measure) in
        [(1.0, "0.10", "percent within 0.10 m"), (0.1, "0.25", "percent within 0.25 m")]
    {
        let found = ours(&paper, (7, "olc"), measure, Some(ratio));
        near(found, largest(&map, "olc", ratio, typed));
        assert!(found > 0.0);
    }
    // Two of the five photos of the split, and none of the depth.
    let images = json(&place, "o/chess/images/audit.json");
    let used: Vec<&str> = images["images"]
        .as_array()
        .unwrap()
        .iter()
        .map(|image| image["name"].as_str().unwrap())
        .collect();
    assert_eq!(used, [&*names[1], &*names[3]]);
    let found = ours(&paper, (1, "cp2d"), "percent within 10 px", Some(0.5));
    near(found, largest(&images, "cp2d", 0.5, "10"));
    let estimated = ours(&paper, (4, "lines2d"), "percent within 25 px", None);
    assert!(estimated > 0.0 && estimated <= 100.0, "{estimated}");
    // Again: the same bytes.
    let files = ["o/paper.json", "o/paper.csv"].map(|name| fs::read(place.path(name)).unwrap());
    let (whole, _) = place.ends(&format!("{line} --threads 1 --json"), 0);
    let again = ["o/paper.json", "o/paper.csv"].map(|name| fs::read(place.path(name)).unwrap());
    assert!(files == again);
    assert_eq!(serde_json::from_str::<Value>(&whole).unwrap(), paper);
    let csv = String::from_utf8(again[1].clone()).unwrap();
    assert_eq!(csv.lines().count(), 1 + paper["numbers"].as_array().unwrap().len());
}

#[test]
fn twelve_scenes_by_its_first_sequence() {
    let place = Place::with_photos(&[]);
    layouts::twelve_scenes(&place.path("d/apt1/kitchen"), 2, 4);
    let line = "paper --dataset 12scenes d --parts maps,images --quiet --out o";
    let (text, _) = place.ends(line, 0);
    assert!(text.contains("table 5: images of 12-scenes, SIFT: "), "{text}");
    assert!(
        text.contains("missing: table 8: maps of apt1/kitchen, looked for in SCENE ("),
        "{text}"
    );
    assert!(text.contains("not here: table 13"), "{text}");
    let images = json(&place, "o/apt1/kitchen/images/audit.json");
    let names = images["images"].as_array().unwrap().iter().map(|image| image["name"].clone());
    assert_eq!(names.collect::<Vec<_>>(), ["frame-000000.color.jpg", "frame-000001.color.jpg"]);
    // A map of its own, in a folder of maps; in meters by the poses beside the photos.
    let frames: Vec<String> = (0..4).map(|at| format!("data/frame-{at:06}.color.jpg")).collect();
    layouts::model(&place.path("m/apt1/kitchen/sparse/0"), &frames, 0.25);
    let line = "paper --dataset 12scenes d --models m --parts maps --max-points 150 --quiet --out o --json";
    let (text, _) = place.ends(line, 0);
    let paper: Value = serde_json::from_str(&text).unwrap();
    let map = json(&place, "o/apt1/kitchen/map/audit.json");
    near(map["input"]["scale_m_per_unit"].as_f64().unwrap(), 0.25);
    assert_eq!(map["options"]["max_points"], 150);
    let found = ours(&paper, (8, "plane"), "percent within 0.25 m", Some(1.0));
    near(found, largest(&map, "plane", 1.0, "0.25"));
}

#[test]
fn cambridge_in_the_pixels_of_the_paper() {
    let place = Place::with_photos(&[]);
    let photos = ["seq1/frame00001.png", "seq1/frame00002.png"];
    layouts::cambridge(&place.path("d/ShopFacade"), &photos, 2048);
    fs::remove_file(place.path("d/ShopFacade/seq1/frame00002.png")).unwrap();
    let line =
        "paper --dataset cambridge d --scenes ShopFacade --parts maps,images --quiet --out o";
    let (text, _) = place.ends(line, 0);
    assert!(
        text.contains(
            "missing: table 1: photos of ShopFacade: 1 of the 2 photos of dataset_test.txt"
        ),
        "{text}"
    );
    assert!(!text.contains("all tables"), "only one scene was asked for: {text}");
    let (paper, images) =
        (json(&place, "o/paper.json"), json(&place, "o/ShopFacade/images/audit.json"));
    // Photos of twice the size: 10 pixels of the paper are 20.
    let found = ours(&paper, (1, "lines2d"), "percent within 10 px", Some(1.0));
    near(found, largest(&images, "lines2d", 1.0, "20"));
    let map = json(&place, "o/ShopFacade/map/audit.json");
    near(map["input"]["scale_m_per_unit"].as_f64().unwrap(), 1.0);
    let found = ours(&paper, (9, "ppl+"), "percent within 0.50 m", Some(0.5));
    near(found, largest(&map, "ppl+", 0.5, "0.50"));
}

#[test]
fn pictures_where_there_are_descriptors() {
    let place = Place::with_photos(&[]);
    let names = layouts::seven_scenes(&place.path("d/heads"), 4);
    layouts::model(&place.path("d/heads/sparse/0"), &names, 1.0);
    let line = "paper --dataset 7scenes d --images 1 --parts pictures --quiet --out o";
    let (text, _) = place.ends(line, 0);
    assert!(
        text.contains("missing: table 10: descriptors of the map of heads: database.db"),
        "{text}"
    );
    assert!(text.contains("table 3: images of 7-scenes, SIFT: SSIM; "), "{text}");
    let paper = json(&place, "o/paper.json");
    let ssim = |table, scheme, ratio| ours(&paper, (table, scheme), "SSIM", ratio);
    assert!(ssim(3, "none", None) > 0.0 && ssim(3, "cp2d", Some(0.2)) <= 1.0);
    assert!(!place.path("o/heads/map").exists());
}

#[test]
fn pictures_of_a_map() {
    let place = Place::with_photos(&[]);
    let names = layouts::seven_scenes(&place.path("d/heads"), 4);
    layouts::model(&place.path("d/heads/sparse/0"), &names, 1.0);
    layouts::database(&place.path("d/heads/database.db"), &names);
    fs::remove_file(place.path("d/heads/TestSplit.txt")).unwrap();
    // One photo is as good as four here, and takes a quarter of the time.
    names[1..].iter().for_each(|name| fs::remove_file(place.path("d/heads").join(name)).unwrap());
    let (text, _) = place.ends("paper --dataset 7scenes d --parts pictures --quiet --out o", 0);
    assert!(text.contains("table 10: maps of 7-scenes, SIFT: SSIM / PSNR / LPIPS"), "{text}");
    let paper = json(&place, "o/paper.json");
    let lpips = |scheme, ratio| ours(&paper, (10, scheme), "LPIPS", ratio);
    assert!(lpips("none", None) > 0.0 && lpips("plane", Some(0.1)) > 0.0);
}

#[test]
fn what_is_wrong_is_one_line() {
    let place = Place::with_photos(&[]);
    let complaint = |line: &str, code| {
        let (stdout, stderr) = place.ends(&format!("paper --quiet --out o {line}"), code);
        assert!(stdout.is_empty() && !place.path("o").exists(), "{line}: {stdout}");
        stderr
    };
    fs::create_dir(place.path("empty")).unwrap();
    let scenes = "chess, fire, heads, office, pumpkin, redkitchen, stairs";
    assert_eq!(
        complaint("--dataset 7scenes empty", 3),
        format!("unlift: empty: expected a folder of {scenes}, found none of them\n")
    );
    assert_eq!(
        complaint("--dataset 7scenes nowhere", 3),
        "unlift: nowhere: expected a file or folder, found nothing\n"
    );
    layouts::put(&place.path("a/chess/TestSplit.txt"), "sequence1\nseq-02\n");
    assert_eq!(
        complaint("--dataset 7scenes a", 3),
        "unlift: a/chess/TestSplit.txt:2: expected sequenceN, found \"seq-02\"\n"
    );
    layouts::put(&place.path("b/apt1/kitchen/split.txt"), "sequence0\n");
    fs::create_dir(place.path("b/apt1/kitchen/data")).unwrap();
    assert_eq!(
        complaint("--dataset 12scenes b", 3),
        "unlift: b/apt1/kitchen/split.txt:1: expected a first sequence as sequence0 [frames=N] .., found \"sequence0\"\n"
    );
    layouts::put(&place.path("c/OldHospital/dataset_test.txt"), "a\nb\n\n../x.png 1 2 3 1 0 0 0\n");
    assert_eq!(
        complaint("--dataset cambridge c", 3),
        "unlift: c/OldHospital/dataset_test.txt:4: expected a photo, X Y Z and W P Q R, found \"../x.png 1 2 3 1 0 0 \
         0\"\n"
    );
    layouts::put(&place.path("c/OldHospital/dataset_test.txt"), "\n");
    assert_eq!(
        complaint("--dataset cambridge c --scenes Street", 2),
        "unlift: --scenes: expected some of KingsCollege, OldHospital, ShopFacade, StMarysChurch, GreatCourt, found Street\n"
    );
    let nothing = complaint("--dataset cambridge c", 3);
    assert!(nothing.contains("note: missing: table"), "{nothing}");
    assert!(
        nothing.ends_with("unlift: c: expected photos of a test split or a map of a scene, in meters, found none\n"),
        "{nothing}"
    );
}

#[test]
fn a_map_of_another_scene_is_refused_and_others_go_on() {
    let place = Place::with_photos(&[]);
    let names = layouts::seven_scenes(&place.path("d/chess"), 6);
    layouts::model(&place.path("d/chess/sfm"), &names, 1.0);
    // The poses of the photos are turned about: no scale fits.
    for (at, name) in names.iter().enumerate() {
        let text = format!("1 0 0 {}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", at * at * at);
        layouts::put(&place.path("d/chess").join(name.replace("color.png", "pose.txt")), text);
    }
    let line = "paper --dataset 7scenes d --parts maps,images --images 1 --quiet --out o";
    let (text, stderr) = place.ends(line, 3);
    assert!(text.contains("table 1: images"), "{text}");
    assert!(stderr.contains("images.txt: expected cameras as the dataset places them"), "{stderr}");
    assert!(text.contains("failed: chess, map: "), "{text}");
    // Who knows better says so.
    place.ends(&format!("{line} --scale 1"), 0);
    layouts::put(&place.path("d/chess").join(names[2].replace("color.png", "pose.txt")), "1 0 0\n");
    let (_, stderr) = place.ends(line, 3);
    assert!(
        stderr.contains("pose.txt:1: expected 4 numbers of a row of a pose, found \"1 0 0\""),
        "{stderr}"
    );
}
