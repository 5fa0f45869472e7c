//! Runs every command line of the README in order, in an empty folder.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use unlift::synthetic;
use unlift_io::clouds::write_points;

use crate::common::{Place, texts};
use crate::layouts;

/// Inputs of the reader; the lines must make everything else.
const FIXTURES: [&str; 3] = ["PROJECT/", "photos/", "cloud.ply"];

/// Returns the command lines of all `sh` blocks of a document, without comments.
fn command_lines(markdown: &str) -> impl Iterator<Item = &str> {
    let blocks = markdown.split("```sh\n").skip(1).filter_map(|block| block.split("```").next());
    let lines = blocks.flat_map(str::lines).filter_map(|line| line.split(" #").next());
    lines.map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'))
}

/// Returns the line for the program of this build; `None` for lines that build the program or run
/// the tests.
fn runnable(line: &str) -> Option<String> {
    if ["cargo install --path crates/unlift-cli", "cargo test --workspace"].contains(&line) {
        return None;
    }
    let line = line.replacen("cargo run --release --", "unlift", 1);
    assert!(line.starts_with("unlift "), "this test cannot run a line of the README: {line}");
    Some(line)
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

#[test]
fn every_command_line_of_the_readme_runs_as_it_is_written() {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../README.md");
    let readme = fs::read_to_string(readme).unwrap();
    let lines: Vec<&str> = command_lines(&readme).collect();
    assert!(lines.len() >= 15, "{lines:#?}");

    let place = Place::with_photos(&["a.jpg", "b.png", "hall/c.webp"]);
    layouts::project(&place, "PROJECT");
    let cloud = synthetic::room(2, 400).points.into_iter().map(|p| p.map(|x| 3.0 * x));
    write_points(&place.path("cloud.ply"), &cloud.collect::<Vec<_>>()).unwrap();
    let given = || -> BTreeMap<String, Vec<u8>> {
        let of_reader = |name: &String| FIXTURES.iter().any(|given| name.starts_with(given));
        let names = place.files().into_iter().filter(of_reader);
        names.map(|name| (name.clone(), place.bytes(&name))).collect()
    };
    let before = given();
    let mut outputs: Vec<String> = Vec::new();
    for line in lines.into_iter().filter_map(runnable) {
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
