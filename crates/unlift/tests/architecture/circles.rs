//! Who imports whom, file by file: no circles, and inside `recover` no arrow that runs back up.

use std::collections::{BTreeMap, BTreeSet};

use crate::rules::INSIDE_RECOVER;
use crate::rust::{Source, exported, internal_paths, paths, without_exports};

/// The module of a file: names from the root.
fn module(path: &str) -> Vec<String> {
    let mut names: Vec<String> =
        path.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
    if names.last().is_some_and(|name| name == "mod" || name == "lib") {
        names.pop();
    }
    names
}

/// The file of each module.
fn files(sources: &[Source]) -> BTreeMap<Vec<String>, &str> {
    sources.iter().map(|source| (module(&source.path), source.path.as_str())).collect()
}

/// Paths from the root that start with a module that `source` itself declares.
fn paths_into_children(source: &Source, files: &BTreeMap<Vec<String>, &str>) -> Vec<Vec<String>> {
    let own = module(&source.path);
    let is_child =
        |module: &&Vec<String>| module.len() == own.len() + 1 && module.starts_with(&own);
    let children: Vec<&str> =
        files.keys().filter(is_child).filter_map(|module| Some(module.last()?.as_str())).collect();
    let found = paths(&source.code, &children).into_iter();
    found.map(|path| [&own[..], &path[..]].concat()).collect()
}

/// Without the unit tests at its bottom, which may look at everything.
fn without_tests(source: &Source) -> Source {
    let bottom = source.code.find("#[cfg(test)]\nmod tests {").unwrap_or(source.code.len());
    Source { path: source.path.clone(), code: source.code[..bottom].to_owned() }
}

/// The file that holds what `path` names: the longest module of it.
fn file_of<'a>(
    path: &[String],
    files: &BTreeMap<Vec<String>, &'a str>,
) -> Option<(&'a str, usize)> {
    (0..=path.len()).rev().find_map(|n| Some((*files.get(&path[..n])?, n)))
}

/// Names that a file only hands on, with the paths behind them.
type Exports = BTreeMap<String, BTreeMap<String, Vec<String>>>;

fn exports(sources: &[Source], files: &BTreeMap<Vec<String>, &str>) -> Exports {
    let of = |source: &Source| {
        let only_exports = Source { path: source.path.clone(), code: exported(&source.code) };
        let mut found = internal_paths(&only_exports);
        found.extend(paths_into_children(&only_exports, files));
        found.into_iter().filter_map(|path| Some((path.last()?.clone(), path))).collect()
    };
    sources.iter().map(|source| (source.path.clone(), of(source))).collect()
}

/// Per file the files it imports. A name that a module hands on counts as one of the file that it comes from: `mod.rs` is then a
/// table of contents, not a file that imports its children.
fn imports(sources: &[Source]) -> BTreeMap<String, BTreeSet<String>> {
    let files = files(sources);
    let exports = exports(sources, &files);
    let mut all = BTreeMap::new();
    for source in sources.iter().filter(|source| !source.path.ends_with("tests.rs")) {
        let own = without_tests(source);
        let own = Source { code: without_exports(&own.code), path: own.path };
        let mut found = internal_paths(&own);
        found.extend(paths_into_children(&own, &files));
        let mut to = BTreeSet::new();
        for mut path in found {
            while let Some((file, n)) = file_of(&path, &files) {
                match path.get(n).and_then(|name| exports[file].get(name)) {
                    Some(behind) if *behind != path => path = behind.clone(),
                    _ => {
                        to.insert(file.to_owned());
                        break;
                    }
                }
            }
        }
        to.retain(|file| *file != source.path && file != "lib.rs");
        all.insert(source.path.clone(), to);
    }
    all
}

/// Files that import each other, in circles of any length.
pub fn circles(sources: &[Source]) -> Vec<String> {
    let imports = imports(sources);
    let reached = |from: &String| {
        let mut seen = BTreeSet::new();
        let mut open = vec![from];
        while let Some(file) = open.pop() {
            for next in imports.get(file).into_iter().flatten() {
                if seen.insert(next.clone()) {
                    open.push(next);
                }
            }
        }
        seen
    };
    let all: BTreeMap<&String, BTreeSet<String>> =
        imports.keys().map(|file| (file, reached(file))).collect();
    let mut found = BTreeSet::new();
    for (file, reached) in &all {
        if reached.contains(*file) {
            let circle: Vec<&str> = reached
                .iter()
                .filter(|other| all.get(other).is_some_and(|there| there.contains(*file)))
                .map(String::as_str)
                .collect();
            found.insert(format!("in a circle: {}", circle.join(", ")));
        }
    }
    found.into_iter().collect()
}

/// Imports inside `recover` from a part that stands below, or from a `mod.rs` above.
pub fn back_arrows(sources: &[Source]) -> Vec<String> {
    let files = files(sources);
    let mut found = Vec::new();
    let inside = |source: &&Source| source.path.starts_with("recover/");
    for source in sources.iter().filter(inside).map(without_tests) {
        let path = &source.path;
        if path == "recover/mod.rs" {
            continue;
        }
        let part = |module: &[String]| module.get(1).cloned().unwrap_or_default();
        let own = part(&module(path));
        let Some((_, allowed)) = INSIDE_RECOVER.iter().find(|(name, _)| *name == own) else {
            found.push(format!("{path}: `{own}` has no row in INSIDE_RECOVER"));
            continue;
        };
        for to in internal_paths(&source).iter().filter(|to| to[0] == "recover") {
            let Some((file, _)) = file_of(to, &files) else { continue };
            let folder = file.strip_suffix("mod.rs");
            let is_above = folder.is_some_and(|folder| path.starts_with(folder) && path != file);
            let other = part(to);
            if is_above || other != own && !allowed.contains(&other.as_str()) {
                found.push(format!("{path}: imports {}", to.join("::")));
            }
        }
    }
    found
}
