//! Runs every command line of the README in order, in an empty folder.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{Place, texts};
use crate::layouts;

/// Inputs of the reader; the lines must make everything else.
const FIXTURES: [&str; 3] = ["PROJECT/", "photos/", "cloud.ply"];

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the command lines of all `sh` blocks of a document, without comments.
fn command_lines(markdown: &str) -> Vec<String> {
    let mut lines = Vec::new();
    let mut within = false;
    for line in markdown.lines() {
        if let Some(language) = line.strip_prefix("```") {
            within = !within && language.trim() == "sh";
            continue;
        }
        let command = line.split(" #").next().unwrap_or_default().trim();
        if within && !command.is_empty() && !command.starts_with('#') {
            lines.push(command.to_owned());
        }
    }
    lines
}

/// Returns the line for the program of this build; `None` for lines that build the program or run
/// the tests.
fn runnable(line: &str) -> Option<String> {
    let ours = line.strip_prefix("cargo run --release -- ").map(|words| format!("unlift {words}"));
    let is_build = ["cargo install --path crates/unlift-cli", "cargo test --workspace"];
    match ours {
        Some(ours) => Some(ours),
        None if line.starts_with("unlift ") => Some(line.to_owned()),
        None => {
            assert!(
                is_build.contains(&line),
                "the README has a line that this test cannot run: {line}"
            );
            None
        }
    }
}

/// Returns the output path of a line of unlift: `--out` or the default.
fn output(line: &str) -> Option<&str> {
    let mut words = line.split_whitespace();
    match words.find(|&word| word == "--out") {
        Some(_) => words.next(),
        None if line.starts_with("unlift audit ") => Some("unlift-audit"),
        None if line.starts_with("unlift demo") => Some("unlift-demo"),
        None => None,
    }
}

#[cfg(unix)]
#[test]
fn every_command_line_of_the_readme_runs_as_it_is_written() {
    let readme = fs::read_to_string(repository().join("README.md")).unwrap();
    let lines = command_lines(&readme);
    assert!(lines.len() >= 15, "{lines:#?}");

    let place = Place::with_photos(&["a.jpg", "b.png", "hall/c.webp"]);
    layouts::project(&place, "PROJECT");
    write_cloud(&place);
    let given = || -> BTreeMap<String, Vec<u8>> {
        let of_reader = |name: &String| FIXTURES.iter().any(|given| name.starts_with(given));
        let names = place.files().into_iter().filter(of_reader);
        names.map(|name| (name.clone(), place.bytes(&name))).collect()
    };
    let before = given();
    let mut outputs: Vec<String> = Vec::new();
    for line in lines.iter().filter_map(|line| runnable(line)) {
        if let Some(out) = output(&line) {
            assert!(!outputs.contains(&out.to_owned()), "two lines write {out}: {line}");
            outputs.push(out.to_owned());
        }
        let run = place.shell(&line);
        let (stdout, stderr) = texts(&run);
        // A gate may fail, and must report that; nothing else may fail.
        let failed = line.contains("--gate") && stdout.contains("FAILED");
        assert_eq!(run.status.code(), Some(i32::from(failed)), "{line}\n{stdout}{stderr}");
        if let Some(out) = output(&line) {
            assert!(place.path(out).exists(), "{line}");
        }
    }
    assert!(given() == before, "a line of the README changed what a reader has");
}

/// Writes a point cloud with an unknown unit.
fn write_cloud(place: &Place) {
    let head = "ply\nformat ascii 1.0\nelement vertex 400\nproperty float x\nproperty float y\nproperty float z\n";
    let point = |p: &[f64; 3]| format!("{} {} {}\n", 3.0 * p[0], 3.0 * p[1], 3.0 * p[2]);
    let rows: String = unlift::synthetic::room(2, 400).points.iter().map(point).collect();
    place.write("cloud.ply", format!("{head}end_header\n{rows}"));
}
