//! The verdict on one scheme, as it stands on the page.

use serde::Serialize;

use crate::attack::Basis;

/// How bad a share of recovered points is. Color on the page means this and nothing else.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Level {
    /// Less than a fifth came back by the attacks tried. There is no green: another attack may get more.
    Gray,
    /// A fifth or more came back.
    Orange,
    /// Half or more came back.
    Red,
}

impl Level {
    /// The level of `percent` of the points.
    pub(crate) fn of(percent: f64) -> Self {
        match percent {
            50.0.. => Self::Red,
            20.0.. => Self::Orange,
            _ => Self::Gray,
        }
    }
}

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
    /// Whether no attack from the released data alone was tried on this scheme.
    pub untried_today: bool,
    /// Sources that could not be tried on the scheme, with the reason.
    pub refused: Vec<String>,
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
    /// The percentage as every table says it: one decimal.
    pub percent: String,
    pub level: Level,
    /// The attack: "overlap, 35 listed, 11 % of them true, joint".
    pub by: String,
    /// The attack in a word or two: "overlap neighbors".
    #[serde(skip)]
    pub briefly: String,
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

    /// Percent that came back from the released data alone, where that was tried.
    pub(crate) fn today(&self) -> Option<f64> {
        self.finding(Basis::Released).map(|finding| finding.recovered)
    }

    /// Orders cards: today's share first; schemes without one come after those with one.
    pub(crate) fn badness(&self) -> (f64, f64) {
        let share = |basis| self.finding(basis).map_or(-1.0, |finding| finding.recovered);
        (share(Basis::Released), share(Basis::Oracle).max(share(Basis::Given)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_rise_with_the_share() {
        let levels = [0.0, 19.99, 20.0, 49.99, 50.0, 100.0].map(Level::of);
        let [gray, orange, red] = [Level::Gray, Level::Orange, Level::Red];
        assert_eq!(levels, [gray, gray, orange, orange, red, red]);
        assert!(levels.is_sorted());
    }
}
