//! Every command line of the README, run in order in an empty folder: what it says can be done can be done.

#[path = "../common/mod.rs"]
mod common;
mod project;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::Place;

/// Names that the README uses for what a reader has; everything else a line must make itself.
const FIXTURES: [&str; 3] = ["PROJECT", "photos", "cloud.ply"];

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The command lines of all `sh` blocks of a document, comments taken off.
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

/// What becomes of a line.
#[derive(Debug, PartialEq)]
enum Rule<'a> {
    /// It is run as it stands.
    Run(&'a str),
    /// `cargo run --release -- ARGUMENTS`: the program of this build is run.
    Ours(&'a str),
    /// `cargo install --path CRATE`: the crate is there and has the program.
    Install(&'a str),
    /// `cargo test --workspace`: this test is part of it.
    Test,
}

fn rule(line: &str) -> Rule<'_> {
    if line.starts_with("unlift ") {
        return Rule::Run(line);
    }
    if let Some(arguments) = line.strip_prefix("cargo run --release -- ") {
        return Rule::Ours(arguments);
    }
    if let Some(path) = line.strip_prefix("cargo install --path ") {
        return Rule::Install(path);
    }
    if line == "cargo test --workspace" {
        return Rule::Test;
    }
    panic!("the README has a line that this test has no rule for: {line}");
}

/// Every file in `folder` with its bytes.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(path) = open.pop() {
        match fs::read_dir(&path) {
            Ok(entries) => open.extend(entries.map(|entry| entry.unwrap().path())),
            Err(_) => {
                files.insert(path.clone(), fs::read(&path).unwrap());
            }
        }
    }
    files
}

/// What a line of ours writes: what `--out` names, else the usual place.
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
    project::write(&place.path("PROJECT"));
    write_cloud(&place.path("cloud.ply"));
    let given: Vec<_> = FIXTURES.iter().map(|name| contents(&place.path(name))).collect();

    let program = Path::new(env!("CARGO_BIN_EXE_unlift"));
    let path = std::env::join_paths(
        std::iter::once(program.parent().unwrap().to_owned())
            .chain(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())),
    )
    .unwrap();
    let shell = |command: &str| {
        let mut shell = Command::new("sh");
        shell.args(["-c", command]).env("PATH", &path).current_dir(place.path("."));
        shell.output().expect("sh starts")
    };
    // Not one that happens to be installed.
    let (version, _) = place.ends("--version", 0);
    assert_eq!(String::from_utf8_lossy(&shell("unlift --version").stdout), version);
    let mut outputs: Vec<String> = Vec::new();
    for line in &lines {
        let command = match rule(line) {
            Rule::Run(line) => line.to_owned(),
            Rule::Ours(arguments) => format!("unlift {arguments}"),
            Rule::Install(path) => {
                let manifest = repository().join(path).join("Cargo.toml");
                let manifest = fs::read_to_string(manifest).expect(line);
                assert!(manifest.contains("[[bin]]\nname = \"unlift\""), "{line}");
                continue;
            }
            Rule::Test => continue,
        };
        if let Some(out) = output(&command).map(str::to_owned) {
            assert!(!outputs.contains(&out), "two lines write {out}: {line}");
            outputs.push(out);
        }
        let started = std::time::Instant::now();
        let run = shell(&command);
        eprintln!("{:.1} s: {line}", started.elapsed().as_secs_f64());
        let (stdout, stderr) =
            (String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
        // A gate may fail: that is what it is for. It must say so, and nothing else may go wrong.
        let gated = command.contains("--gate") && stdout.contains("FAILED");
        let expected = i32::from(gated);
        assert_eq!(run.status.code(), Some(expected), "{line}\n{stdout}{stderr}");
        if let Some(out) = output(&command) {
            assert!(place.path(out).exists(), "{line}");
        }
    }
    for (name, before) in FIXTURES.iter().zip(&given) {
        assert!(contents(&place.path(name)) == *before, "a line of the README changed {name}");
    }
}

/// A cloud in no unit that anybody knows.
fn write_cloud(path: &Path) {
    let points = unlift::synthetic::room(2, 400).points;
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         end_header\n",
        points.len()
    );
    points
        .iter()
        .for_each(|[x, y, z]| text.push_str(&format!("{} {} {}\n", 3. * x, 3. * y, 3. * z)));
    fs::write(path, text).unwrap();
}

/// How GitHub names a heading in links.
fn anchor(heading: &str) -> String {
    let kept = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = kept.chars().filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// The documents of the repository that link to each other.
const DOCUMENTS: [&str; 6] = [
    "README.md",
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "STYLE.md",
    "docs/formats.md",
    "docs/benchmarks.md",
];

#[test]
fn links_between_documents_lead_somewhere() {
    let mut n = 0;
    for document in DOCUMENTS {
        let path = repository().join(document);
        let text = fs::read_to_string(&path).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            // Code has brackets and parentheses, too.
            if link.contains("://") || link.contains(' ') || !link.contains(['.', '#']) {
                continue;
            }
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = match file {
                "" => path.clone(),
                file => path.parent().unwrap().join(file),
            };
            assert!(target.exists(), "{document}: {link}");
            if !heading.is_empty() {
                let text = fs::read_to_string(&target).unwrap();
                let mut headings = text.lines().filter(|line| line.starts_with('#'));
                assert!(headings.any(|line| anchor(line) == heading), "{document}: {link}");
            }
            n += 1;
        }
    }
    assert!(n > 10, "{n}");
}

#[test]
fn lines_are_those_of_sh_blocks_without_comments() {
    let text = "```sh\nunlift a --gate 'x<=1'   # why\n# only a comment\n\nunlift b#c\n```\n```python\nno\n```\n\
                unlift no\n```sh\nunlift d\n```";
    assert_eq!(command_lines(text), ["unlift a --gate 'x<=1'", "unlift b#c", "unlift d"]);
}

#[test]
fn a_line_without_a_rule_is_refused() {
    assert_eq!(rule("cargo test --workspace"), Rule::Test);
    assert_eq!(rule("cargo run --release -- demo"), Rule::Ours("demo"));
    for line in ["cargo bench", "pip install unlift", "bash .ci/run"] {
        assert!(std::panic::catch_unwind(|| rule(line)).is_err(), "{line}");
    }
}
