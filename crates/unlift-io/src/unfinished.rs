//! What an unfinished output is called, so that it is known again, and not told to anybody.

use std::path::{Path, PathBuf};

const SIGN: &str = ".unlift-";
const ENDING: &str = ".partial";
/// Random letters in a name.
pub(crate) const RANDOM: usize = 6;

/// What stands before and behind the random letters in the name of what will be `name`.
pub(crate) fn around(name: &str) -> (String, &'static str) {
    // File names end at 255 bytes, and this one is longer.
    (format!(".{}{SIGN}", name.chars().take(40).collect::<String>()), ENDING)
}

/// Whether the last part of `path` is such a name.
pub(crate) fn is_partial_name(path: &Path) -> bool {
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return false };
    let random = name.strip_suffix(ENDING).and_then(|name| name.rsplit_once(SIGN));
    name.starts_with('.')
        && random.is_some_and(|(_, random)| {
            random.len() == RANDOM && random.bytes().all(|byte| byte.is_ascii_alphanumeric())
        })
}

/// Where what is built at `path` will stand: the same outside of folders of such names.
pub(crate) fn place_of(path: PathBuf) -> PathBuf {
    let is_within = path.ancestors().any(is_partial_name);
    if !is_within {
        return path;
    }
    path.components().filter(|part| !is_partial_name(part.as_ref())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_built_apart_is_told_by_its_place() {
        let of = |path: &str| place_of(path.into()).to_string_lossy().into_owned();
        assert_eq!(of("out/.output.unlift-abC123.partial/a/truth.parquet"), "out/a/truth.parquet");
        for path in ["./out/a", "../a.partial/b", ".output.unlift-abc.partial/b"] {
            assert_eq!(of(path), path);
        }
    }
}
