//! Rules that the compiler does not check: dependencies, unsafe code, names in documents.

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
    ("unlift-report", &["unlift"]),
    ("unlift-testkit", &["unlift"]),
    ("unlift-audit", &["unlift", "unlift-io", "unlift-vision", "unlift-report"]),
    ("unlift-cli", &["unlift", "unlift-audit", "unlift-io", "unlift-vision", "unlift-report"]),
];

/// Modules of the report and of the audit, from the bottom up: each imports only itself and modules before it.
const MODULES: &[(&str, &str)] = &[
    (
        "unlift-report",
        "words document attack results templates table gates page export compare release",
    ),
    (
        "unlift-audit",
        "error sources doubts document gate request maps images changes inversion localization audit",
    ),
];

/// External dependencies allowed for the two core crates.
const DEPENDENCIES: &[&str] =
    &["libm", "rayon", "nalgebra", "sha2", "chacha20", "getrandom", "serde", "indexmap"];

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

/// Returns the lines of a file without its unit tests.
fn code(text: &str) -> std::str::Lines<'_> {
    text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default().lines()
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
fn modules_import_downward_alone() {
    for &(name, modules) in MODULES {
        let place = |module: &str| modules.split(' ').position(|known| known == module);
        let root = Path::new(CORE).join("..").join(name).join("src");
        for (path, text) in sources(name, "src") {
            let first = path.strip_prefix(&root).unwrap().iter().next().unwrap();
            let module = Path::new(first).file_stem().unwrap().to_str().unwrap();
            let lines = code(&text).filter(|line| module != "lib" && !line.contains("//"));
            for import in lines.flat_map(|line| line.split("crate::").skip(1)) {
                let end = |c: char| !c.is_alphanumeric() && c != '_';
                let list = import.strip_prefix('{').and_then(|list| list.split('}').next());
                let imported = list.unwrap_or(import.split(end).next().unwrap()).split(", ");
                for imported in imported.filter_map(|path| path.split("::").next()) {
                    let is_below = place(imported).is_some_and(|at| Some(at) <= place(module));
                    let is_ours = is_below || ["Error", "Progress", "bail"].contains(&imported);
                    assert!(is_ours, "{}: {imported}", path.display());
                }
            }
        }
    }
}

/// Only one place each in the command line writes to stdout and stderr.
#[test]
fn unsafe_code_is_in_one_file_and_libraries_print_nothing() {
    let macros = ["print!(", "println!(", "eprint!(", "eprintln!(", "dbg!("];
    let prints = |line: &str| {
        macros.iter().any(|name| line.starts_with(name) || line.contains(&format!(" {name}")))
    };
    for (path, text) in CRATES.iter().flat_map(|(name, _)| sources(name, "src")) {
        let may_be_unsafe = path.ends_with("unlift-attack/src/simd.rs");
        let is_wrong =
            |line: &&str| prints(line) || (line.contains("allow(unsafe_code)") && !may_be_unsafe);
        let mut lines = code(&text).map(str::trim_start).filter(|line| !line.starts_with("//"));
        let wrong = lines.find(is_wrong);
        assert!(wrong.is_none(), "{}: {wrong:?}", path.display());
    }
}

#[test]
fn every_scheme_is_registered() {
    let files = sources("unlift", "src/obfuscate");
    let n: usize = files.iter().map(|(_, text)| text.matches(": Entry = Entry {").count()).sum();
    assert_eq!(n, unlift::obfuscate::all().count());
}

/// File names in comments and documents may omit leading folders.
#[test]
fn files_that_are_named_exist() {
    let root = Path::new(CORE).join("../..");
    let mut files = Vec::new();
    all_files(&root, &mut files);
    let from_root =
        |path: &PathBuf| path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
    let names: Vec<String> = files.iter().map(from_root).collect();
    let exists = |bare: &str| names.iter().any(|file| Path::new(file).ends_with(bare));
    let of_path = |c: char| c.is_ascii_alphanumeric() || "_-./:".contains(c);
    let endings = [".md", ".rs", ".py", ".svg"];
    let mut missing = Vec::new();
    for name in names.iter().filter(|name| name.ends_with(".rs") || name.ends_with(".md")) {
        let text = fs::read_to_string(root.join(name)).unwrap();
        for (at, line) in text.lines().enumerate() {
            // The slashes of a web address start no comment.
            let starts = |&(at, _): &(usize, &str)| !line[..at].ends_with(':');
            let comment = line.match_indices("//").find(starts).map_or("", |(at, _)| &line[at..]);
            let prose = if name.ends_with(".rs") { comment } else { line };
            for run in prose.split(|c| !of_path(c)) {
                let run = run.trim_end_matches(['.', ':', '/']);
                let is_name = endings.iter().any(|&end| run.ends_with(end) && run != end);
                let bare = run.trim_start_matches("../").trim_start_matches("./");
                if is_name && !run.contains("://") && !exists(bare) {
                    missing.push(format!("{name}:{}: there is no file {run}", at + 1));
                }
            }
        }
    }
    assert!(names.len() > 200 && missing.is_empty(), "\n{}", missing.join("\n"));
}
