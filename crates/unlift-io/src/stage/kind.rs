//! The kinds of stage files, and the arrays that each may have.

use std::fmt;

/// The foot and the directions of each descriptor's subspace, in place of `descriptor`.
pub(super) const SUBSPACE: &str = "descriptor_subspace";
/// The numbers of words of each descriptor, in place of `descriptor`.
pub(super) const WORDS: &str = "descriptor_words";
/// The descriptors that owner and attacker know.
pub(super) const PUBLIC: &str = "public_descriptor";

// The arrays of each kind, besides the metadata.
const RELEASED: &str = "foot direction center centers regions axis offset position descriptor descriptor_subspace \
                        descriptor_words public_descriptor origin bounds";
const TRUTH: &str = "position slot dropped swapped_axis descriptor_row";
const RECOVERED: &str =
    "position status support evidence found error_scale axis descriptor_row origin";

/// The content of a stage file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// An obfuscated map: the attacker's side.
    Released,
    /// Originals and the secret of an obfuscation: the owner's side.
    Truth,
    /// Lists of records, one per slot.
    Neighborhoods,
    /// Lists of original points, one per point.
    PointNeighborhoods,
    /// Recovered points, one per slot.
    Recovered,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 5] = [
        Self::Released,
        Self::Truth,
        Self::Neighborhoods,
        Self::PointNeighborhoods,
        Self::Recovered,
    ];

    /// The name in files, the name in errors, and the arrays that a file may have besides the metadata.
    fn facts(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Self::Released => ("released", "a released map", RELEASED),
            Self::Truth => ("truth", "a truth file", TRUTH),
            Self::Neighborhoods => {
                ("neighborhoods", "neighborhoods of slots", "records slots scores")
            }
            Self::PointNeighborhoods => {
                ("point_neighborhoods", "neighborhoods of points", "neighbors scores")
            }
            Self::Recovered => ("recovered", "a file of recovered points", RECOVERED),
        }
    }

    /// The name used in files.
    pub fn name(self) -> &'static str {
        self.facts().0
    }

    pub(super) fn arrays(self) -> impl Iterator<Item = &'static str> {
        self.facts().2.split(' ')
    }

    /// Returns the kind that alone may have such arrays.
    pub(super) fn of_arrays<'a>(mut names: impl Iterator<Item = &'a str>) -> Option<Self> {
        names.find_map(|name| {
            let mut kinds =
                Self::ALL.into_iter().filter(|kind| kind.arrays().any(|its| its == name));
            kinds.next().filter(|_| kinds.next().is_none())
        })
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.facts().1)
    }
}
