//! What an attack had to go on: whose neighborhoods, how many of them right, or none at all.

use crate::document::Row;
use crate::words;

/// Neighborhoods by their source and quality.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Given {
    /// `oracle`, `file`, or the name of the attacker's source.
    pub neighbors: String,
    /// How the oracle erred.
    pub oracle_noise: Option<String>,
    /// Share of true neighbors: requested of the oracle, measured of others.
    pub inlier_ratio: f64,
}

impl Given {
    /// The neighborhoods of a row.
    pub fn of(row: &Row) -> Self {
        Self {
            neighbors: row.neighbors.clone(),
            oracle_noise: row.oracle_noise.clone(),
            inlier_ratio: row.inlier_ratio,
        }
    }

    /// Whether both are one choice on the page: a measured ratio differs between schemes, images and
    /// repeats, and makes no other source of it.
    pub(crate) fn same_choice(&self, other: &Self) -> bool {
        let noise =
            |given: &Self| given.oracle_noise.clone().unwrap_or_else(|| "uniform".to_owned());
        self.neighbors == other.neighbors
            && (!is_oracle(&self.neighbors)
                || (self.inlier_ratio == other.inlier_ratio && noise(self) == noise(other)))
    }

    /// What the page calls them everywhere: `overlap, 11 % true neighbors`.
    pub(crate) fn label(&self) -> String {
        neighborhoods(&self.neighbors, self.oracle_noise.as_deref(), self.inlier_ratio)
    }
}

/// The solver's name of the row that is no attack: true neighbors at their true places.
const REFERENCE: &str = "reference";
/// Solvers that look at records alone, whatever neighborhoods their row names.
const WITHOUT_NEIGHBORS: [&str; 2] = ["density", "tomography"];

/// Whose neighborhoods an attack had.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Basis {
    /// The released data alone: lists that an attacker makes of it, or no lists.
    Released,
    /// Lists from a file.
    Given,
    /// Lists made from the originals, at a chosen inlier ratio.
    Oracle,
}

/// The basis of a row; `None` where it is no attack.
pub(crate) fn basis(row: &Row) -> Option<Basis> {
    basis_of(&row.neighbors, &row.solver)
}

/// The same of neighborhoods and a solver by their names.
pub(crate) fn basis_of(neighbors: &str, solver: &str) -> Option<Basis> {
    match neighbors {
        _ if solver == REFERENCE => None,
        _ if !looks_at_neighbors(solver) => Some(Basis::Released),
        "oracle" => Some(Basis::Oracle),
        "file" => Some(Basis::Given),
        _ => Some(Basis::Released),
    }
}

/// Whether the attack looked at neighborhoods at all.
pub(crate) fn has_neighborhoods(row: &Row) -> bool {
    looks_at_neighbors(&row.solver)
}

/// Whether a solver looks at neighborhoods.
pub(crate) fn looks_at_neighbors(solver: &str) -> bool {
    !WITHOUT_NEIGHBORS.contains(&solver)
}

/// What an attack had to go on: its neighborhoods, or `records alone (tomography)`.
pub(crate) fn without_solver(given: &Given, solver: &str) -> String {
    if looks_at_neighbors(solver) { given.label() } else { records_alone(Some(solver)) }
}

/// Whether the row's neighborhoods were made at a requested ratio; the ratio of others is measured.
pub(crate) fn is_oracle(neighbors: &str) -> bool {
    neighbors == "oracle"
}

/// Who says who is whose neighbor: `oracle`, `oracle (near)`, `overlap`, `given lists`.
pub(crate) fn source(neighbors: &str, oracle_noise: Option<&str>) -> String {
    match (neighbors, oracle_noise) {
        ("oracle", None | Some("uniform")) => "oracle".to_owned(),
        ("oracle", Some(noise)) => format!("oracle ({noise})"),
        ("file", _) => "given lists".to_owned(),
        (own, _) => own.to_owned(),
    }
}

/// Neighborhoods as the page calls them everywhere: `overlap, 11 % true neighbors`.
pub(crate) fn neighborhoods(neighbors: &str, oracle_noise: Option<&str>, ratio: f64) -> String {
    if neighbors == REFERENCE {
        return "reference: told where true neighbors are".to_owned();
    }
    let source = source(neighbors, oracle_noise);
    format!("{source}, {} % true neighbors", words::ratio_percent(ratio))
}

/// The attack of a row in two words, for a sentence: `overlap neighbors`, `records alone`.
pub(crate) fn briefly(row: &Row) -> String {
    match row.neighbors.as_str() {
        _ if !has_neighborhoods(row) => "records alone".to_owned(),
        "file" => "given neighbors".to_owned(),
        "descriptors" => "descriptor neighbors".to_owned(),
        _ => format!("{} neighbors", source(&row.neighbors, row.oracle_noise.as_deref())),
    }
}

/// The whole attack of a row: `oracle, 50 % true neighbors, joint`, `overlap, 35 listed, 11 % of them true, joint`.
pub(crate) fn name(row: &Row) -> String {
    if !has_neighborhoods(row) {
        return records_alone(Some(&row.solver));
    }
    // An attacker's own lists are as long as it chose: the share of true ones says nothing without that.
    let given = match basis(row) {
        Some(Basis::Released | Basis::Given) => {
            let (source, true_ones) =
                (source(&row.neighbors, None), words::ratio_percent(row.inlier_ratio));
            format!("{source}, {} listed, {true_ones} % of them true", row.k)
        }
        _ => neighborhoods(&row.neighbors, row.oracle_noise.as_deref(), row.inlier_ratio),
    };
    format!("{given}, {}", row.solver)
}

/// The attack that needs neither neighborhoods nor descriptors: `records alone (tomography)`.
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

    #[test]
    fn neighborhoods_have_the_name_of_their_source() {
        assert_eq!(neighborhoods("oracle", Some("uniform"), 0.5), "oracle, 50 % true neighbors");
        assert_eq!(neighborhoods("oracle", None, 0.5), "oracle, 50 % true neighbors");
        assert_eq!(
            neighborhoods("oracle", Some("near"), 0.1),
            "oracle (near), 10 % true neighbors"
        );
        assert_eq!(neighborhoods("overlap", None, 0.113), "overlap, 11 % true neighbors");
        assert_eq!(neighborhoods("file", None, 0.2), "given lists, 20 % true neighbors");
    }
}
