//! The choices of the page's menus: scheme, neighborhoods, solver. All charts and the 3D view share one
//! list of each. A row of the results has a place in each list.

use std::collections::HashSet;

use serde::Serialize;

use crate::attack::{self, Basis, Given};
use crate::document::{Document, LengthUnit, Row};
use crate::{tables, verdict, words};

/// The lists of choices. The script finds a row only by its places in them.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct Choices {
    pub schemes: Vec<SchemeChoice>,
    pub givens: Vec<GivenChoice>,
    pub solvers: Vec<String>,
    /// The neighborhoods that are shown first: those of today's strongest attack, else known neighbors,
    /// half of them right.
    pub first_given: usize,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct SchemeChoice {
    pub name: String,
    pub title: String,
    pub slot: usize,
    pub blind: Vec<Option<f64>>,
    /// Percent by the records alone, per threshold; `None` where that was not tried.
    pub alone: Vec<Option<f64>>,
    pub alone_by: String,
    /// The larger of the two baselines, per threshold; neighborhoods add what exceeds it.
    pub floor: Vec<Option<f64>>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct GivenChoice {
    /// `known neighbors, 50 % right`, `neighbors by descriptor overlap, 9 to 12 % right`.
    pub label: String,
    /// The group in a menu: `released`, `given`, `oracle` or `reference` (no attack).
    pub group: &'static str,
    /// The source: one curve of the oracle's ratios, or one mark of another source.
    pub source: String,
    pub name: String,
    #[serde(skip)]
    pub given: Given,
}

impl Choices {
    pub(crate) fn of(document: &Document) -> Self {
        let mut choices = Self::default();
        let thresholds = tables::thresholds(document);
        for row in &document.results {
            if choices.schemes.iter().all(|scheme| scheme.name != row.scheme) {
                choices.schemes.push(scheme(document, &row.scheme, &thresholds));
            }
            if !choices.solvers.contains(&row.solver) {
                choices.solvers.push(row.solver.clone());
            }
            let given = Given::of(row);
            if choices.givens.iter().all(|known| !known.given.same_choice(&given)) {
                choices.givens.push(given_choice(document, row));
            }
        }
        // Sorts by falling ratio within a source and keeps the order of sources.
        let sources: Vec<String> =
            choices.givens.iter().map(|given| given.source.clone()).collect();
        let turn = |given: &GivenChoice| sources.iter().position(|source| *source == given.source);
        choices.givens.sort_by(|a, b| {
            turn(a).cmp(&turn(b)).then(b.given.inlier_ratio.total_cmp(&a.given.inlier_ratio))
        });
        choices.first_given = first_given(document, &choices.givens);
        choices
    }

    pub(crate) fn given(&self, given: &Given) -> Option<usize> {
        self.givens.iter().position(|known| known.given.same_choice(given))
    }

    pub(crate) fn scheme(&self, name: &str) -> Option<usize> {
        self.schemes.iter().position(|scheme| scheme.name == name)
    }

    pub(crate) fn solver(&self, name: &str) -> Option<usize> {
        self.solvers.iter().position(|solver| solver == name)
    }
}

fn scheme(document: &Document, name: &str, thresholds: &[String]) -> SchemeChoice {
    let rows = || document.results.iter().filter(|row| row.scheme == name);
    let blind = |typed: &String| {
        rows().filter_map(|row| row.blind_percent.get(typed).copied()).max_by(f64::total_cmp)
    };
    let alone = |typed: &str| verdict::records_alone(document, name, typed);
    let by = tables::headline_threshold(document).and_then(|typed| alone(&typed)?.1);
    let floor = |typed: &String| {
        rows().filter_map(|row| row.baseline_percent(typed)).max_by(f64::total_cmp)
    };
    SchemeChoice {
        name: name.to_owned(),
        title: words::scheme_title(name),
        slot: slot(document, name),
        blind: thresholds.iter().map(blind).collect(),
        alone: thresholds.iter().map(|typed| Some(alone(typed)?.0)).collect(),
        alone_by: attack::records_alone(by),
        floor: thresholds.iter().map(floor).collect(),
    }
}

fn group(row: &Row) -> &'static str {
    match row.neighbors.as_str() {
        _ if attack::basis(row).is_none() => "reference",
        "oracle" => "oracle",
        "file" => "given",
        _ => "released",
    }
}

/// Returns one entry for all rows with these neighborhoods; their measured ratios become a range.
fn given_choice(document: &Document, row: &Row) -> GivenChoice {
    let given = Given::of(row);
    let same = document.results.iter().filter(|other| Given::of(other).same_choice(&given));
    let ratios: Vec<f64> = same.map(|row| row.inlier_ratio).collect();
    let low = ratios.iter().copied().fold(f64::INFINITY, f64::min);
    let high = ratios.iter().copied().fold(0.0, f64::max);
    let source = attack::source(&row.neighbors, row.oracle_noise.as_deref());
    let name = attack::plain_source(&row.neighbors, row.oracle_noise.as_deref());
    let said = [low, high].map(words::ratio_percent);
    let label = match said[0] == said[1] {
        true => given.label(),
        false => format!("{name}, {} to {} % right", said[0], said[1]),
    };
    GivenChoice { label, group: group(row), source, name, given }
}

/// Returns the place of the neighborhoods that are shown first: of the attacker's own sources the one that
/// recovers most; without one, the oracle whose ratio is nearest to half.
fn first_given(document: &Document, givens: &[GivenChoice]) -> usize {
    let typed = tables::headline_threshold(document).unwrap_or_default();
    let share = |row: &Row| verdict::share(row, &typed);
    let own = document.results.iter().filter(|row| group(row) == "released");
    let strongest = own.max_by(|a, b| share(a).total_cmp(&share(b)));
    let oracle = || {
        let schemes = document.results.first().map(|row| row.scheme.as_str());
        verdict::strongest(document, schemes?, Basis::Oracle)
    };
    let row = strongest.or_else(oracle);
    let place = row
        .map(Given::of)
        .and_then(|given| givens.iter().position(|known| known.given.same_choice(&given)));
    place.unwrap_or(0)
}

pub(crate) fn unit_sign(unit: Option<LengthUnit>) -> &'static str {
    match unit {
        Some(LengthUnit::KthNeighbor) => "×",
        Some(LengthUnit::Pixel) => "px",
        Some(LengthUnit::Meter) | None => "m",
    }
}

const KNOWN_SCHEMES: [&str; 7] = ["olc", "ppl", "ppl+", "ray", "ray-voxel", "plane", "cp"];
const SLOTS: usize = 8;

/// Returns the number of the color and mark of `scheme`; unknown schemes are numbered as they appear.
fn slot(document: &Document, scheme: &str) -> usize {
    let known = match scheme {
        "lines2d" => "olc",
        "cp2d" => "cp",
        "dcl2d" => "ray",
        other => other,
    };
    if let Some(slot) = KNOWN_SCHEMES.iter().position(|name| *name == known) {
        return slot;
    }
    let names = document.results.iter().map(|row| row.scheme.as_str());
    let before: HashSet<&str> = names
        .take_while(|name| *name != scheme)
        .filter(|name| !KNOWN_SCHEMES.contains(name))
        .collect();
    (KNOWN_SCHEMES.len() + before.len()) % SLOTS
}
