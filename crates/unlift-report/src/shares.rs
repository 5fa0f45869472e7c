//! What came back of every scheme, for a summary in a few lines.

use crate::attack::Basis;
use crate::cards::Card;
use crate::document::Document;
use crate::exhibit;
use crate::inversions::Inversion;
use crate::verdict::verdict;

/// What came back of one scheme within the headline threshold, by the strongest attacks tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Shares {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// What a person would call the scheme.
    pub title: String,
    /// Percent from the released data alone; `None` where no such attack was tried.
    pub today: Option<f64>,
    /// Percent if neighbors were known, at the tested share nearest to half; `None` without an oracle.
    pub known: Option<f64>,
    /// How many pictures can be rebuilt from the released data alone; `None` where nothing was painted.
    pub pictures: Option<String>,
}

/// The shares of every scheme, the worst first, as the page leads with them.
pub fn shares(document: &Document, inversions: &[Inversion]) -> Vec<Shares> {
    let of = |card: Card| Shares {
        today: card.today(),
        known: card.finding(Basis::Oracle).map(|finding| finding.recovered),
        pictures: exhibit::pictures_said(document, inversions, &card.scheme),
        scheme: card.scheme,
        title: card.title,
    };
    verdict(document).cards.into_iter().map(of).collect()
}
