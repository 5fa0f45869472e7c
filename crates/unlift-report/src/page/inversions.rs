//! Pictures that a network paints from recovered points, beside the photos.

use serde::Serialize;
use serde_json::{Value, json};

use crate::attack::{self, Basis, ByAttack};
use crate::document::Row;
use crate::page::blocks::image_source;
use crate::page::pictures::{Marks, ReleasedView};
use crate::page::verdict::Level;
use crate::results::{Results, distinct};
use crate::words;

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
    pub views: Vec<ByAttack<Painted>>,
}

/// A picture that a network painted, and its similarity to the photo.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Painted {
    /// The picture.
    pub jpeg: Vec<u8>,
    /// Structural similarity (SSIM); 1 for equal pictures.
    pub ssim: f64,
    /// Perceptual distance (LPIPS); 0 for equal pictures.
    pub lpips: f64,
}

type View = ByAttack<Painted>;

impl View {
    fn row<'a>(&self, results: &Results<'a>) -> Option<&'a Row> {
        results.rows.iter().find(|row| attack::is_same(&self.row, row))
    }

    fn shown(&self) -> Shown {
        let solver = &self.row.solver;
        self.recovered.shown(match attack::reads_lists(solver) {
            true => attack::label(&self.row),
            false => attack::records_alone(Some(solver)),
        })
    }
}

impl Painted {
    fn shown(&self, label: String) -> Shown {
        let likeness = format!("SSIM {:.2}, LPIPS {:.2}", self.ssim, self.lpips);
        Shown { label, likeness, source: image_source(&self.jpeg) }
    }
}

/// A photo and its pictures on the page.
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
    likeness: String,
    source: String,
}

/// Maximal number of bytes for all pictures of the page.
const BUDGET_BYTES: usize = 2_500_000;

/// Returns the sheets of `inversions` and the number of pictures that were left out to keep the page small: first
/// whole photos from the end, then the last pictures of the longest rows of `others`.
pub(crate) fn sheets(results: &Results<'_>, inversions: &[Inversion]) -> (Vec<Sheet>, usize) {
    let mut sheets: Vec<Sheet> = inversions.iter().map(|of| sheet(results, of)).collect();
    let is_large = |sheets: &[Sheet]| sheets.iter().map(Sheet::size).sum::<usize>() > BUDGET_BYTES;
    let mut left_out = 0;
    while is_large(&sheets) && sheets.len() > 1 {
        left_out += sheets.pop().map_or(0, |sheet| sheet.pictures().count());
    }
    while is_large(&sheets) {
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

impl Inversion {
    /// Returns the view of [`Results::strongest`] for `scheme` and this basis.
    fn strongest(&self, results: &Results<'_>, scheme: &str, basis: Basis) -> Option<&View> {
        let is_of = |view: &&View| view.row.scheme == scheme && attack::basis(&view.row) == basis;
        let views = self.views.iter().filter(is_of);
        let row = results.strongest(scheme, basis);
        let is_row = |view: &&View| row.is_some_and(|row| attack::is_same(&view.row, row));
        // If the strongest attack was not painted, the best picture stands in.
        let best = || views.clone().max_by(|a, b| a.recovered.ssim.total_cmp(&b.recovered.ssim));
        views.clone().find(is_row).or_else(best)
    }

    /// Returns the view with the best level of its picture; of equal ones, that of the stronger attack.
    fn best(&self, results: &Results<'_>, basis: Basis, without: &[&str]) -> Option<&View> {
        let views = self.views.iter().filter(|view| {
            let scheme = view.row.scheme.as_str();
            let strongest = self.strongest(results, scheme, basis);
            !without.contains(&scheme) && strongest.is_some_and(|of| std::ptr::eq(of, *view))
        });
        let rank = |view: &View| {
            let share = view.row(results).map_or(0.0, |row| results.share(row));
            (rebuilt(self.kept(view)).0, share)
        };
        views.reduce(|a, b| if rank(b) > rank(a) { b } else { a })
    }

    /// Returns the ratio of the picture's SSIM to that without protection.
    fn kept(&self, view: &View) -> f64 {
        let baseline = self.baseline.ssim;
        if baseline > 0.0 { view.recovered.ssim / baseline } else { 0.0 }
    }
}

fn sheet(results: &Results<'_>, inversion: &Inversion) -> Sheet {
    let schemes = distinct(inversion.views.iter().map(|view| view.row.scheme.as_str()));
    let by_queries = results.is_sequence();
    let rows = schemes.into_iter().map(|scheme| {
        let views = inversion.views.iter().filter(|view| view.row.scheme == scheme);
        let strongest = |basis| inversion.strongest(results, scheme, basis);
        let main: Vec<&View> = match by_queries {
            true => views.clone().collect(),
            false => Basis::ALL.into_iter().filter_map(strongest).collect(),
        };
        let others = views.filter(|view| !main.iter().any(|main| std::ptr::eq(*main, *view)));
        SheetRow {
            scheme: scheme.to_owned(),
            by_queries,
            others: others.map(View::shown).collect(),
            main: main.iter().map(|view| view.shown()).collect(),
        }
    });
    Sheet {
        name: inversion.name.clone(),
        photo: image_source(&inversion.photo),
        baseline: inversion.baseline.shown("without protection".to_owned()),
        rows: rows.collect(),
    }
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
pub(crate) fn count_rebuilt(
    results: &Results<'_>,
    inversions: &[Inversion],
    scheme: &str,
) -> Option<String> {
    let level = |inversion: &Inversion| {
        let view = inversion.strongest(results, scheme, Basis::Released)?;
        Some(rebuilt(inversion.kept(view)).0)
    };
    let levels: Vec<Level> = inversions.iter().filter_map(level).collect();
    let count = |level| levels.iter().filter(|&&of| of == level).count();
    let (n, whole, parts) = (levels.len(), count(Level::Red), count(Level::Orange));
    let pictures = if n == 1 { "picture" } else { "pictures" };
    let in_parts = if parts > 0 { format!(", {parts} in parts") } else { String::new() };
    (n > 0).then(|| format!("{whole} of {n} {pictures} can be rebuilt{in_parts}"))
}

/// Returns at most three exhibits. The first two show the best pictures from the released data alone, of different
/// schemes and photos if possible. The last one shows an attack with given or known neighbors.
pub(crate) fn exhibits(results: &Results<'_>, inversions: &[Inversion]) -> Vec<Value> {
    let Some(first) = inversions.first() else { return Vec::new() };
    let mut shown: Vec<(&Inversion, &View)> = Vec::new();
    for inversion in inversions.iter().take(2) {
        let schemes: Vec<&str> = shown.iter().map(|(_, of)| of.row.scheme.as_str()).collect();
        let best = inversion.best(results, Basis::Released, &schemes);
        shown.extend(best.map(|view| (inversion, view)));
    }
    for basis in [Basis::Given, Basis::Oracle] {
        shown.extend(first.best(results, basis, &[]).map(|view| (first, view)));
    }
    shown.into_iter().filter_map(|(of, view)| exhibit(results, of, view)).take(3).collect()
}

fn exhibit(results: &Results<'_>, inversion: &Inversion, view: &View) -> Option<Value> {
    let (level, verdict) = rebuilt(inversion.kept(view));
    let (row, scheme) = (view.row(results)?, &view.row.scheme);
    let from = match attack::basis(&view.row) {
        Basis::Released => "From the released data alone,".to_owned(),
        Basis::Given => "With given neighbors,".to_owned(),
        Basis::Oracle => words::capital(&words::if_known(row.inlier_ratio)) + ":",
    };
    let mut sentence = format!(
        "{from} {} % of the {} come back {} ({scheme}, {}).",
        words::percent(results.share(row)),
        results.points(),
        results.within(results.headline),
        attack::briefly(row)
    );
    // If the network paints badly even from true points, the result shows little.
    let baseline = inversion.baseline.ssim;
    if baseline < POOR {
        sentence.push_str(&format!(
            " Even from the true points this network paints a poor picture (similarity to the photo: SSIM {baseline:.2} of 1)."
        ));
    }
    let share = |name: &str| row.metrics.get(name).copied();
    if let Some((assigned, chance)) = share("reidentified").zip(share("reidentified_by_chance"))
        && chance <= LIKELY_CHANCE
    {
        let [assigned, chance] = [assigned, chance].map(|share| words::percent(100.0 * share));
        sentence.push_str(&format!(
            " {assigned} % of the pictures by this attack can be assigned to their photo ({chance} % by chance)."
        ));
    }
    let released = inversion.released.iter().find(|of| of.scheme == *scheme);
    Some(json!({
        "level": level,
        "verdict": verdict,
        "said": sentence,
        "photo": image_source(&inversion.photo),
        "released": released.and_then(|released| drawing(inversion.size, released)),
        "painted": image_source(&view.recovered.jpeg),
        "name": inversion.name,
    }))
}

/// With fewer photos than one in this share, a picture is assigned to its photo by chance too often to say anything.
const LIKELY_CHANCE: f64 = 0.1;

const MAX_LINES: usize = 700;
const MAX_POINTS: usize = 4_000;

/// Returns the records as one path, thinned evenly; `None` if there is nothing to draw.
fn drawing(size: [u32; 2], released: &ReleasedView) -> Option<Value> {
    let at = |p: [f32; 2]| format!("{} {}", p[0].round(), p[1].round());
    let (kind, paths, max): (_, Vec<String>, _) = match &released.marks {
        Marks::Lines(all) | Marks::Rays(all) => {
            let line = |[a, b]: &[[f32; 2]; 2]| format!("M{}L{}", at(*a), at(*b));
            ("lines", all.iter().flatten().map(line).collect(), MAX_LINES)
        }
        Marks::Points(all) => {
            let point = |p: &[f32; 2]| format!("M{}h0", at(*p));
            ("points", all.iter().flatten().map(point).collect(), MAX_POINTS)
        }
    };
    let (all, n) = (paths.len(), paths.len().min(max));
    let mut text = match words::scheme_rule(&released.scheme) {
        "" => "What the scheme releases.".to_owned(),
        rule => rule.to_owned(),
    };
    if n < all {
        text.push_str(&format!(" ({} of {} drawn)", words::thousands(n), words::thousands(all)));
    }
    let path: String = (0..n).map(|at| paths[at * all / n].as_str()).collect();
    (n > 0).then(|| json!({ "size": size, "kind": kind, "path": path, "said": text }))
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
}
