//! The attack behind a row: its scheme, its lists of neighbors, its solver, and their names.

use crate::document::Row;
use crate::words;

/// A kind of neighborhoods (lists of neighbors): their source and quality.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Given {
    /// `oracle`, `file`, or the name of the attacker's source.
    pub neighbors: String,
    /// How the oracle chose the wrong neighbors; `None` for other sources.
    pub oracle_noise: Option<String>,
    /// Share of right neighbors: as requested for the oracle, measured for other sources.
    pub inlier_ratio: f64,
}

/// An attack, as a row of the results names it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Attack {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The neighborhoods.
    pub given: Given,
    /// The solver's name.
    pub solver: String,
}

/// What one attack recovers, as the page shows it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ByAttack<T> {
    /// The attack.
    pub attack: Attack,
    /// Recovered positions, or a picture painted from them.
    pub recovered: T,
}

impl Given {
    /// Returns the neighborhoods of a row.
    pub fn of(row: &Row) -> Self {
        Self {
            neighbors: row.neighbors.clone(),
            oracle_noise: row.oracle_noise.clone(),
            inlier_ratio: row.inlier_ratio,
        }
    }

    /// Returns whether both are one choice on the page. A measured ratio is ignored, because it differs
    /// between schemes, images and repeats.
    pub(crate) fn same_choice(&self, other: &Self) -> bool {
        self.neighbors == other.neighbors
            && (!is_oracle(&self.neighbors)
                || (self.inlier_ratio == other.inlier_ratio
                    && noise(&self.oracle_noise) == noise(&other.oracle_noise)))
    }

    /// Returns the name of the source as users type it: `oracle`, `oracle (near)`, `overlap`, `given lists`.
    pub(crate) fn source(&self) -> String {
        match (self.neighbors.as_str(), self.oracle_noise.as_deref()) {
            ("oracle", None | Some("uniform")) => "oracle".to_owned(),
            ("oracle", Some(noise)) => format!("oracle ({noise})"),
            ("file", _) => "given lists".to_owned(),
            (own, _) => own.to_owned(),
        }
    }

    pub(crate) fn plain_source(&self) -> String {
        plain_source(&self.neighbors, self.oracle_noise.as_deref())
    }

    /// Returns the source and its quality: `known neighbors, 50 % right`.
    pub(crate) fn label(&self) -> String {
        format!("{}, {} % right", self.plain_source(), words::ratio_percent(self.inlier_ratio))
    }
}

impl Attack {
    /// Returns the attack of a row.
    pub fn of(row: &Row) -> Self {
        let (scheme, solver) = (row.scheme.clone(), row.solver.clone());
        Self { scheme, given: Given::of(row), solver }
    }

    /// Returns whether `row` has the figures of this attack.
    pub(crate) fn is_of(&self, row: &Row) -> bool {
        row.scheme == self.scheme
            && row.solver == self.solver
            && self.given.same_choice(&Given::of(row))
    }
}

/// Returns the name of the oracle's noise model; documents of earlier versions have none.
pub(crate) fn noise(name: &Option<String>) -> &str {
    name.as_deref().unwrap_or("uniform")
}

/// The data behind an attack.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Basis {
    /// The released data alone: lists that an attacker makes from it, or no lists.
    Released,
    /// Lists from a file.
    Given,
    /// Lists made from the originals, at a chosen inlier ratio.
    Oracle,
}

impl Basis {
    pub(crate) const ALL: [Self; 3] = [Self::Released, Self::Given, Self::Oracle];

    pub(crate) fn of(neighbors: &str, solver: &str) -> Self {
        match neighbors {
            _ if !reads_lists(solver) => Self::Released,
            "oracle" => Self::Oracle,
            name if queries(name).is_some_and(|(by, _)| by == TRACKS) => Self::Oracle,
            "file" => Self::Given,
            _ => Self::Released,
        }
    }
}

pub(crate) fn basis(row: &Row) -> Basis {
    Basis::of(&row.neighbors, &row.solver)
}

/// Sources of a sequence, before the number of queries: links by descriptors, and by true tracks.
const SEQUENCE: &str = "sequence";
pub(crate) const SEQUENCE_AND_LISTS: &str = "sequence+lists";
const TRACKS: &str = "tracks";

/// The attacker's own sources that use descriptors.
pub(crate) const BY_DESCRIPTORS: [&str; 4] = ["similarity", "overlap", "learned", BEST];
/// The source that chooses the best of the others for given descriptors.
pub(crate) const BEST: &str = "descriptors";

/// Sources of two releases: links by descriptors, and by geometry alone.
pub(crate) const AGAIN: &str = "again";
const AGAIN_GEOMETRY: &str = "again-geometry";

pub(crate) fn is_again(neighbors: &str) -> bool {
    [AGAIN, AGAIN_GEOMETRY].contains(&neighbors)
}

/// Returns the source and the number of queries of a row of a sequence: `tracks` and `5` of `tracks@5`.
pub(crate) fn queries(neighbors: &str) -> Option<(&str, &str)> {
    let sources = [SEQUENCE, SEQUENCE_AND_LISTS, TRACKS];
    neighbors.split_once('@').filter(|(by, _)| sources.contains(by))
}

/// Returns whether a row needs no lists of neighbors, because it intersects several releases.
pub(crate) fn intersects(neighbors: &str) -> bool {
    is_again(neighbors) || queries(neighbors).is_some()
}

pub(crate) fn reads_lists(solver: &str) -> bool {
    !["density", "tomography"].contains(&solver)
}

pub(crate) fn is_oracle(neighbors: &str) -> bool {
    neighbors == "oracle"
}

/// Returns the name of a source in plain words, for the page: `known neighbors`, `neighbors by descriptor overlap`.
pub(crate) fn plain_source(neighbors: &str, oracle_noise: Option<&str>) -> String {
    let name = match (neighbors, oracle_noise) {
        ("oracle", None | Some("uniform")) => "known neighbors",
        ("oracle", Some(noise)) => return format!("known neighbors, wrong ones {noise}"),
        ("file", _) => "neighbors from a file",
        ("overlap", _) => "neighbors by descriptor overlap",
        ("similarity", _) => "neighbors by descriptor similarity",
        ("learned", _) => "neighbors by a learned network",
        ("geometric", _) => "neighbors by record geometry",
        (AGAIN, _) => "two releases, linked by descriptors",
        (AGAIN_GEOMETRY, _) => "two releases, linked by geometry",
        (own, _) => match queries(own) {
            None => return format!("neighbors by {own}"),
            Some((by, n)) => {
                let more = match by {
                    TRACKS => " and tracks",
                    SEQUENCE_AND_LISTS => ", and neighbors by descriptors",
                    _ => "",
                };
                return format!("{n} queries with known poses{more}");
            }
        },
    };
    name.to_owned()
}

/// Returns the attack of a row in a few words, for a sentence: `known neighbors`, `records alone`.
pub(crate) fn briefly(row: &Row) -> String {
    match reads_lists(&row.solver) {
        true => Given::of(row).plain_source(),
        false => records_alone(None),
    }
}

/// Returns the whole attack of a row: `known neighbors, 50 % right, solver joint`.
pub(crate) fn name(row: &Row) -> String {
    if !reads_lists(&row.solver) {
        return records_alone(Some(&row.solver));
    }
    if intersects(&row.neighbors) {
        return plain_source(&row.neighbors, None);
    }
    // The attacker chooses the length of its own lists, and the share of right neighbors depends on it.
    let given = match basis(row) {
        Basis::Released | Basis::Given => {
            let source = plain_source(&row.neighbors, None);
            let right = words::ratio_percent(row.inlier_ratio);
            format!("{source}, {} listed, {right} % of them right", row.k)
        }
        Basis::Oracle => Given::of(row).label(),
    };
    format!("{given}, solver {}", row.solver)
}

/// Returns the label of an attack without neighborhoods and descriptors: `records alone (tomography)`.
pub(crate) fn records_alone(by: Option<&str>) -> String {
    by.map_or_else(|| "records alone".to_owned(), |by| format!("records alone ({by})"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_measured_ratio_makes_no_other_choice() {
        let given = |neighbors: &str, noise: Option<&str>, inlier_ratio| Given {
            neighbors: neighbors.into(),
            oracle_noise: noise.map(str::to_owned),
            inlier_ratio,
        };
        let oracle = given("oracle", None, 0.5);
        assert!(given("overlap", None, 0.11).same_choice(&given("overlap", None, 0.12)));
        assert!(oracle.same_choice(&given("oracle", Some("uniform"), 0.5)));
        assert!(!oracle.same_choice(&given("oracle", Some("near"), 0.5)));
        assert!(!oracle.same_choice(&given("oracle", None, 0.3)));
        assert!(!oracle.same_choice(&given("overlap", None, 0.5)));
    }
}
