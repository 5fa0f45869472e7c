//! Pictures that a network paints from recovered points, beside the photos.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use crate::attack::{Basis, Given, basis_of};
use crate::document::{Document, Row};
use crate::page::pictures::{Marks, ReleasedView};
use crate::page::verdict::Level;
use crate::page::{tables, verdict};
use crate::{attack, views, words};

/// One photo and the pictures painted from its keypoints. All pictures are JPEGs of one size.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Inversion {
    /// The image's name.
    pub name: String,
    /// Width and height of the photo in pixels.
    pub size: [u32; 2],
    /// The photo.
    pub photo: Vec<u8>,
    /// The picture painted from the true keypoints.
    pub baseline: Painted,
    /// What each scheme releases, in pixels of the photo.
    pub released: Vec<ReleasedView>,
    /// Pictures painted from recovered keypoints.
    pub views: Vec<InvertedView>,
}

/// A picture that a network painted.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Painted {
    /// The picture.
    pub jpeg: Vec<u8>,
    /// Its similarity to the photo.
    pub likeness: Likeness,
}

/// The similarity of a picture to the photo.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Likeness {
    /// Structural similarity (SSIM); 1 for equal pictures.
    pub ssim: f64,
    /// Perceptual distance (LPIPS); 0 for equal pictures.
    pub lpips: f64,
}

impl Likeness {
    fn said(self) -> String {
        format!("SSIM {:.2}, LPIPS {:.2}", self.ssim, self.lpips)
    }
}

/// A picture painted from the keypoints recovered under one scheme, from one kind of neighborhoods.
#[derive(Debug, Clone, PartialEq)]
pub struct InvertedView {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The neighborhoods.
    pub given: Given,
    /// The solver's name.
    pub solver: String,
    /// The picture.
    pub painted: Painted,
}

impl InvertedView {
    pub(crate) fn basis(&self) -> Basis {
        basis_of(&self.given.neighbors, &self.solver)
    }
}

#[derive(Debug, Serialize)]
pub(crate) struct Sheet {
    name: String,
    photo: String,
    baseline: Shown,
    rows: Vec<SheetRow>,
}

#[derive(Debug, Serialize)]
struct SheetRow {
    scheme: String,
    /// Whether `main` has one picture per number of queries, ascending.
    by_queries: bool,
    main: Vec<Shown>,
    others: Vec<Shown>,
}

#[derive(Debug, Serialize)]
struct Shown {
    label: String,
    said: String,
    source: String,
}

/// Maximal number of bytes for all pictures of the page.
const BUDGET_BYTES: usize = 2_500_000;

/// Returns the sheets of `inversions` and the number of pictures that were left out to keep the page small: first
/// whole photos from the end, then the last pictures of the longest rows of `others`.
pub(crate) fn sheets(document: &Document, inversions: &[Inversion]) -> (Vec<Sheet>, usize) {
    let mut sheets: Vec<Sheet> = inversions.iter().map(|one| sheet(document, one)).collect();
    let size = |sheets: &[Sheet]| sheets.iter().map(Sheet::size).sum::<usize>();
    let mut left_out = 0;
    while size(&sheets) > BUDGET_BYTES && sheets.len() > 1 {
        left_out += sheets.pop().map_or(0, |sheet| sheet.pictures().count());
    }
    while size(&sheets) > BUDGET_BYTES {
        let rows = sheets.iter_mut().flat_map(|sheet| &mut sheet.rows);
        // One picture of each scheme stays.
        let more = |row: &&mut SheetRow| {
            row.others.len() + (row.main.len() - 1) * usize::from(row.by_queries)
        };
        let Some(longest) = rows.filter(|row| more(row) > 0).max_by_key(more) else { break };
        if longest.others.pop().is_none() {
            longest.main.remove(0);
        }
        left_out += 1;
    }
    (sheets, left_out)
}

impl Sheet {
    fn pictures(&self) -> impl Iterator<Item = &Shown> {
        self.rows.iter().flat_map(|row| row.main.iter().chain(&row.others))
    }

    fn size(&self) -> usize {
        let shown = self.pictures().chain([&self.baseline]).map(|shown| shown.source.len());
        self.photo.len() + shown.sum::<usize>()
    }
}

/// Returns the view of [`verdict::strongest`] for `scheme` and this basis.
pub(crate) fn strongest<'a>(
    document: &Document,
    inversion: &'a Inversion,
    scheme: &str,
    basis: Basis,
) -> Option<&'a InvertedView> {
    let views = || {
        let of_scheme = inversion.views.iter().filter(|view| view.scheme == scheme);
        of_scheme.filter(|view| view.basis() == basis)
    };
    let row = verdict::strongest(document, scheme, basis);
    let is_row = |view: &&InvertedView| {
        row.is_some_and(|row| view.solver == row.solver && view.given.same_choice(&Given::of(row)))
    };
    let best = |a: &&InvertedView, b: &&InvertedView| {
        a.painted.likeness.ssim.total_cmp(&b.painted.likeness.ssim)
    };
    // If the strongest attack was not painted, the best picture stands in.
    views().find(is_row).or_else(|| views().max_by(best))
}

fn sheet(document: &Document, inversion: &Inversion) -> Sheet {
    let schemes = tables::distinct(inversion.views.iter().map(|view| view.scheme.as_str()));
    let by_queries = views::is_sequence(document);
    let rows = schemes.into_iter().map(|scheme| {
        let of_bases = || {
            let bases = [Basis::Released, Basis::Given, Basis::Oracle].into_iter();
            bases.filter_map(|basis| strongest(document, inversion, scheme, basis)).collect()
        };
        let main: Vec<&InvertedView> = match by_queries {
            true => inversion.views.iter().filter(|view| view.scheme == scheme).collect(),
            false => of_bases(),
        };
        let is_main = |view: &InvertedView| main.iter().any(|other| std::ptr::eq(*other, view));
        let others = inversion.views.iter().filter(|view| view.scheme == scheme && !is_main(view));
        SheetRow {
            scheme: scheme.to_owned(),
            by_queries,
            others: others.map(shown).collect(),
            main: main.into_iter().map(shown).collect(),
        }
    });
    Sheet {
        name: inversion.name.clone(),
        photo: source(&inversion.photo),
        baseline: painted(&inversion.baseline, "without protection".to_owned()),
        rows: rows.collect(),
    }
}

fn shown(view: &InvertedView) -> Shown {
    painted(&view.painted, attack::without_solver(&view.given, &view.solver))
}

fn painted(painted: &Painted, label: String) -> Shown {
    Shown { label, said: painted.likeness.said(), source: source(&painted.jpeg) }
}

pub(crate) fn source(jpeg: &[u8]) -> String {
    format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg))
}

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
    let by = format!("({}, {})", words::scheme_name(&view.scheme), attack::briefly(row));
    let mut said = match view.basis() {
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

    fn view(scheme: &str, inlier_ratio: f64, bytes: usize) -> InvertedView {
        let given = Given { neighbors: "oracle".into(), oracle_noise: None, inlier_ratio };
        let painted = Painted { jpeg: vec![7; bytes], ..Painted::default() };
        InvertedView { scheme: scheme.into(), given, solver: "joint".into(), painted }
    }

    fn document() -> Document {
        let text = serde_json::json!({
            "unlift": "0.1.0", "schema": 1, "options": {}, "seed": 0, "break_even": [],
            "input": {"path": null, "n_points": 1, "scale_m_per_unit": null}, "results": [],
            "run": {"threads": 1, "peak_memory_bytes": null, "seconds": {"total": 1.0, "rows": []}}
        });
        Document::from_json(&text.to_string()).expect("a document")
    }

    #[test]
    fn pictures_that_would_make_a_page_too_large_are_left_out() {
        let inversion = |bytes: usize| Inversion {
            views: (0..40).map(|at| view(["olc", "cp"][at % 2], at as f64, bytes)).collect(),
            ..Inversion::default()
        };
        let of = |inversions: &[Inversion]| {
            let (sheets, left_out) = sheets(&document(), inversions);
            (sheets.iter().map(|one| one.pictures().count()).collect::<Vec<_>>(), left_out)
        };
        assert_eq!(of(&[inversion(9_000), inversion(9_000)]), (vec![40, 40], 0));
        assert_eq!(of(&[inversion(40_000), inversion(40_000)]), (vec![40], 40));
        let (few, left_out) = of(&[inversion(200_000)]);
        assert!(few[0] > 4 && few[0] + left_out == 40, "{few:?}");
    }

    #[test]
    fn what_is_said_of_a_picture_follows_its_ssim() {
        let said = [1.1, 0.85, 0.8499, 0.6, 0.5999, 0.0].map(|ratio| rebuilt(ratio).1);
        let whole = "An attacker can rebuild the picture.";
        let parts = "An attacker can rebuild parts of the picture.";
        let not = "The picture does not come back well by this attack.";
        assert_eq!(said, [whole, whole, parts, parts, not, not]);
    }
}
