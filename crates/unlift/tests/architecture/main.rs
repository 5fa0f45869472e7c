//! The arrows of ARCHITECTURE.md, checked on the source text: who may import whom, who may open the
//! truth, what recovery may touch. Every check is a function over text, so that `fails` can show
//! that it fails when it should.

mod circles;
mod fails;
mod names;
mod rules;
mod rust;

use std::fs;
use std::path::{Path, PathBuf};

use circles::{back_arrows, circles};
use names::dangling;
use rules::*;
use rust::{Source, code_of};

const CORE: &str = env!("CARGO_MANIFEST_DIR");

/// All files under `folder`, but for what builds leave and what git keeps.
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

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    all_files(folder, found);
    found.retain(|path| path.extension().is_some_and(|e| e == "rs"));
}

fn core_sources() -> Vec<Source> {
    sources_of("unlift")
}

fn sources_of(name: &str) -> Vec<Source> {
    let root = Path::new(CORE).join("..").join(name).join("src");
    let mut files = Vec::new();
    rust_files(&root, &mut files);
    let read = |path: &PathBuf| Source {
        path: path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/"),
        code: code_of(&fs::read_to_string(path).unwrap()),
    };
    files.iter().map(read).collect()
}

fn on_every_file(check: fn(&Source) -> Vec<String>) {
    let found: Vec<String> = core_sources().iter().flat_map(check).collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn no_module_imports_against_the_arrows() {
    assert!(core_sources().len() > 40, "the sources were not found");
    on_every_file(forbidden_arrows);
}

#[test]
fn no_files_import_each_other() {
    for &(name, _) in CRATES {
        let sources = sources_of(name);
        assert!(!sources.is_empty(), "no sources of {name}");
        let found = circles(&sources);
        assert!(found.is_empty(), "\n{name}: {}", found.join("\n"));
    }
}

#[test]
fn no_arrow_inside_recover_runs_back() {
    let found = back_arrows(&core_sources());
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn truth_is_revealed_only_on_the_owners_side() {
    on_every_file(forbidden_reveals);
}

#[test]
fn attackers_make_no_keys() {
    on_every_file(forbidden_keys);
}

#[test]
fn recovery_has_no_state_and_no_files() {
    on_every_file(forbidden_state);
}

#[test]
fn only_simd_is_unsafe() {
    on_every_file(forbidden_unsafe);
}

#[test]
fn nothing_prints_but_by_the_one_place() {
    for &(name, _) in CRATES {
        let found: Vec<String> = sources_of(name).iter().flat_map(forbidden_prints).collect();
        assert!(found.is_empty(), "\n{name}: {}", found.join("\n"));
    }
}

#[test]
fn every_scheme_file_is_registered() {
    let folder = Path::new(CORE).join("src/obfuscate");
    let names: Vec<String> = fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let missing = unregistered(&names, &fs::read_to_string(folder.join("mod.rs")).unwrap());
    assert!(missing.is_empty(), "{missing:?}");
    assert_eq!(names.len() - NO_SCHEMES.len(), unlift::obfuscate::SCHEMES.len());
}

#[test]
fn files_can_be_read_in_one_sitting() {
    let mut files = Vec::new();
    for entry in fs::read_dir(Path::new(CORE).join("..")).unwrap() {
        for folder in ["src", "tests", "benches", "examples"] {
            rust_files(&entry.as_ref().unwrap().path().join(folder), &mut files);
        }
    }
    let long: Vec<String> = files
        .iter()
        .map(|path| (path, counted_lines(&fs::read_to_string(path).unwrap())))
        .filter(|&(_, lines)| lines > MOST_LINES)
        .map(|(path, lines)| format!("{}: {lines} lines", path.display()))
        .collect();
    assert!(files.len() > 60 && long.is_empty(), "{long:?}");
}

#[test]
fn manifests_follow_the_arrows() {
    for &(name, allowed) in CRATES {
        let path = Path::new(CORE).join("..").join(name).join("Cargo.toml");
        let manifest = fs::read_to_string(path).unwrap();
        for dependency in manifest_names(&manifest, "dependencies") {
            let house = dependency.starts_with("unlift");
            assert!(!house || allowed.contains(&&*dependency), "{name} imports {dependency}");
            let heavy = name == "unlift" && !DEPENDENCIES.contains(&&*dependency);
            assert!(!heavy, "the core has a new dependency: {dependency}");
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
