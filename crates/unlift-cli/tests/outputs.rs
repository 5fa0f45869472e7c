//! Nothing of the user's is lost: not beside an output, not under its name, not as an input, not by an interrupt.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use common::Place;

const QUICK: &str = "--k 10 --schemes olc --inlier-ratios 1 --quiet";

/// A folder with `room.csv`, a map of so many points.
fn place(n_points: usize) -> Place {
    Place::with_room(n_points)
}

/// All files below the folder, as paths within it, sorted.
fn files(place: &Place) -> Vec<String> {
    let root = place.path("");
    let (mut found, mut waiting) = (Vec::new(), vec![root.clone()]);
    while let Some(folder) = waiting.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                waiting.push(path);
            } else {
                found.push(path.strip_prefix(&root).unwrap().to_str().unwrap().to_owned());
            }
        }
    }
    found.sort();
    found
}

fn complaint(place: &Place, line: &str) -> String {
    let (stdout, stderr) = place.ends(line, 2);
    assert!(stdout.is_empty(), "{stdout}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    stderr.trim_end().to_owned()
}

#[test]
fn files_beside_an_audit_survive_and_a_strangers_audit_json_is_refused() {
    let place = place(200);
    fs::create_dir_all(place.path("site/src")).unwrap();
    fs::write(place.path("site/src/app.ts"), "precious").unwrap();
    // As `npm audit --json > audit.json` leaves it; an empty one used to suffice.
    for foreign in ["", r#"{"auditReportVersion": 2, "vulnerabilities": {}}"#] {
        fs::write(place.path("site/audit.json"), foreign).unwrap();
        let line = format!("audit map room.csv {QUICK} --out site");
        assert_eq!(
            complaint(&place, &line),
            "unlift: --out: site/audit.json: expected nothing, or an audit.json of an earlier run \
             (else --force), found another file"
        );
        assert_eq!(fs::read_to_string(place.path("site/audit.json")).unwrap(), foreign);
    }
    for more in ["--force", "", "--write-clouds", "--share-safe"] {
        place.ends(&format!("audit map room.csv {QUICK} --out site {more}"), 0);
        assert_eq!(fs::read_to_string(place.path("site/src/app.ts")).unwrap(), "precious");
    }
    let kept = ["site/audit.json", "site/report.html", "site/src/app.ts"];
    assert!(kept.iter().all(|name| files(&place).contains(&(*name).to_owned())));
}

#[test]
fn the_current_folder_is_a_place_like_any_other() {
    let place = place(200);
    fs::write(place.path("notes.txt"), "precious").unwrap();
    for _ in 0..2 {
        place.ends(&format!("audit map room.csv {QUICK} --out ."), 0);
        place.ends("obfuscate room.csv --scheme olc --k 10 --out .", 0);
    }
    let expected =
        ["audit.json", "notes.txt", "released.parquet", "report.html", "room.csv", "truth.parquet"];
    assert_eq!(files(&place), expected);
    assert_eq!(fs::read_to_string(place.path("notes.txt")).unwrap(), "precious");
}

#[test]
fn lists_beside_an_obfuscation_survive_the_next_one() {
    let place = place(200);
    let hide = "obfuscate room.csv --scheme olc --k 10 --out hidden";
    place.ends(hide, 0);
    let lists = "neighbors oracle hidden/truth.parquet --inlier-ratio 1 --k 10 \
                 --out hidden/neighbors.parquet";
    place.ends(lists, 0);
    let before = fs::read(place.path("hidden/neighbors.parquet")).unwrap();
    place.ends(hide, 0);
    assert_eq!(fs::read(place.path("hidden/neighbors.parquet")).unwrap(), before);
}

#[test]
fn inputs_are_never_written_over() {
    let place = place(200);
    let fixture = "../unlift-io/tests/data/project/database.db";
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join(fixture), place.path("database.db"))
        .unwrap();
    fs::hard_link(place.path("database.db"), place.path("hard.h5")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(place.path("database.db"), place.path("soft.h5")).unwrap();
    fs::create_dir(place.path("photos")).unwrap();
    common::photo(0).save(place.path("photos/p.jpg")).unwrap();
    place.ends("obfuscate room.csv --scheme olc --k 10 --out x", 0);
    let oracle = "neighbors oracle x/truth.parquet --inlier-ratio 1 --k 10 --out";
    place.ends(&format!("{oracle} x/lists.parquet"), 0);
    let recover = "recover x/released.parquet --neighbors x/lists.parquet --out";
    place.ends(&format!("{recover} x/back.parquet"), 0);
    let bytes =
        || files(&place).iter().map(|f| fs::read(place.path(f)).unwrap()).collect::<Vec<_>>();
    let before = (files(&place), bytes());
    let mut lines = vec![
        "features database.db --out database.db".to_owned(),
        "features database.db --out ./photos/../database.db".to_owned(),
        "features database.db --out hard.h5".to_owned(),
        "features photos --out photos/p.jpg".to_owned(),
        format!("{oracle} x/truth.parquet"),
        format!("{oracle} x/released.parquet"),
        "neighbors find x/released.parquet --source geometric --out x/released.parquet".to_owned(),
        format!("{recover} x/lists.parquet"),
        format!("{recover} x/released.parquet"),
    ];
    if cfg!(unix) {
        lines.push("features database.db --out soft.h5".to_owned());
    }
    for line in lines {
        for force in ["", " --force"] {
            let told = complaint(&place, &format!("{line}{force}"));
            assert!(told.contains("expected a file that is not read, found the input"), "{told}");
            assert!((files(&place), bytes()) == before, "{line}");
        }
    }
    // A new name that the next run would take for a photo.
    let told = complaint(&place, "features photos --out photos/new.jpg");
    assert!(
        told.ends_with("photos/new.jpg: expected a name that is not read as a photo"),
        "{told}"
    );
    // Stage files of another kind are somebody's work, too.
    let told = complaint(&place, &format!("{recover} x/truth.parquet"));
    assert!(told.contains("a file of recovered points of an earlier run (else --force)"), "{told}");
    assert!((files(&place), bytes()) == before);
    place.ends(&format!("{recover} x/back.parquet"), 0);
}

#[test]
fn a_map_given_as_a_cloud_is_no_place_for_its_own_clouds() {
    let place = place(200);
    let audit = |map: &str| format!("audit map {map} {QUICK} --write-clouds --out a");
    place.ends(&audit("room.csv"), 0);
    fs::rename(place.path("a/clouds/original.ply"), place.path("kept.ply")).unwrap();
    fs::hard_link(place.path("kept.ply"), place.path("a/clouds/original.ply")).unwrap();
    let before = fs::read(place.path("kept.ply")).unwrap();
    let (_, stderr) = place.ends(&audit("kept.ply"), 2);
    assert!(stderr.contains("found the input kept.ply"), "{stderr}");
    assert_eq!(fs::read(place.path("a/clouds/original.ply")).unwrap(), before);
}

#[test]
fn features_of_others_are_not_replaced_and_our_own_are() {
    let place = Place::with_photos(&["a.png"]);
    let foreign = [b"\x89HDF\r\n\x1a\n".as_slice(), &[7; 500]].concat();
    fs::write(place.path("features.h5"), &foreign).unwrap();
    assert_eq!(
        complaint(&place, "features photos"),
        "unlift: --out: features.h5: expected nothing, or features of an earlier run (else --force), \
         found another file"
    );
    assert_eq!(fs::read(place.path("features.h5")).unwrap(), foreign);
    place.ends("features photos --force", 0);
    place.ends("features photos", 0);
    assert_eq!(files(&place), ["features.h5", "photos/a.png"]);
}

#[test]
fn share_safe_outputs_carry_no_hash_of_the_map() {
    let place = place(200);
    let hash = unlift_io::hash::hash_files(&[place.path("room.csv")]).unwrap();
    let carry = |file: &str| fs::read_to_string(place.path(file)).unwrap().contains(&hash);
    place.ends(&format!("audit map room.csv {QUICK} --out a"), 0);
    assert!(carry("a/audit.json") && carry("a/report.html"));
    place.ends(&format!("audit map room.csv {QUICK} --share-safe --out b"), 0);
    for file in ["b/audit.json", "b/report.html"] {
        assert!(!carry(file), "{file}");
        let text = fs::read_to_string(place.path(file)).unwrap();
        assert!(!text.contains("sha256"), "{file}");
    }
}

#[cfg(unix)]
#[test]
fn what_shows_points_is_for_its_owner_alone() {
    use std::os::unix::fs::PermissionsExt;
    let place = place(200);
    place.ends("obfuscate room.csv --scheme olc --k 10 --out hidden", 0);
    let lists = "--inlier-ratio 1 --k 10 --out lists.parquet";
    place.ends(&format!("neighbors oracle hidden/truth.parquet {lists}"), 0);
    place.ends("recover hidden/released.parquet --neighbors lists.parquet --out back.parquet", 0);
    place.ends(&format!("audit map room.csv {QUICK} --write-clouds --out a"), 0);
    place.ends(&format!("audit map room.csv {QUICK} --share-safe --out b"), 0);
    fs::create_dir(place.path("photos")).unwrap();
    common::photo(0).save(place.path("photos/p.png")).unwrap();
    place.ends("invert photos --out pictures/new", 0);
    let mode = |name: &str| fs::metadata(place.path(name)).unwrap().permissions().mode() & 0o777;
    let usual = mode("room.csv");
    assert_ne!(usual, 0o600, "the test needs a mask that lets others read");
    for (name, expected) in [
        ("hidden", 0o700),
        ("hidden/truth.parquet", 0o600),
        ("hidden/released.parquet", usual),
        ("lists.parquet", 0o600),
        ("back.parquet", 0o600),
        ("a", 0o700),
        ("a/audit.json", 0o600),
        ("a/report.html", 0o600),
        ("a/clouds", 0o700),
        ("a/clouds/original.ply", 0o600),
        ("a/clouds/olc-recovered-1-joint.ply", 0o600),
        ("pictures", 0o700),
        ("pictures/new", 0o700),
        ("pictures/new/p.png.png", 0o600),
        ("b/audit.json", usual),
        ("b/report.html", usual),
    ] {
        assert_eq!(mode(name), expected, "{name}: {:o}", mode(name));
    }
}

fn start(place: &Place, line: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_unlift"))
        .args(line.split_whitespace())
        .current_dir(place.path(""))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts")
}

#[cfg(unix)]
fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").arg(format!("-{name}")).arg(child.id().to_string()).status();
    assert!(sent.is_ok());
}

/// Sends signals at moments spread over the length of a run: what is left is all or nothing.
#[cfg(unix)]
fn interrupted(line: &str, n_points: usize, whole: &[&str]) {
    const MOMENTS: u32 = 24;
    let place = place(n_points);
    let started = Instant::now();
    assert!(start(&place, line).wait().unwrap().success());
    let took = started.elapsed();
    assert_eq!(files(&place), whole);
    fs::remove_dir_all(place.path("out")).unwrap();
    let mut stopped = 0;
    for moment in 0..MOMENTS {
        let (name, code) = if moment % 2 == 0 { ("INT", 130) } else { ("TERM", 143) };
        let mut child = start(&place, line);
        std::thread::sleep(took * moment / MOMENTS);
        signal(&child, name);
        let status = child.wait().unwrap();
        let left = files(&place);
        if status.success() || left.len() > 1 {
            assert_eq!(left, whole, "{name} at {moment}");
            fs::remove_dir_all(place.path("out")).unwrap();
        } else {
            // Before the program listens, the signal itself ends it: nothing has begun then.
            use std::os::unix::process::ExitStatusExt;
            let by_signal = status.signal().is_some();
            assert!(status.code() == Some(code) || by_signal, "{name} at {moment}: {status}");
            stopped += u32::from(!by_signal);
            assert_eq!(left, ["room.csv"], "{name} at {moment}");
            assert!(!place.path("out").exists(), "{name} at {moment}");
        }
    }
    assert!(stopped >= MOMENTS / 4, "only {stopped} runs were stopped");
}

#[cfg(unix)]
#[test]
fn an_interrupted_obfuscation_leaves_all_or_nothing() {
    let whole = ["out/released.parquet", "out/truth.parquet", "room.csv"];
    interrupted("obfuscate room.csv --scheme ppl --scale 1 --out out", 60_000, &whole);
}

#[cfg(unix)]
#[test]
fn an_interrupted_audit_leaves_all_or_nothing() {
    let whole = [
        "out/audit.json",
        "out/clouds/olc-obfuscated.obj",
        "out/clouds/olc-recovered-1-consensus.ply",
        "out/clouds/original.ply",
        "out/report.html",
        "room.csv",
    ];
    let line = format!("audit map room.csv {QUICK} --solver consensus --write-clouds --out out");
    interrupted(&line, 3000, &whole);
}

/// Waits for the unfinished folder of a run.
#[cfg(unix)]
fn unfinished(place: &Place) {
    let started = Instant::now();
    let partial = |name: std::io::Result<fs::DirEntry>| {
        name.unwrap().file_name().to_string_lossy().ends_with(".partial")
    };
    while !fs::read_dir(place.path("out")).is_ok_and(|mut entries| entries.any(partial)) {
        assert!(started.elapsed() < Duration::from_secs(60), "no partial folder appeared");
        std::thread::yield_now();
    }
}

#[cfg(unix)]
#[test]
fn what_a_killed_run_leaves_is_swept_and_what_a_living_one_builds_is_not() {
    let place = place(60_000);
    let line = "obfuscate room.csv --scheme olc --scale 1 --out out";
    let mut killed = start(&place, line);
    unfinished(&place);
    signal(&killed, "KILL");
    assert!(!killed.wait().unwrap().success());
    unfinished(&place);
    // One that has stopped in the middle, and one that overtakes it.
    let mut slow = start(&place, line);
    std::thread::sleep(Duration::from_millis(50));
    signal(&slow, "STOP");
    place.ends(line, 0);
    signal(&slow, "CONT");
    assert!(slow.wait().unwrap().success());
    assert_eq!(files(&place), ["out/released.parquet", "out/truth.parquet", "room.csv"]);
}
