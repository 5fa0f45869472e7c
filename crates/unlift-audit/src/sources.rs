//! Sources of neighborhoods by name: those of the core, and those that need a network.

use unlift::Error;
use unlift::neighbors::sources::{self, Named, SourceEntry};

/// Returns all sources.
pub fn all() -> Vec<&'static SourceEntry> {
    let all = sources::SOURCES.iter();
    #[cfg(feature = "networks")]
    let all = all.chain(unlift_nn::SOURCES);
    all.collect()
}

/// Returns the source called `name`.
///
/// # Errors
/// If there is none; the error lists the names.
pub fn named(name: &str) -> Result<Named, Error> {
    if cfg!(not(feature = "networks")) && name.trim() == "learned" {
        let expected = "unlift-audit with the feature `networks`";
        return Err(Error::new("source learned", expected, "a build without it"));
    }
    Named::parse_among(name, &all())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_all_crates_are_known_and_different() {
        let all = all();
        for (at, entry) in all.iter().enumerate() {
            assert_eq!(named(entry.name).map(|named| named.name()), Ok(entry.name));
            assert!(all[..at].iter().all(|other| other.name != entry.name), "{}", entry.name);
        }
        assert!(all.iter().any(|entry| entry.name == "learned"));
    }
}
