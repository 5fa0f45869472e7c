//! `unlift audit map`: results, baselines, noise and lengths.

use crate::common::{Place, rows};

const QUICK: &str = "--k 10 --schemes olc,ppl --inlier-ratios 1,0.5";

/// A share-safe report contains neither the name nor a hash of the map, which would confirm a
/// guess.
#[test]
fn a_shareable_report_names_nothing() {
    let place = Place::with_room(200);
    let hash = unlift_io::hash::hash_files(&[place.path("room.csv")]).unwrap();
    for (more, is_named) in [("--out a", true), ("--share-safe --out b", false)] {
        place.ends(&format!("audit map room.csv {QUICK} --scale 1 {more}"), 0);
        let folder = &more[more.len() - 1..];
        for file in ["audit.json", "report.html"] {
            let text = place.text(&format!("{folder}/{file}"));
            for trace in ["room.csv", &hash, "sha256"] {
                assert_eq!(text.contains(trace), is_named, "{folder}/{file}: {trace}");
            }
        }
    }
}

/// `--quick` audits two schemes at one ratio, and one source if there are descriptors.
#[test]
fn a_first_look_is_two_schemes_and_the_attack_on_what_is_released() {
    let place = Place::with_room(700);
    place.write_descriptors("d.bin", &unlift::synthetic::room(1, 700).points, 64);
    let attacks = |more: &str| {
        place.ends(&format!("audit map room.csv --scale 1 --k 10 --quick {more} --out a"), 0);
        let document = place.json("a/audit.json");
        let mut found: Vec<String> = rows(&document)
            .iter()
            .inspect(|row| assert!(row["neighbors"] != "oracle" || row["inlier_ratio"] == 0.5))
            .map(|row| format!("{} {}", row["scheme"], row["neighbors"]).replace('"', ""))
            .collect();
        found.dedup();
        found
    };
    assert_eq!(attacks(""), ["olc oracle", "ppl oracle"]);
    let with = ["olc oracle", "olc similarity", "ppl oracle", "ppl similarity"];
    assert_eq!(attacks("--descriptors d.bin"), with);
    let both = ("--schemes ppl --out b", 2, "cannot be used with");
    place.refuses("audit map room.csv --quick", &[both]);
}

/// The verdict of a scheme that publishes bearings leads with what they show.
#[test]
fn bearings_are_audited_and_painted() {
    let place = Place::with_room(700);
    place.write_descriptors("d.bin", &unlift::synthetic::room(1, 700).points, 128);
    let audit = "audit map room.csv --scale 1 --descriptors d.bin --neighbors similarity";
    let (stdout, _) = place.ends(&format!("{audit} --schemes sphere --out s"), 0);
    assert!(stdout.contains("bearing"), "{stdout}");
    let obfuscate = "obfuscate room.csv --scale 1 --descriptors d.bin";
    place.ends(&format!("{obfuscate} --schemes sphere --out sphere"), 0);
    let (stdout, _) = place.ends("invert sphere/released.npz --out views", 0);
    assert_eq!(stdout, "6 pictures, in views\n");
    place.ends(&format!("{obfuscate} --schemes olc --out olc"), 0);
    place.refuses("invert", &[("olc/released.npz --out none", 2, "RECOVERED: expected")]);
    place.refuses(audit, &[("--protect-descriptors subspace:0", 2, "--protect-descriptors")]);
}
