//! The recovered share of every scheme, for a short summary.

use crate::attack::Basis;
use crate::cards::Card;
use crate::document::Document;
use crate::exhibit;
use crate::inversions::Inversion;
use crate::verdict::verdict;

/// The share of one scheme recovered within the headline threshold by the strongest attacks tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Shares {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The scheme's title.
    pub title: String,
    /// Percent from the released data alone; `None` if no such attack was tried.
    pub today: Option<f64>,
    /// Percent with known neighbors, at the tested inlier ratio nearest to one half; `None` without an
    /// oracle.
    pub known: Option<f64>,
    /// How many pictures can be rebuilt from the released data alone; `None` if no picture was painted.
    pub pictures: Option<String>,
}

/// Returns the shares of every scheme, the worst first, as at the top of the page.
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
