//! Sources of neighborhoods by name: those of the core, and those that need a network.

use unlift::Error;
use unlift::neighbors::sources::{self, Named, SourceEntry};

/// Returns all sources.
pub fn all() -> Vec<&'static SourceEntry> {
    sources::SOURCES.iter().chain(unlift_nn::SOURCES).collect()
}

/// Returns the source called `name`.
///
/// # Errors
/// If there is none; the error lists the names.
pub fn named(name: &str) -> Result<Named, Error> {
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
