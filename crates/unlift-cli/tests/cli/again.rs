//! `unlift audit again`: two maps in, rows by links out.

use crate::common::{Place, random, recovered, row, rows};

/// Creates a map in `a.csv`, a version without its last tenth in `b.csv`, and descriptors of both. Returns the points of the first.
fn maps() -> (Place, Vec<[f64; 3]>) {
    let unit = |at: usize| [0, 1, 2].map(|c| random(3 * at * at % 7907 + c * 131 + at));
    let points: Vec<[f64; 3]> =
        (0..300).map(unit).map(|[x, y, z]| [5.0 * x, 4.0 * y, 3.0 * z]).collect();
    let place = Place::empty();
    for (name, points) in [("a", &points[..]), ("b", &points[..270])] {
        place.write_points(&format!("{name}.csv"), points);
        place.write_descriptors(&format!("{name}.bin"), points, 128);
    }
    (place, points)
}

#[test]
fn two_releases_give_points_back_unless_they_are_gone_in_the_second() {
    let (place, _) = maps();
    let line = "audit again a.csv a.csv --scale 1 --descriptors a.bin --schemes olc,plane,olc/cp \
                --no-records-alone --out a";
    let (stdout, _) = place.ends(line, 0);
    assert!(stdout.contains("From two releases under olc, 100.0 % of the points"), "{stdout}");
    assert!(stdout.contains("not audited: plane, again-geometry"), "{stdout}");
    let document = place.json("a/audit.json");
    assert_eq!(rows(&document).len(), 5);
    for (scheme, by) in [("olc", "again"), ("olc", "again-geometry"), ("olc/cp", "again")] {
        let row = row(&document, scheme, by);
        assert!(recovered(row, "0.10") > 97.0, "{scheme} {by}");
        assert!(row["inlier_ratio"].as_f64() > Some(0.99), "{scheme} {by}");
    }
    let open = row(&document, "plane", "again")["metrics"]["open_percent"].as_f64();
    assert!(open > Some(99.0), "{open:?}");
    let audit = "audit again a.csv b.csv --scale 1 --schemes olc --no-records-alone";
    let expected = "--descriptors: expected one file for A and one for B";
    place.refuses(audit, &[("--descriptors a.bin", 2, expected)]);
    place.ends(&format!("{audit} --descriptors a.bin --descriptors b.bin --out a"), 0);
    for row in rows(&place.json("a/audit.json")) {
        let share = recovered(row, "0.10");
        assert!((85.0..=93.0).contains(&share), "{}: {share}", row["neighbors"]);
    }
    let (_, stderr) = place.ends(&format!("{audit} --share-safe --out s"), 0);
    assert!(stderr.contains("links by geometry only"), "{stderr}");
    assert!(!place.text("s/audit.json").contains(".csv"), "a safe document names no map");
}

/// Every run of SfM chooses its own frame and scale.
#[test]
fn no_gate_holds_if_the_maps_are_in_other_frames_or_scales() {
    let (place, points) = maps();
    let audit = "audit again a.csv c.csv --scale 1 --schemes olc --out a";
    let gate = "--gate olc:again-geometry:0.10<=100";
    let described = "--descriptors a.bin --descriptors a.bin";
    let other =
        "points with similar descriptors are at one place: both must be of one place, in one frame";
    for (sin, cos, scale, expected) in
        [(0.0, 1.0, 1.0, ""), (1.0, 0.0, 1.0, other), (0.0, 1.0, 0.37, other)]
    {
        let turned = |[x, y, z]: &[f64; 3]| [cos * x - sin * y, sin * (x + 2.0) + cos * y, *z];
        let moved = points.iter().map(|p| turned(p).map(|x| scale * x));
        place.write_points("c.csv", &moved.collect::<Vec<_>>());
        let code = i32::from(!expected.is_empty());
        let (text, stderr) = place.ends(&format!("{audit} {described} {gate}"), code);
        assert!(text.contains(expected) && stderr.contains(expected), "{text} {stderr}");
    }
    let far = points.iter().map(|p| p.map(|x| x + 20.0));
    place.write_points("c.csv", &far.collect::<Vec<_>>());
    let (text, _) = place.ends(&format!("{audit} {gate}"), 1);
    assert!(text.contains("near 0 of 300 points of the first one"), "{text}");
}
