//! Rules that the compiler does not check: dependencies between crates, size of files, and file
//! names in documents.

use std::fs;
use std::path::{Path, PathBuf};

const CORE: &str = env!("CARGO_MANIFEST_DIR");

/// Crates of this workspace, from the bottom up, and the crates that each may depend on. The
/// attacker's crate depends on none, so no type with ground truth can reach it.
const CRATES: &[(&str, &[&str])] = &[
    ("unlift-attack", &[]),
    ("unlift", &["unlift-attack"]),
    ("unlift-io", &["unlift"]),
    ("unlift-vision", &["unlift"]),
    ("unlift-report", &[]),
    ("unlift-testkit", &["unlift"]),
    ("unlift-audit", &["unlift", "unlift-io", "unlift-vision", "unlift-report"]),
    ("unlift-cli", &["unlift", "unlift-audit", "unlift-io", "unlift-vision", "unlift-report"]),
];

/// External dependencies allowed for the two core crates.
const DEPENDENCIES: &[&str] = &["libm", "rayon", "nalgebra", "sha2", "chacha20", "getrandom"];

/// Maximum number of lines of a file, without unit tests.
const MOST_LINES: usize = 800;

/// Collects all files under `folder`, without build outputs and git data.
fn all_files(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries {
        let path = entry.unwrap().path();
        if !path.is_dir() {
            found.push(path);
        } else if !["target", ".git"].iter().any(|name| path.ends_with(name)) {
            all_files(&path, found);
        }
    }
    found.sort();
}

fn sources(name: &str, folder: &str) -> Vec<(PathBuf, String)> {
    let mut files = Vec::new();
    all_files(&Path::new(CORE).join("..").join(name).join(folder), &mut files);
    files.retain(|path| path.extension().is_some_and(|e| e == "rs"));
    files.into_iter().map(|path| (path.clone(), fs::read_to_string(path).unwrap())).collect()
}

fn code(text: &str) -> impl Iterator<Item = &str> {
    let bottom = text.find("#[cfg(test)]\nmod tests").unwrap_or(text.len());
    text[..bottom].lines().map(str::trim_start).filter(|line| !line.starts_with("//"))
}

#[test]
fn crates_depend_downward_alone() {
    for &(name, allowed) in CRATES {
        let path = Path::new(CORE).join("..").join(name).join("Cargo.toml");
        let manifest = fs::read_to_string(path).unwrap();
        let section = manifest.split("[dependencies]\n").nth(1).unwrap_or_default();
        let lines = section.lines().take_while(|line| !line.starts_with('['));
        let is_entry = |line: &&str| !line.starts_with('#') && line.contains(['=', '.']);
        let names = lines.filter(is_entry).filter_map(|line| line.split(['=', '.', ' ']).next());
        for dependency in names {
            let house =
                dependency.starts_with("unlift") && !dependency.starts_with("unlift-model-");
            assert!(!house || allowed.contains(&dependency), "{name} imports {dependency}");
            let is_core = ["unlift-attack", "unlift"].contains(&name);
            let heavy = is_core && !house && !DEPENDENCIES.contains(&dependency);
            assert!(!heavy, "{name} has a new dependency: {dependency}");
        }
    }
}

#[test]
fn unsafe_code_is_in_one_file() {
    for &(name, _) in CRATES {
        for (path, text) in sources(name, "src") {
            let allows = code(&text).any(|line| line.contains("allow(unsafe_code)"));
            assert!(!allows || path.ends_with("unlift-attack/src/simd.rs"), "{}", path.display());
        }
    }
}

/// Only one place each in the command line writes to stdout and stderr.
#[test]
fn libraries_print_nothing() {
    let macros = ["print!(", "println!(", "eprint!(", "eprintln!(", "dbg!("];
    let prints = |line: &str| {
        macros.iter().any(|name| line.starts_with(name) || line.contains(&format!(" {name}")))
    };
    for &(name, _) in CRATES {
        for (path, text) in sources(name, "src") {
            let found = code(&text).find(|line| prints(line));
            assert!(found.is_none(), "{}: {found:?}", path.display());
        }
    }
}

#[test]
fn every_scheme_is_registered() {
    let files = sources("unlift", "src/obfuscate");
    let n: usize = files.iter().map(|(_, text)| text.matches(": Entry = Entry {").count()).sum();
    assert_eq!(n, unlift::obfuscate::all().count());
}

#[test]
fn files_can_be_read_in_one_sitting() {
    for &(name, _) in CRATES {
        for folder in ["src", "tests", "benches", "examples"] {
            for (path, text) in sources(name, folder) {
                let bottom = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
                let lines = text[..bottom].lines().count();
                assert!(lines <= MOST_LINES, "{}: {lines} lines", path.display());
            }
        }
    }
}

#[test]
fn files_that_are_named_exist() {
    let root = Path::new(CORE).join("../..");
    let mut files = Vec::new();
    all_files(&root, &mut files);
    let from_root =
        |path: &PathBuf| path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
    let names: Vec<String> = files.iter().map(from_root).collect();
    let read = |name: &&String| name.ends_with(".rs") || name.ends_with(".md");
    let found: Vec<String> = names
        .iter()
        .filter(read)
        .flat_map(|name| dangling(name, &fs::read_to_string(root.join(name)).unwrap(), &names))
        .collect();
    assert!(names.len() > 200 && found.is_empty(), "\n{}", found.join("\n"));
}

const ENDINGS: [&str; 4] = [".md", ".rs", ".py", ".svg"];

/// Returns the comments of a Rust file, line by line, or all lines of any other file.
fn prose<'a>(path: &str, text: &'a str) -> Vec<&'a str> {
    let is_rust = path.ends_with(".rs");
    let comment = |line: &'a str| {
        // The slashes of a web address start no comment.
        let mut starts = line.match_indices("//").filter(|&(at, _)| !line[..at].ends_with(':'));
        starts.next().map_or("", |(at, _)| &line[at..])
    };
    text.lines().map(|line| if is_rust { comment(line) } else { line }).collect()
}

/// Returns the file names in `line`, without web addresses.
fn named(line: &str) -> impl Iterator<Item = &str> {
    let of_path = |c: char| c.is_ascii_alphanumeric() || "_-./:".contains(c);
    let runs = line.split(move |c| !of_path(c)).map(|run| run.trim_end_matches(['.', ':', '/']));
    runs.filter(|run| {
        let stem = ENDINGS.iter().find_map(|ending| run.strip_suffix(ending));
        stem.is_some_and(|stem| !stem.is_empty() && !run.contains("://"))
    })
}

/// Returns names in the prose of `path` that no file of the repository has, with their lines. A
/// name may omit leading folders; `files` are paths from the root.
fn dangling(path: &str, text: &str, files: &[String]) -> Vec<String> {
    let exists = |name: &str| {
        let mut bare = name;
        while let Some(rest) = bare.strip_prefix("../").or_else(|| bare.strip_prefix("./")) {
            bare = rest;
        }
        let is_it = |file: &String| {
            file.strip_suffix(bare).is_some_and(|folder| folder.is_empty() || folder.ends_with('/'))
        };
        files.iter().any(is_it)
    };
    let lines = prose(path, text).into_iter().enumerate();
    lines
        .flat_map(|(at, line)| named(line).map(move |name| (at + 1, name)))
        .filter(|(_, name)| !exists(name))
        .map(|(at, name)| format!("{path}:{at}: there is no file {name}"))
        .collect()
}
