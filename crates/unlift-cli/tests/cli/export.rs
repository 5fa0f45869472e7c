//! `unlift export`: exported files are read back and lie on the map.

use unlift::geometry::vector::distance;
use unlift_io::read;

use crate::common::Place;

#[test]
#[rustfmt::skip] // One row per line.
fn points_come_back_on_the_map_and_what_is_not_ours_stays() {
    let place = Place::with_room(400);
    // A unit of the map is half a meter.
    place.ends("obfuscate room.csv --scale 0.5 --seed 1 --k 10 --schemes olc --out hidden", 0);
    let released = "hidden/released.npz";
    let oracle = "--neighbors oracle --truth hidden/truth.npz --inlier-ratios 1 --k 10";
    place.ends(&format!("neighbors {released} {oracle} --out lists.npz"), 0);
    place.ends(&format!("recover {released} --neighbors lists.npz --out back.npz"), 0);
    place.write("project/sparse/0/cameras.txt", "1 PINHOLE 640 480 500 500 320 240\n");
    place.write("project/sparse/0/images.txt", "1 1 0 0 0 -1 -2 3 1 a.jpg\n\n");
    place.write("project/sparse/0/points3D.txt", "1 0 0 0 0 0 0 0\n");
    let room = unlift::synthetic::room(1, 400).points;
    let positions = |name: &str| read::open(&place.path(name)).expect("a map").positions;
    for (more, name, said) in [
        ("", "truth.ply", "400 points, in truth.ply\n"),
        ("--cameras project", "model", "a model of 400 points, 1 cameras and 1 images, in model\n"),
    ] {
        // Files of unlift are replaced.
        for _ in 0..2 {
            let line = format!("export hidden/truth.npz --scale 0.5 {more} --out {name}");
            assert_eq!(place.ends(&line, 0).0, said);
        }
        let read = positions(name);
        assert_eq!(read.len(), room.len(), "{name}");
        assert!(read.iter().zip(&room).all(|(a, b)| distance(a, b) < 1e-9), "{name}");
    }
    // Without `--scale` lengths are those of the file, in meters: half as many as units.
    place.ends("export hidden/truth.npz --out meters.ply", 0);
    assert!(distance(&positions("meters.ply")[7], &room[7].map(|x| 0.5 * x)) < 1e-9);
    place.ends("export back.npz --scale 0.5 --out back.ply", 0);
    let is_near = |p: &&[f64; 3]| room.iter().any(|q| distance(p, q) < 0.5);
    assert!(positions("back.ply").iter().filter(is_near).count() > 300);

    place.write("mine.ply", "mine");
    place.write("mine/points3D.txt", "# mine");
    let n_entries = || [place.n_entries(""), place.n_entries("mine")];
    place.ends("obfuscate room.csv --k 10 --seed 1 --schemes cp --out unscaled", 0);
    let before = n_entries();
    place.refuses("export", &[
        ("unscaled/truth.npz --cameras project --out new", 2, "--cameras: expected a file in meters"),
        ("hidden/released.npz --out lines.ply", 3, "found lines, rays or planes"),
        ("lists.npz --out lists.ply", 3, "found neighborhoods"),
        ("back.npz --cameras room.csv --out new", 3, "expected a COLMAP model with cameras"),
        ("back.npz --cameras room.csv --out new.ply", 2, "--cameras: expected a folder"),
        ("back.npz --out x.stl", 2, "--out: expected a name that ends in .ply, or a folder without an ending, found x.stl"),
        ("back.npz --out mine.ply", 2, "mine.ply: expected nothing, or a cloud of an earlier run"),
        ("back.npz --out mine", 2, "points3D.txt: expected nothing, or a model of an earlier run"),
    ]);
    assert_eq!(n_entries(), before);
    assert_eq!(place.text("mine.ply"), "mine");
}
