//! Files that documents and comments name: each must exist.

/// Endings of names that are looked up.
const ENDINGS: [&str; 4] = [".md", ".rs", ".py", ".svg"];

/// What comments of a Rust file say, line by line; of any other file all of it. A comment ends with its line.
pub fn prose<'a>(path: &str, text: &'a str) -> Vec<&'a str> {
    let is_rust = path.ends_with(".rs");
    let comment = |line: &'a str| {
        // Not of a web address.
        let mut starts = line.match_indices("//").filter(|&(at, _)| !line[..at].ends_with(':'));
        starts.next().map_or("", |(at, _)| &line[at..])
    };
    text.lines().map(|line| if is_rust { comment(line) } else { line }).collect()
}

/// File names in `line`: longest runs of the characters of paths that end as files do. No web address.
fn named(line: &str) -> impl Iterator<Item = &str> {
    let of_path = |c: char| c.is_ascii_alphanumeric() || "_-./:".contains(c);
    let runs = line.split(move |c| !of_path(c)).map(|run| run.trim_end_matches(['.', ':', '/']));
    runs.filter(|run| {
        let stem = ENDINGS.iter().find_map(|ending| run.strip_suffix(ending));
        stem.is_some_and(|stem| !stem.is_empty() && !run.contains("://"))
    })
}

/// Names in the prose of `path` that no file of the repository has, with their lines. A name may leave out folders it
/// is in; `files` are paths from the root.
pub fn dangling(path: &str, text: &str, files: &[String]) -> Vec<String> {
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
