//! The content of a folder, and comparisons of two.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::Value;

/// Files and folders below a folder by relative path; paths of folders end with a slash.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tree(BTreeMap<String, Vec<u8>>);

impl Tree {
    pub const fn new() -> Self {
        Self(BTreeMap::new())
    }

    /// Reads a folder, which others may be changing.
    pub fn of(root: &Path) -> Self {
        let mut tree = Self::default();
        tree.add(root, "");
        tree
    }

    fn add(&mut self, folder: &Path, within: &str) {
        let Ok(entries) = fs::read_dir(folder) else { return };
        for entry in entries.flatten() {
            let name = format!("{within}{}", entry.file_name().to_string_lossy());
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                self.add(&entry.path(), &format!("{name}/"));
                self.0.insert(format!("{name}/"), Vec::new());
            } else if let Ok(bytes) = fs::read(entry.path()) {
                self.0.insert(name, bytes);
            }
        }
    }

    /// Keeps only the results of audits, without names, hashes and notes.
    pub fn figures(&self) -> Self {
        let mut tree = self.files_without(|name| !name.ends_with("audit.json"));
        for bytes in tree.0.values_mut() {
            let Ok(mut value) = serde_json::from_slice::<Value>(bytes) else { continue };
            if let Some(value) = value.as_object_mut() {
                value.retain(|name, _| !["input", "notes"].contains(&name.as_str()));
            }
            *bytes = value.to_string().into_bytes();
        }
        tree
    }

    pub fn put(&self, root: &Path) {
        for (name, bytes) in &self.0 {
            let path = root.join(name);
            if name.ends_with('/') {
                fs::create_dir_all(path).unwrap();
            } else {
                fs::create_dir_all(path.parent().expect("a folder")).unwrap();
                fs::write(path, bytes).unwrap();
            }
        }
    }

    /// Iterates over the paths; those of folders end with a slash.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    pub fn get(&self, name: &str) -> Option<&[u8]> {
        self.0.get(name).map(Vec::as_slice)
    }

    pub fn size(&self) -> usize {
        self.0.values().map(Vec::len).sum()
    }

    pub fn largest(&self) -> usize {
        self.0.values().map(Vec::len).max().unwrap_or(0)
    }

    /// Returns the files for which `is_other` is false.
    pub fn files_without(&self, is_other: impl Fn(&str) -> bool) -> Self {
        let kept = self.0.iter().filter(|(name, _)| !name.ends_with('/') && !is_other(name));
        Self(kept.map(|(name, bytes)| (name.clone(), bytes.clone())).collect())
    }

    /// Removes what differs between two runs of one command: duration and memory.
    pub fn settled(mut self) -> Self {
        for (name, bytes) in &mut self.0 {
            if name.ends_with("audit.json") {
                *bytes = figures(bytes);
            } else if name.ends_with("report.html") {
                *bytes = page(bytes);
            }
        }
        self
    }
}

/// Keeps only results; other content than JSON is unchanged.
fn figures(json: &[u8]) -> Vec<u8> {
    let Ok(mut value) = serde_json::from_slice::<Value>(json) else { return json.to_vec() };
    let run = value.as_object_mut().and_then(|value| value["run"].as_object_mut());
    if let Some(run) = run {
        run.retain(|name, _| !["seconds", "peak_memory_bytes"].contains(&name.as_str()));
    }
    value.to_string().into_bytes()
}

fn page(html: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(html);
    let (before, rest) = text.split_once("Seconds by stage.").unwrap_or((&text, ""));
    let rest = rest.split_once("</table>").map_or(rest, |(_, rest)| rest);
    let lines = before.lines().chain(rest.lines());
    let kept: Vec<&str> = lines.filter(|line| !line.contains("<dt>this run</dt>")).collect();
    kept.join("\n").into_bytes()
}

/// Returns true for unfinished files, which the next run removes.
pub fn is_partial(name: &str) -> bool {
    name.contains(".unlift-") && name.contains(".partial")
}

/// Returns true for finished images, from which the next run of `features` resumes.
pub fn is_part(name: &str) -> bool {
    name.contains(".parts/")
}

/// Returns the paths at which two trees differ.
pub fn differing(a: &Tree, b: &Tree) -> String {
    let mut names: Vec<&str> = a.names().chain(b.names()).collect();
    names.sort_unstable();
    names.dedup();
    names.retain(|name| a.get(name) != b.get(name));
    format!("differing: {names:?}")
}
