//! The exhibits at the top of a page: a photo, the released records, and the picture that an attacker paints from
//! them.

use serde::Serialize;

use crate::attack::{self, Basis, Given};
use crate::cards::Level;
use crate::document::{Document, Row};
use crate::inversions::{Inversion, InvertedView, source, strongest};
use crate::pictures::Marks;
use crate::{tables, words};

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Exhibit {
    level: Level,
    /// "An attacker can rebuild the picture."
    verdict: &'static str,
    said: String,
    photo: String,
    released: Option<Drawing>,
    painted: String,
    name: String,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct Drawing {
    size: [u32; 2],
    /// `lines` or `points`.
    kind: &'static str,
    path: String,
    /// The rule of the scheme, and how many records are drawn.
    said: String,
}

/// Ratios of SSIM to that without protection, from which on the picture, or parts of it, count as rebuilt.
const REBUILT: f64 = 0.85;
const IN_PARTS: f64 = 0.6;

/// The picture of the true points counts as poor below this SSIM.
const POOR: f64 = 0.5;

fn rebuilt(ratio: f64) -> (Level, &'static str) {
    match ratio {
        REBUILT.. => (Level::Red, "An attacker can rebuild the picture."),
        IN_PARTS.. => (Level::Orange, "An attacker can rebuild parts of the picture."),
        _ => (Level::Gray, "The picture does not come back well by this attack."),
    }
}

/// Returns how many photos of a scheme can be rebuilt from the released data alone: "1 of 2 pictures can be rebuilt, 1
/// in parts"; `None` if no picture was painted.
pub(crate) fn pictures_said(
    document: &Document,
    inversions: &[Inversion],
    scheme: &str,
) -> Option<String> {
    let level = |one: &Inversion| {
        let view = strongest(document, one, scheme, Basis::Released)?;
        Some(rebuilt(kept(one, view)).0)
    };
    let levels: Vec<Level> = inversions.iter().filter_map(level).collect();
    let count = |level| levels.iter().filter(|&&one| one == level).count();
    let (n, whole, parts) = (levels.len(), count(Level::Red), count(Level::Orange));
    let pictures = if n == 1 { "picture" } else { "pictures" };
    let in_parts = if parts > 0 { format!(", {parts} in parts") } else { String::new() };
    (n > 0).then(|| format!("{whole} of {n} {pictures} can be rebuilt{in_parts}"))
}

/// Returns at most three exhibits. The first two show the best pictures from the released data alone, of different
/// schemes and photos if possible. The last one shows an attack with given or known neighbors.
pub(crate) fn exhibits(document: &Document, inversions: &[Inversion]) -> Vec<Exhibit> {
    let Some(first) = inversions.first() else { return Vec::new() };
    let mut shown: Vec<(&Inversion, &InvertedView)> = Vec::new();
    for inversion in inversions.iter().take(2) {
        let seen: Vec<&str> = shown.iter().map(|(_, view)| view.scheme.as_str()).collect();
        let best = best(document, inversion, Basis::Released, &seen);
        shown.extend(best.map(|view| (inversion, view)));
    }
    for basis in [Basis::Given, Basis::Oracle] {
        shown.extend(best(document, first, basis, &[]).map(|view| (first, view)));
    }
    shown.into_iter().filter_map(|(one, view)| exhibit(document, one, view)).take(3).collect()
}

/// Returns the view with the best level of its picture; of equal ones, that of the stronger attack.
fn best<'a>(
    document: &Document,
    inversion: &'a Inversion,
    basis: Basis,
    without: &[&str],
) -> Option<&'a InvertedView> {
    let views = inversion.views.iter().filter(|view| {
        let strongest = strongest(document, inversion, &view.scheme, basis);
        strongest.is_some_and(|one| std::ptr::eq(one, *view))
    });
    let views = views.filter(|view| !without.contains(&view.scheme.as_str()));
    let rank = |view: &InvertedView| {
        let share = row_of(document, view).and_then(|row| share(document, row));
        (rebuilt(kept(inversion, view)).0, share.unwrap_or(0.0))
    };
    let ranked = views.map(|view| (rank(view), view));
    let best =
        ranked.reduce(|a, b| if b.0.partial_cmp(&a.0).is_some_and(|o| o.is_gt()) { b } else { a });
    best.map(|(_, view)| view)
}

fn row_of<'a>(document: &'a Document, view: &InvertedView) -> Option<&'a Row> {
    document.results.iter().find(|row| {
        row.scheme == view.scheme
            && row.solver == view.solver
            && view.given.same_choice(&Given::of(row))
    })
}

fn share(document: &Document, row: &Row) -> Option<f64> {
    row.recovered_percent.get(&tables::headline_threshold(document)?).copied()
}

/// Returns the ratio of the picture's SSIM to that without protection.
fn kept(inversion: &Inversion, view: &InvertedView) -> f64 {
    let baseline = inversion.baseline.likeness.ssim;
    if baseline > 0.0 { view.painted.likeness.ssim / baseline } else { 0.0 }
}

fn exhibit(document: &Document, inversion: &Inversion, view: &InvertedView) -> Option<Exhibit> {
    let (level, verdict) = rebuilt(kept(inversion, view));
    let row = row_of(document, view)?;
    let typed = tables::headline_threshold(document)?;
    let back = format!(
        "{} % of the {} come back {}",
        words::percent(share(document, row).unwrap_or(0.0)),
        words::points(row.unit),
        words::within(&typed, row.unit),
    );
    let by = format!("({}, {})", view.scheme.to_uppercase(), attack::briefly(row));
    let mut said = match view.basis()? {
        Basis::Released => format!("From the released data alone, {back} {by}."),
        Basis::Given => format!("With given neighbors, {back} {by}."),
        Basis::Oracle => {
            let known = words::capital(&words::if_known(row.inlier_ratio));
            format!("{known}: {back} {by}.")
        }
    };
    // If the network paints badly even from true points, the result shows little.
    let baseline = inversion.baseline.likeness.ssim;
    if baseline < POOR {
        said.push_str(&format!(
            " Even from the true points this network paints a poor picture (similarity to the photo: SSIM {baseline:.2} of 1)."
        ));
    }
    let released = inversion.released.iter().find(|one| one.scheme == view.scheme);
    Some(Exhibit {
        level,
        verdict,
        said,
        photo: source(&inversion.photo),
        released: released.and_then(|one| drawing(inversion.size, &one.scheme, &one.marks)),
        painted: source(&view.painted.jpeg),
        name: inversion.name.clone(),
    })
}

const MOST_LINES: usize = 700;
const MOST_POINTS: usize = 4_000;

/// Returns the records as one path, thinned evenly; `None` if there is nothing to draw.
fn drawing(size: [u32; 2], scheme: &str, marks: &Marks) -> Option<Drawing> {
    let mut path = String::new();
    let at = |p: [f32; 2]| format!("{} {}", p[0].round(), p[1].round());
    let (kind, drawn, all) = match marks {
        Marks::Lines(all) | Marks::Rays(all) => {
            let all: Vec<[[f32; 2]; 2]> = all.iter().copied().flatten().collect();
            let few = evenly(&all, MOST_LINES);
            few.iter().for_each(|[a, b]| path.push_str(&format!("M{}L{}", at(*a), at(*b))));
            ("lines", few.len(), all.len())
        }
        Marks::Points(all) => {
            let all: Vec<[f32; 2]> = all.iter().copied().flatten().collect();
            let few = evenly(&all, MOST_POINTS);
            few.iter().for_each(|p| path.push_str(&format!("M{}h0", at(*p))));
            ("points", few.len(), all.len())
        }
    };
    let [n, of] = [drawn, all].map(|n| words::thousands(n as u64));
    let some = if drawn < all { format!(" ({n} of {of} drawn)") } else { String::new() };
    let rule = words::scheme_rule(scheme);
    let rule = if rule.is_empty() { "What the scheme releases." } else { rule };
    let said = format!("{rule}{some}");
    (drawn > 0).then_some(Drawing { size, kind, path, said })
}

fn evenly<T: Copy>(all: &[T], most: usize) -> Vec<T> {
    let n = all.len().min(most);
    (0..n).map(|at| all[at * all.len() / n]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_a_picture_follows_its_ssim() {
        let said = [1.1, 0.85, 0.8499, 0.6, 0.5999, 0.0].map(|ratio| rebuilt(ratio).1);
        let whole = "An attacker can rebuild the picture.";
        let parts = "An attacker can rebuild parts of the picture.";
        let not = "The picture does not come back well by this attack.";
        assert_eq!(said, [whole, whole, parts, parts, not, not]);
    }

    #[test]
    fn many_lines_are_thinned_and_counted() {
        let lines =
            Marks::Lines((0..2_000).map(|at| Some([[at as f32, 0.0], [0.0, 5.0]])).collect());
        let drawn = drawing([640, 480], "lines2d", &lines).expect("a drawing");
        assert_eq!(drawn.path.matches('M').count(), MOST_LINES);
        assert!(drawn.said.ends_with("(700 of 2,000 drawn)"), "{}", drawn.said);
        assert_eq!(drawing([9, 9], "cp2d", &Marks::Points(vec![None])), None);
    }
}
