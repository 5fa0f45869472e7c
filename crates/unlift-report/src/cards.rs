//! The verdict on one scheme, as it stands on the page.

use serde::Serialize;

use crate::attack::Basis;

/// The verdict on one scheme.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Card {
    pub scheme: String,
    pub title: String,
    pub rule: &'static str,
    /// What came back by kind of attack: today, with given lists, with the oracle's; those that ran.
    pub findings: Vec<Finding>,
    /// What an attacker gets without neighborhoods, and what neighborhoods add to that.
    pub baselines: String,
    pub break_even: Option<String>,
    /// Whether other schemes have a share of today and this one has none.
    pub untried_today: bool,
    /// Sources that could not be tried on the scheme, with the reason.
    pub refused: Vec<String>,
    /// Percent by the records alone, where that was tried.
    #[serde(skip)]
    pub alone: Option<f64>,
}

/// What the strongest attack of one kind got back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Finding {
    #[serde(skip)]
    pub basis: Basis,
    /// "Today, from the released data alone".
    pub when: String,
    /// Percent within the headline threshold.
    pub recovered: f64,
    /// The same as a whole percent, rounded down.
    pub at_least: String,
    /// How much, in a word or two.
    pub amount: &'static str,
    /// The attack: "overlap, 11 % right (measured), joint".
    pub by: String,
    /// Percent of an attacker without neighborhoods: the larger baseline.
    pub floor: f64,
}

/// A scheme that could not be audited, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Refusal {
    pub scheme: String,
    pub title: String,
    pub reason: String,
}

impl Card {
    pub(crate) fn finding(&self, basis: Basis) -> Option<&Finding> {
        self.findings.iter().find(|finding| finding.basis == basis)
    }

    /// Today's share decides the order; schemes without one come after those with one.
    pub(crate) fn badness(&self) -> (f64, f64) {
        let share = |basis| self.finding(basis).map_or(-1.0, |finding| finding.recovered);
        (share(Basis::Released), share(Basis::Oracle).max(share(Basis::Given)))
    }
}
