//! The verdict on one scheme: a card of the page.

use serde::Serialize;

use crate::attack::Basis;

/// The severity of a share of recovered points. It alone decides colors on the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Level {
    /// Less than a fifth came back. There is no green, because another attack may recover more.
    Gray,
    /// A fifth or more came back.
    Orange,
    /// Half or more came back.
    Red,
}

impl Level {
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
    /// One finding per kind of attack that ran: from released data alone, with given lists, with known
    /// neighbors.
    pub findings: Vec<Finding>,
    pub baselines: String,
    pub break_even: Option<String>,
    /// Whether no attack from the released data alone was tried on this scheme.
    pub untried_today: bool,
    /// A sentence per source that could not be tried on the scheme, with the reason.
    pub refused: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Finding {
    #[serde(skip)]
    pub basis: Basis,
    /// "Today, from the released data alone".
    pub when: String,
    pub recovered: f64,
    pub percent: String,
    pub level: Level,
    /// The attack: "neighbors by descriptor overlap, 35 listed, 11 % of them right, solver joint".
    pub by: String,
    #[serde(skip)]
    pub briefly: String,
    pub floor: f64,
}

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

    /// Returns the percentage recovered from the released data alone; `None` if that was not tried.
    pub(crate) fn today(&self) -> Option<f64> {
        self.finding(Basis::Released).map(|finding| finding.recovered)
    }

    /// Returns the sort key of a card: the share from released data alone, then the larger other share;
    /// -1 if not tried.
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
