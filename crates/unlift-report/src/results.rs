//! The rows of an audit, and the choices among them that all sections share.

use std::collections::BTreeSet;

use unlift::Unit;

use crate::attack::{self, Basis};
use crate::document::{Document, Row};
use crate::words;

/// The oracle's headline is its tested inlier ratio nearest to this one.
const HEADLINE_RATIO: f64 = 0.5;
/// The headline threshold of images is the one nearest to this one.
const HEADLINE_PX: f64 = 10.0;

/// Returns the index of the headline threshold of images: of equally near ones the first.
pub fn headline(thresholds_px: impl Iterator<Item = f64>) -> usize {
    let away = thresholds_px.map(|value| (value / HEADLINE_PX).ln().abs()).enumerate();
    away.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(at, _)| at)
}

/// A document, and what all sections derive from it.
pub(crate) struct Results<'a> {
    pub document: &'a Document,
    pub rows: &'a [Row],
    /// All thresholds as typed.
    pub thresholds: Vec<&'a str>,
    /// The threshold of verdicts: the first; for images the one nearest to 10 px. Empty without rows.
    pub headline: &'a str,
    pub schemes: Vec<&'a str>,
    pub unit: Unit,
}

impl<'a> Results<'a> {
    pub(crate) fn of(document: &'a Document) -> Self {
        let rows = &document.results[..];
        let thresholds = rows.iter().flat_map(|row| row.recovered_percent.keys());
        let thresholds = distinct(thresholds.map(String::as_str));
        let unit = rows.first().map_or(Unit::Meter, |row| row.unit);
        let values = thresholds.iter().map(|typed| typed.parse().unwrap_or(f64::INFINITY));
        let at = if unit == Unit::Pixel { headline(values) } else { 0 };
        let headline = thresholds.get(at).copied().unwrap_or_default();
        let schemes = distinct(rows.iter().map(|row| row.scheme.as_str()));
        Self { document, rows, thresholds, headline, schemes, unit }
    }

    pub(crate) fn is_of_images(&self) -> bool {
        self.unit == Unit::Pixel
    }

    /// Returns "these images" or "this map".
    pub(crate) fn subject(&self) -> &'static str {
        if self.is_of_images() { "these images" } else { "this map" }
    }

    /// Returns the K of the audit, which the oracle uses; other sources choose their own.
    pub(crate) fn k(&self) -> usize {
        let oracle = self.rows.iter().find(|row| attack::is_oracle(&row.neighbors));
        let typed = self.document.options.get("k").and_then(|k| k.as_u64());
        oracle.map(|row| row.k).or(typed.map(|k| k as usize)).unwrap_or(50)
    }

    /// Returns a sentence for each doubt about the figures.
    pub(crate) fn doubts(&self) -> impl Iterator<Item = String> + use<'a> {
        let sentence = |doubt: &String| {
            let end = if doubt.ends_with('?') { "" } else { "." };
            format!("Doubtful: {doubt}{end}")
        };
        self.document.doubts.iter().map(sentence)
    }

    /// Returns the scheme whose records another program made, if the audit is of such.
    pub(crate) fn given_records(&self) -> Option<&'a str> {
        let options = &self.document.options;
        options.get("released")?;
        options.get("schemes")?.get(0)?.as_str()
    }

    pub(crate) fn is_sequence(&self) -> bool {
        self.rows.iter().any(|row| attack::queries(&row.neighbors).is_some())
    }

    pub(crate) fn is_again(&self) -> bool {
        self.rows.iter().any(|row| attack::is_again(&row.neighbors))
    }

    /// Returns why a source, or the whole scheme, was not audited; `None` if it was.
    pub(crate) fn refusal(&self, scheme: &str, source: Option<&str>) -> Option<&'a str> {
        let mut refused = self.document.not_audited.iter();
        let refused = refused.find(|of| of.scheme == scheme && of.neighbors.as_deref() == source);
        refused.map(|of| of.reason.as_str())
    }

    /// Returns the schemes that could not be audited at all, and the reasons.
    pub(crate) fn refused(&self) -> impl Iterator<Item = (&'a str, &'a str)> {
        let refused = self.document.not_audited.iter().filter(|of| of.neighbors.is_none());
        refused.map(|refused| (refused.scheme.as_str(), refused.reason.as_str()))
    }

    pub(crate) fn points(&self) -> &'static str {
        if self.is_of_images() { "keypoints" } else { "points" }
    }

    /// Returns a threshold in short form: `10 cm`.
    pub(crate) fn threshold(&self, typed: &str) -> String {
        words::threshold(typed, self.unit)
    }

    /// Returns a threshold for a sentence: `within 10 cm`, or `within 3.9 % of the map's longest side` without a scale.
    pub(crate) fn within(&self, typed: &str) -> String {
        match (self.document.input.longest_side, typed.parse::<f64>()) {
            (Some(side), Ok(times)) if self.unit == Unit::KthNeighbor && side > 0.0 => {
                let percent = words::significant(100.0 * times / side, 2);
                format!("within {percent} % of the map's longest side")
            }
            _ => format!("within {}", self.threshold(typed)),
        }
    }

    pub(crate) fn of_scheme(&self, scheme: &str) -> impl Iterator<Item = &'a Row> + Clone {
        self.rows.iter().filter(move |row| row.scheme == scheme)
    }

    pub(crate) fn share(&self, row: &Row) -> f64 {
        row.recovered_percent.get(self.headline).copied().unwrap_or(0.0)
    }

    /// Returns the row with the largest share; of equal ones the first.
    pub(crate) fn largest<'r>(&self, rows: impl Iterator<Item = &'r Row>) -> Option<&'r Row> {
        rows.reduce(|best, row| if self.share(row) > self.share(best) { row } else { best })
    }

    /// Returns the row of `scheme` with the largest share on this basis; for the oracle, among the rows whose
    /// ratio is nearest to [`HEADLINE_RATIO`].
    pub(crate) fn strongest(&self, scheme: &str, basis: Basis) -> Option<&'a Row> {
        let away = |row: &Row| match basis {
            Basis::Oracle => (row.inlier_ratio - HEADLINE_RATIO).abs(),
            Basis::Released | Basis::Given => 0.0,
        };
        let rows = self.of_scheme(scheme).filter(|row| attack::basis(row) == basis);
        rows.min_by(|a, b| {
            away(a).total_cmp(&away(b)).then(self.share(b).total_cmp(&self.share(a)))
        })
    }

    /// Returns the row that recovers most of `scheme` within `typed` from the neighborhoods of `given`; of equal ones the first.
    pub(crate) fn strongest_given(
        &self,
        scheme: &str,
        given: &Row,
        typed: &str,
    ) -> Option<&'a Row> {
        let share = |row: &Row| row.recovered_percent.get(typed).copied().unwrap_or(-1.0);
        let rivals = self.of_scheme(scheme).filter(|row| attack::same_lists(row, given));
        rivals.reduce(|best, row| if share(row) > share(best) { row } else { best })
    }

    /// Returns the strongest row of every source of `scheme`: most recovered first, the oracle last.
    pub(crate) fn by_source(&self, scheme: &str) -> Vec<&'a Row> {
        let own = self.of_scheme(scheme).filter(|row| attack::basis(row) != Basis::Oracle);
        let sources: BTreeSet<&str> = own.clone().map(|row| row.neighbors.as_str()).collect();
        let strongest = |by: &str| self.largest(own.clone().filter(|row| row.neighbors == by));
        let mut rows: Vec<&Row> = sources.into_iter().filter_map(strongest).collect();
        rows.sort_by(|a, b| self.share(b).total_cmp(&self.share(a)));
        rows.extend(self.strongest(scheme, Basis::Oracle));
        rows
    }

    /// Returns the percentage by the records alone within `typed`, the best of the scheme's rows, and the attack's name.
    pub(crate) fn records_alone(
        &self,
        scheme: &str,
        typed: &str,
    ) -> Option<(f64, Option<&'a str>)> {
        let shares = self.of_scheme(scheme).filter_map(|row| {
            let percent = *row.records_alone_percent.as_ref()?.get(typed)?;
            let by = row.records_alone_by.as_ref().and_then(|by| by.get(typed));
            Some((percent, by.map(String::as_str)))
        });
        shares.max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Returns the percentage by a blind guess within `typed`, the best of the scheme's rows.
    pub(crate) fn blind(&self, scheme: &str, typed: &str) -> Option<f64> {
        self.max(scheme, |row| row.blind_percent.get(typed).copied())
    }

    pub(crate) fn max(&self, scheme: &str, of: impl Fn(&Row) -> Option<f64>) -> Option<f64> {
        self.of_scheme(scheme).filter_map(of).max_by(f64::total_cmp)
    }
}

/// Returns `items` without repetitions, in their order.
pub(crate) fn distinct<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut kept = Vec::new();
    for item in items {
        if !kept.contains(&item) {
            kept.push(item);
        }
    }
    kept
}
