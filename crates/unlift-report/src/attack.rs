//! The lists of neighbors behind an attack: their source and quality, or none at all.

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
        let noise =
            |given: &Self| given.oracle_noise.clone().unwrap_or_else(|| "uniform".to_owned());
        self.neighbors == other.neighbors
            && (!is_oracle(&self.neighbors)
                || (self.inlier_ratio == other.inlier_ratio && noise(self) == noise(other)))
    }

    pub(crate) fn label(&self) -> String {
        neighborhoods(&self.neighbors, self.oracle_noise.as_deref(), self.inlier_ratio)
    }
}

const WITHOUT_NEIGHBORS: [&str; 2] = ["density", "tomography"];

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

/// Returns the basis of a row.
pub(crate) fn basis(row: &Row) -> Basis {
    basis_of(&row.neighbors, &row.solver)
}

pub(crate) fn basis_of(neighbors: &str, solver: &str) -> Basis {
    match neighbors {
        _ if !looks_at_neighbors(solver) => Basis::Released,
        "oracle" => Basis::Oracle,
        name if name.starts_with(TRACKS) => Basis::Oracle,
        "file" => Basis::Given,
        _ => Basis::Released,
    }
}

/// Sources of a sequence, before the number of queries: links by descriptors, and by true tracks.
const SEQUENCE: &str = "sequence@";
pub(crate) const SEQUENCE_AND_LISTS: &str = "sequence+lists@";
const TRACKS: &str = "tracks@";

/// Sources of two releases: links by descriptors, and by geometry alone.
pub(crate) const AGAIN: &str = "again";
const AGAIN_GEOMETRY: &str = "again-geometry";

/// Returns whether a row is of two releases.
pub(crate) fn is_again(neighbors: &str) -> bool {
    [AGAIN, AGAIN_GEOMETRY].contains(&neighbors)
}

/// Returns whether a row needs no lists of neighbors, because it intersects several releases.
pub(crate) fn intersects(neighbors: &str) -> bool {
    is_again(neighbors) || queries(neighbors).is_some()
}

/// Returns the number of queries of a row of a sequence, as text.
pub(crate) fn queries(neighbors: &str) -> Option<&str> {
    [SEQUENCE, SEQUENCE_AND_LISTS, TRACKS].iter().find_map(|by| neighbors.strip_prefix(by))
}

pub(crate) fn has_neighborhoods(row: &Row) -> bool {
    looks_at_neighbors(&row.solver)
}

pub(crate) fn looks_at_neighbors(solver: &str) -> bool {
    !WITHOUT_NEIGHBORS.contains(&solver)
}

pub(crate) fn without_solver(given: &Given, solver: &str) -> String {
    if looks_at_neighbors(solver) { given.label() } else { records_alone(Some(solver)) }
}

pub(crate) fn is_oracle(neighbors: &str) -> bool {
    neighbors == "oracle"
}

/// Returns the name of a source as users type it: `oracle`, `oracle (near)`, `overlap`, `given lists`.
pub(crate) fn source(neighbors: &str, oracle_noise: Option<&str>) -> String {
    match (neighbors, oracle_noise) {
        ("oracle", None | Some("uniform")) => "oracle".to_owned(),
        ("oracle", Some(noise)) => format!("oracle ({noise})"),
        ("file", _) => "given lists".to_owned(),
        (own, _) => own.to_owned(),
    }
}

/// Returns the name of a source in plain words, for the page: `known neighbors`, `neighbors by descriptor overlap`.
pub(crate) fn plain_source(neighbors: &str, oracle_noise: Option<&str>) -> String {
    match (neighbors, oracle_noise) {
        ("oracle", None | Some("uniform")) => "known neighbors".to_owned(),
        ("oracle", Some(noise)) => format!("known neighbors, wrong ones {noise}"),
        ("file", _) => "neighbors from a file".to_owned(),
        ("overlap", _) => "neighbors by descriptor overlap".to_owned(),
        ("similarity", _) => "neighbors by descriptor similarity".to_owned(),
        ("learned", _) => "neighbors by a learned network".to_owned(),
        ("geometric", _) => "neighbors by record geometry".to_owned(),
        (AGAIN, _) => "two releases, linked by descriptors".to_owned(),
        (AGAIN_GEOMETRY, _) => "two releases, linked by geometry".to_owned(),
        (own, _) if own.starts_with(TRACKS) => {
            format!("{} queries with known poses and tracks", &own[TRACKS.len()..])
        }
        (own, _) if own.starts_with(SEQUENCE_AND_LISTS) => {
            let n = &own[SEQUENCE_AND_LISTS.len()..];
            format!("{n} queries with known poses, and neighbors by descriptors")
        }
        (own, _) if own.starts_with(SEQUENCE) => {
            format!("{} queries with known poses", &own[SEQUENCE.len()..])
        }
        (own, _) => format!("neighbors by {own}"),
    }
}

/// Returns the label of neighborhoods on the page: `known neighbors, 50 % right`.
pub(crate) fn neighborhoods(neighbors: &str, oracle_noise: Option<&str>, ratio: f64) -> String {
    let source = plain_source(neighbors, oracle_noise);
    format!("{source}, {} % right", words::ratio_percent(ratio))
}

/// Returns the attack of a row in a few words, for a sentence: `known neighbors`, `records alone`.
pub(crate) fn briefly(row: &Row) -> String {
    match row.neighbors.as_str() {
        _ if !has_neighborhoods(row) => "records alone".to_owned(),
        _ => plain_source(&row.neighbors, row.oracle_noise.as_deref()),
    }
}

/// Returns the whole attack of a row: `known neighbors, 50 % right, solver joint`.
pub(crate) fn name(row: &Row) -> String {
    if !has_neighborhoods(row) {
        return records_alone(Some(&row.solver));
    }
    if intersects(&row.neighbors) {
        return plain_source(&row.neighbors, None);
    }
    // The attacker chooses the length of its own lists, and the share of right neighbors depends on it.
    let given = match basis(row) {
        Basis::Released | Basis::Given => {
            let (source, right) =
                (plain_source(&row.neighbors, None), words::ratio_percent(row.inlier_ratio));
            format!("{source}, {} listed, {right} % of them right", row.k)
        }
        _ => neighborhoods(&row.neighbors, row.oracle_noise.as_deref(), row.inlier_ratio),
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
