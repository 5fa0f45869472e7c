//! Pictures that a network paints from recovered points, beside the photos.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use crate::attack::{self, Basis, Given, basis_of};
use crate::document::Document;
use crate::pictures::ReleasedView;
use crate::{sequence, tables, verdict};

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
    pub(crate) fn basis(&self) -> Option<Basis> {
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
        of_scheme.filter(|view| view.basis() == Some(basis))
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
    let by_queries = sequence::is_sequence(document);
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
}
