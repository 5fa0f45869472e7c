//! Pictures that a network made of what came back, beside the photos.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use crate::attack::{self, Basis, Given, basis};
use crate::document::{Document, Row};
use crate::words;

/// One photo and the pictures made of its keypoints. All pictures are JPEGs of one size.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Inversion {
    /// The image's name.
    pub name: String,
    /// The photo.
    pub photo: Vec<u8>,
    /// What a detector finds in the photo.
    pub objects: Vec<Object>,
    /// The picture of the true keypoints.
    pub baseline: Painted,
    /// Pictures of what came back.
    pub views: Vec<InvertedView>,
}

/// A picture that a network made.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Painted {
    /// The picture.
    pub jpeg: Vec<u8>,
    /// How alike it is to the photo.
    pub likeness: Likeness,
    /// What a detector finds in it.
    pub objects: Vec<Object>,
}

/// An everyday object that a detector found in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// What it is: `chair`.
    pub class: String,
    /// Left, top, right and bottom as shares of the picture's sides; may reach beyond it.
    pub sides: [f32; 4],
}

/// How alike a picture is to the photo.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Likeness {
    /// Structural similarity.
    pub ssim: f64,
    /// Perceptual distance.
    pub lpips: f64,
}

impl Likeness {
    fn said(self) -> String {
        format!("SSIM {:.2}, LPIPS {:.2}", self.ssim, self.lpips)
    }
}

/// The picture of what came back under one scheme, from one kind of neighborhoods.
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

/// All pictures of one photo, as the page shows them.
#[derive(Debug, Serialize)]
pub(crate) struct Sheet {
    name: String,
    photo: String,
    boxes: Vec<Boxed>,
    baseline: Shown,
    rows: Vec<SheetRow>,
}

/// Where an object is drawn, in per cent of the picture.
#[derive(Debug, Serialize)]
struct Boxed {
    class: String,
    left: f32,
    top: f32,
    width: f32,
    height: f32,
}

#[derive(Debug, Serialize)]
struct SheetRow {
    scheme: String,
    pictures: Vec<Shown>,
}

#[derive(Debug, Serialize)]
struct Shown {
    /// What it was made of.
    label: String,
    said: String,
    /// Whether an attacker can make it today, without an oracle.
    today: bool,
    source: String,
    boxes: Vec<Boxed>,
}

/// Bytes of the page that all of them may take.
const BUDGET_BYTES: usize = 2_500_000;

/// The sheets of `inversions`, in their order, and how many pictures are left out as they would make the page too large:
/// those of the last photos, then of every scheme those in the middle.
pub(crate) fn sheets(inversions: &[Inversion]) -> (Vec<Sheet>, usize) {
    let mut sheets: Vec<Sheet> = inversions.iter().map(sheet).collect();
    let size = |sheets: &[Sheet]| sheets.iter().map(Sheet::size).sum::<usize>();
    let mut left_out = 0;
    while size(&sheets) > BUDGET_BYTES && sheets.len() > 1 {
        left_out += sheets.pop().map_or(0, |sheet| sheet.count());
    }
    while size(&sheets) > BUDGET_BYTES {
        let rows = sheets.iter_mut().flat_map(|sheet| &mut sheet.rows);
        let Some(longest) = rows.max_by_key(|row| row.pictures.len()) else { break };
        if longest.pictures.len() < 2 {
            break;
        }
        longest.pictures.remove(longest.pictures.len() / 2);
        left_out += 1;
    }
    (sheets, left_out)
}

impl Sheet {
    /// Pictures of what came back.
    fn count(&self) -> usize {
        self.rows.iter().map(|row| row.pictures.len()).sum()
    }

    fn size(&self) -> usize {
        let pictures = self.rows.iter().flat_map(|row| &row.pictures);
        let shown = pictures.chain([&self.baseline]).map(|shown| shown.source.len());
        self.photo.len() + shown.sum::<usize>()
    }
}

/// The three pictures and the sentence that a page begins with.
#[derive(Debug, Serialize)]
pub(crate) struct Lead {
    sentence: String,
    photo: String,
    baseline: String,
    recovered: String,
    /// What the third picture was made of.
    label: String,
}

/// What the pictures say in a sentence: of the attack that gets the best pictures, one without an oracle if there is
/// any, else one where half of the neighbors are known.
pub(crate) fn lead(document: &Document, inversions: &[Inversion]) -> Option<Lead> {
    let kept = |row: &Row| {
        let of = |name: &str| row.metrics.get(name).copied();
        Some((of("ssim")?, of("ssim_baseline").filter(|baseline| *baseline > 0.0)?))
    };
    let away = |row: &Row| (row.inlier_ratio - 0.5).abs();
    let rows = || document.results.iter().filter_map(|row| Some((row, kept(row)?)));
    let painted = |row: &Row| {
        let views = inversions.first().map_or(&[][..], |sheet| &sheet.views);
        views.iter().find(|view| {
            view.scheme == row.scheme
                && view.solver == row.solver
                && view.given.same_choice(&Given::of(row))
        })
    };
    let rows = || rows().filter(|(row, _)| painted(row).is_some());
    let today = rows().any(|(row, _)| basis(row) == Some(Basis::Released));
    let nearest = rows().map(|(row, _)| away(row)).fold(f64::INFINITY, f64::min);
    let candidates = rows().filter(|(row, _)| match today {
        true => basis(row) == Some(Basis::Released),
        false => away(row) <= nearest,
    });
    let (row, (ssim, baseline)) = candidates.max_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    let (sheet, view) = (inversions.first()?, painted(row)?);
    let scheme = row.scheme.to_uppercase();
    let who = match today {
        true => "From the released data alone".to_owned(),
        false => {
            format!("With {} % of the neighbors known", words::ratio_percent(row.inlier_ratio))
        }
    };
    let amount = match ssim / baseline {
        share if share >= 0.95 => "as good a picture as without any protection",
        share if share >= 0.8 => "nearly as good a picture as without any protection",
        share if share >= 0.5 => "a worse picture than without protection",
        _ => "a much worse picture than without protection",
    };
    Some(Lead {
        sentence: format!(
            "{who}, a network paints {amount} of what {scheme} hides (SSIM {ssim:.2}, {baseline:.2} without)."
        ),
        photo: source(&sheet.photo),
        baseline: source(&sheet.baseline.jpeg),
        recovered: source(&view.painted.jpeg),
        label: format!("{scheme}, {}", label(view)),
    })
}

fn sheet(inversion: &Inversion) -> Sheet {
    let mut rows: Vec<SheetRow> = Vec::new();
    let several = inversion.views.iter().any(|view| view.solver != inversion.views[0].solver);
    for view in &inversion.views {
        let shown = Shown {
            label: match several {
                true => label(view),
                false => attack::without_solver(&view.given, &view.solver),
            },
            today: attack::basis_of(&view.given.neighbors, &view.solver) == Some(Basis::Released),
            ..Shown::of(&view.painted)
        };
        match rows.iter_mut().find(|row| row.scheme == view.scheme) {
            Some(row) => row.pictures.push(shown),
            None => rows.push(SheetRow { scheme: view.scheme.clone(), pictures: vec![shown] }),
        }
    }
    Sheet {
        name: inversion.name.clone(),
        photo: source(&inversion.photo),
        boxes: boxes(&inversion.objects),
        baseline: Shown {
            label: "without protection".to_owned(),
            ..Shown::of(&inversion.baseline)
        },
        rows,
    }
}

impl Shown {
    fn of(painted: &Painted) -> Self {
        Self {
            label: String::new(),
            said: painted.likeness.said(),
            today: false,
            source: source(&painted.jpeg),
            boxes: boxes(&painted.objects),
        }
    }
}

/// What lies within the picture.
fn boxes(objects: &[Object]) -> Vec<Boxed> {
    let of = |object: &Object| {
        let [left, top, right, bottom] = object.sides.map(|side| 100.0 * side.clamp(0.0, 1.0));
        let class = object.class.clone();
        Boxed { class, left, top, width: right - left, height: bottom - top }
    };
    objects.iter().map(of).collect()
}

/// The whole attack: neighborhoods and solver.
fn label(view: &InvertedView) -> String {
    let given = attack::without_solver(&view.given, &view.solver);
    match attack::looks_at_neighbors(&view.solver) {
        true => format!("{given}, {}", view.solver),
        false => given,
    }
}

/// A JPEG as a page holds it.
fn source(jpeg: &[u8]) -> String {
    format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(scheme: &str, neighbors: &str, inlier_ratio: f64, bytes: usize) -> InvertedView {
        let given = Given { neighbors: neighbors.into(), oracle_noise: None, inlier_ratio };
        let solver = "joint".to_owned();
        let painted = Painted { jpeg: vec![7; bytes], ..Painted::default() };
        InvertedView { scheme: scheme.into(), given, solver, painted }
    }

    #[test]
    fn pictures_that_would_make_a_page_too_large_are_left_out() {
        let inversion = |bytes: usize| Inversion {
            views: (0..40).map(|at| view(["olc", "cp"][at % 2], "oracle", 0.5, bytes)).collect(),
            ..Inversion::default()
        };
        let of = |inversions: &[Inversion]| {
            let (sheets, left_out) = sheets(inversions);
            (sheets.iter().map(Sheet::count).collect::<Vec<_>>(), left_out)
        };
        assert_eq!(of(&[inversion(9_000), inversion(9_000)]), (vec![40, 40], 0));
        assert_eq!(of(&[inversion(40_000), inversion(40_000)]), (vec![40], 40));
        let (few, left_out) = of(&[inversion(200_000)]);
        assert!(few[0] > 4 && few[0] + left_out == 40, "{few:?}");
    }
}
