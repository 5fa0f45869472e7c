//! The attack behind a row: its scheme, its lists of neighbors, its solver, and their names.

use crate::document::Row;
use crate::words;

/// What one attack recovers, as the page shows it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ByAttack<T> {
    /// A row that names the attack by its scheme, source, noise, inlier ratio and solver.
    pub row: Row,
    /// Recovered positions, or a picture painted from them.
    pub recovered: T,
}

/// Returns whether the lists of neighbors of both rows are one choice on the page. A measured ratio is ignored, because it differs
/// between schemes, images and repeats.
pub fn same_lists(a: &Row, b: &Row) -> bool {
    a.neighbors == b.neighbors
        && (!is_oracle(&a.neighbors)
            || (a.inlier_ratio == b.inlier_ratio
                && noise(&a.oracle_noise) == noise(&b.oracle_noise)))
}

/// Returns whether both rows are of one attack on one scheme.
pub(crate) fn is_same(a: &Row, b: &Row) -> bool {
    a.scheme == b.scheme && a.solver == b.solver && same_lists(a, b)
}

/// Returns the name of a row's source as users type it: `oracle`, `oracle (near)`, `overlap`, `given lists`.
pub(crate) fn source(row: &Row) -> String {
    match (row.neighbors.as_str(), noise(&row.oracle_noise)) {
        ("oracle", "uniform") => "oracle".to_owned(),
        ("oracle", noise) => format!("oracle ({noise})"),
        ("file", _) => "given lists".to_owned(),
        (own, _) => own.to_owned(),
    }
}

/// Returns the source of a row in plain words, for the page.
pub(crate) fn lists(row: &Row) -> String {
    plain_source(&row.neighbors, row.oracle_noise.as_deref())
}

/// Returns the source of a row and its quality: `known neighbors, 50 % right`.
pub(crate) fn label(row: &Row) -> String {
    format!("{}, {} % right", lists(row), words::ratio_percent(row.inlier_ratio))
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
}

pub(crate) fn basis(row: &Row) -> Basis {
    match row.neighbors.as_str() {
        _ if !reads_lists(&row.solver) => Basis::Released,
        "oracle" => Basis::Oracle,
        name if queries(name).is_some_and(|(by, _)| by == TRACKS) => Basis::Oracle,
        "file" => Basis::Given,
        _ => Basis::Released,
    }
}

/// Sources of a sequence, before `@` and the number of queries: links by descriptors, these with lists of neighbors within each query,
/// and links by the true tracks of the model, the oracle.
pub const SEQUENCES: [&str; 3] = [SEQUENCE, SEQUENCE_AND_LISTS, TRACKS];
/// Links that the attacker makes from descriptors.
pub const SEQUENCE: &str = "sequence";
/// Links from descriptors, combined with lists of neighbors within each query.
pub const SEQUENCE_AND_LISTS: &str = "sequence+lists";
/// Links that the tracks of the model give.
pub const TRACKS: &str = "tracks";

/// The attacker's own sources that use descriptors.
pub(crate) const BY_DESCRIPTORS: [&str; 4] = ["similarity", "overlap", "learned", BEST];
/// The source that chooses the best of the others for given descriptors.
pub(crate) const BEST: &str = "descriptors";

/// The source of two releases that are linked by descriptors.
pub const AGAIN: &str = "again";
/// The source of two releases that are linked by geometry alone.
pub const AGAIN_GEOMETRY: &str = "again-geometry";

pub(crate) fn is_again(neighbors: &str) -> bool {
    [AGAIN, AGAIN_GEOMETRY].contains(&neighbors)
}

/// Returns the source and the number of queries of a row of a sequence: `tracks` and `5` of `tracks@5`.
pub fn queries(neighbors: &str) -> Option<(&str, &str)> {
    neighbors.split_once('@').filter(|(by, _)| SEQUENCES.contains(by))
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
        true => lists(row),
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
        Basis::Oracle => label(row),
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
        let of = |neighbors: &str, noise: Option<&str>, inlier_ratio| Row {
            neighbors: neighbors.into(),
            oracle_noise: noise.map(str::to_owned),
            inlier_ratio,
            ..Row::default()
        };
        let oracle = of("oracle", None, 0.5);
        assert!(same_lists(&of("overlap", None, 0.11), &of("overlap", None, 0.12)));
        for (noise, ratio, is_same) in
            [(Some("uniform"), 0.5, true), (Some("near"), 0.5, false), (None, 0.3, false)]
        {
            assert_eq!(same_lists(&oracle, &of("oracle", noise, ratio)), is_same);
        }
        assert!(!same_lists(&oracle, &of("overlap", None, 0.5)));
    }
}
