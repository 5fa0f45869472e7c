//! The rules, as tables and as checks over text.

use std::collections::BTreeSet;

use crate::rust::{Source, internal_paths, paths, tokens};

/// What every module may import.
const VOCABULARY: &[&str] = &[
    "error",
    "line",
    "ids",
    "seed",
    "points",
    "descriptors",
    "geometry",
    "simd",
    "about",
    "compiled",
];
/// What the root exports: vocabulary under shorter names.
const ROOT_NAMES: &[&str] = &[
    "Error",
    "OneLine",
    "OriginalId",
    "RecordId",
    "PointSet",
    "Unit",
    "Descriptors",
    "About",
    "Fingerprint",
    "ListsBy",
    "RowOrder",
];

/// Per module the stages it may import, a row that ends in `/` for a folder within one. A new
/// module needs a row here, and a reason.
const ARROWS: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("line", &[]),
    // Runs code of others, whatever it does.
    ("guard", &[]),
    ("ids", &[]),
    ("about", &[]),
    // Chooses between functions, whatever they do.
    ("compiled", &[]),
    ("seed", &[]),
    ("points", &[]),
    ("descriptors", &[]),
    ("simd", &[]),
    ("geometry", &[]),
    ("synthetic", &[]),
    ("truth", &[]),
    ("released", &[]),
    // Used by `neighbors` (lists) and `recover` (positions), which may not know each other's making.
    ("density", &["released"]),
    ("obfuscate", &["truth", "released"]),
    ("neighbors", &["released", "density"]),
    ("neighbors/oracle/", &["truth", "released"]),
    ("recover", &["released", "neighbors", "density"]),
    ("evaluate", &["truth", "released", "recover"]),
    // `density` for the second baseline, whose attacks share one look at the records.
    ("audit", &["truth", "released", "density", "obfuscate", "neighbors", "recover", "evaluate"]),
];

/// Inside `recover`, per file or folder those that it may import; `mod.rs` stands above all of them. What several
/// solvers share is `map`, and nothing there knows of a solver.
pub const INSIDE_RECOVER: &[(&str, &[&str])] = &[
    ("options", &[]),
    ("result", &[]),
    ("map", &["result"]),
    ("consensus", &["map", "result"]),
    ("joint", &["map", "result"]),
    // The published density attacks stand on `density` alone.
    ("baselines", &["map", "result"]),
    ("placement", &["map", "result"]),
    // Chosen by how well consensus does.
    ("delta", &["map", "consensus"]),
    ("exact", &["map", "result"]),
    ("confidence", &["map", "result", "options"]),
    ("pairs_of_descriptors", &[]),
    ("checks", &[]),
    ("model", &["map", "options"]),
    (
        "problem",
        &[
            "options",
            "result",
            "map",
            "consensus",
            "joint",
            "baselines",
            "placement",
            "delta",
            "exact",
            "confidence",
            "pairs_of_descriptors",
            "checks",
            "model",
        ],
    ),
    ("parts", &["checks", "model", "pairs_of_descriptors", "problem", "result"]),
];

/// Dependencies of the core: light, and known for long.
pub const DEPENDENCIES: &[&str] = &["libm", "rayon", "nalgebra", "sha2", "chacha20", "getrandom"];

/// What a crate of this workspace may import of the others.
pub const CRATES: &[(&str, &[&str])] = &[
    ("unlift", &[]),
    ("unlift-io", &["unlift"]),
    ("unlift-nn", &["unlift"]),
    ("unlift-features", &["unlift", "unlift-nn"]),
    ("unlift-report", &[]),
    ("unlift-testkit", &["unlift"]),
    ("unlift-invert", &["unlift", "unlift-nn", "unlift-features"]),
    ("unlift-demo", &["unlift", "unlift-features", "unlift-invert"]),
    (
        "unlift-audit",
        &["unlift", "unlift-io", "unlift-nn", "unlift-features", "unlift-invert", "unlift-report"],
    ),
    (
        "unlift-cli",
        &[
            "unlift",
            "unlift-audit",
            "unlift-demo",
            "unlift-io",
            "unlift-nn",
            "unlift-features",
            "unlift-invert",
            "unlift-report",
        ],
    ),
];

/// Lines of a file at most, its unit tests not counted.
pub const MOST_LINES: usize = 800;

/// What recovery may know of `neighbors`: lists as they are.
const LISTS: &[&str] = &["Neighborhoods"];

/// Files of `obfuscate/` that are not schemes.
pub const NO_SCHEMES: &[&str] = &["mod", "pairs", "scheme", "hide", "size"];

/// Imports of `source` that no row of [`ARROWS`] allows.
pub fn forbidden_arrows(source: &Source) -> Vec<String> {
    let stage = source.path.split('/').next().unwrap_or_default().trim_end_matches(".rs");
    if stage == "lib" {
        return Vec::new();
    }
    let row = |name: &str| ARROWS.iter().find(|(module, _)| *module == name);
    let folder =
        ARROWS.iter().find(|(module, _)| module.ends_with('/') && source.path.starts_with(module));
    let Some((_, allowed)) = folder.or_else(|| row(stage)) else {
        return vec![format!("{}: module `{stage}` has no row in ARROWS", source.path)];
    };
    let mut found = Vec::new();
    for path in internal_paths(source) {
        let to = path[0].as_str();
        // Recovery takes lists as they are; how they were made is none of its business.
        let only_the_type = stage != "recover"
            || to != "neighbors"
            || path.get(1).is_some_and(|item| LISTS.contains(&item.as_str()));
        let known = to == stage || VOCABULARY.contains(&to) || ROOT_NAMES.contains(&to);
        if !(known || allowed.contains(&to) && only_the_type) {
            found.push(format!("{}: imports {}", source.path, path.join("::")));
        }
    }
    found
}

/// Calls that open the truth where no one may.
pub fn forbidden_reveals(source: &Source) -> Vec<String> {
    let may = ["obfuscate/", "evaluate/", "neighbors/oracle/", "truth/original.rs"];
    if may.iter().any(|prefix| source.path.starts_with(prefix)) {
        return Vec::new();
    }
    complain(source, &["reveal"])
}

/// Keys where the attacker works: in an audit it is handed the integer that the owner's key is made of.
pub fn forbidden_keys(source: &Source) -> Vec<String> {
    let attacker = ["recover/", "density/", "neighbors/", "released/", "evaluate/"];
    if !attacker.iter().any(|prefix| source.path.starts_with(prefix)) {
        return Vec::new();
    }
    complain(source, &["Key", "StageKey", "Cipher"])
}

/// Global state and the outside world, in recovery.
pub fn forbidden_state(source: &Source) -> Vec<String> {
    if !source.path.starts_with("recover/") {
        return Vec::new();
    }
    let mut found = complain(source, &["thread_local", "OnceLock", "LazyLock", "Mutex"]);
    for path in paths(&source.code, &["std"]) {
        if let Some(module @ ("fs" | "env" | "net" | "process" | "time")) =
            path.get(1).map(String::as_str)
        {
            found.push(format!("{}: uses std::{module}", source.path));
        }
    }
    found
}

/// `unsafe` outside the one file that may.
pub fn forbidden_unsafe(source: &Source) -> Vec<String> {
    if source.path == "simd.rs" { Vec::new() } else { complain(source, &["unsafe"]) }
}

/// Macros that panic where nobody hears them, and print names as they are: the command line has one place each for what
/// goes to stdout and stderr.
pub fn forbidden_prints(source: &Source) -> Vec<String> {
    let macros = ["print", "println", "eprint", "eprintln", "dbg"];
    let tokens = tokens(&source.code);
    let calls = tokens.windows(2).filter(|two| two[1] == "!" && macros.contains(&&*two[0]));
    calls.map(|two| format!("{}: `{}!`", source.path, two[0])).collect()
}

fn complain(source: &Source, words: &[&str]) -> Vec<String> {
    let tokens = tokens(&source.code);
    let hit = |word: &&str| tokens.iter().any(|token| token == word);
    words.iter().copied().filter(hit).map(|word| format!("{}: `{word}`", source.path)).collect()
}

/// Scheme files whose entry the registry `SCHEMES` in `module` does not list.
pub fn unregistered(files: &[&str], module: &str) -> Vec<String> {
    let registry = module.split("SCHEMES: &[Entry] = &[").nth(1).unwrap_or_default();
    let registry = registry.split("];").next().unwrap_or_default();
    let listed: BTreeSet<&str> =
        registry.split(',').filter_map(|row| row.trim().strip_suffix("::ENTRY")).collect();
    let stems = files.iter().filter_map(|file| file.strip_suffix(".rs"));
    stems
        .filter(|stem| !NO_SCHEMES.contains(stem) && !listed.contains(stem))
        .map(|stem| format!("obfuscate/{stem}.rs: not in SCHEMES"))
        .collect()
}

/// Lines of a file, the unit tests at its bottom not counted.
pub fn counted_lines(text: &str) -> usize {
    let bottom = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    text[..bottom].lines().count()
}

/// Names under `[section]` of a manifest.
pub fn manifest_names(manifest: &str, section: &str) -> Vec<String> {
    let header = format!("[{section}]");
    let body = manifest.lines().skip_while(|line| line.trim() != header).skip(1);
    body.take_while(|line| !line.starts_with('['))
        .filter(|line| !line.starts_with('#'))
        .filter_map(|line| line.split(['=', '.']).next())
        .map(|name| name.trim().to_owned())
        .filter(|name| !name.is_empty())
        .collect()
}
