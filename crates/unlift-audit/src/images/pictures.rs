//! Pictures of the chosen images, collected while these are audited again.

use std::sync::Arc;

use unlift::audit::{Cell, Observer, Row, Watcher};
use unlift::released::{Obfuscation, Released};
use unlift_report::inversions::Inversion as Inverted;
use unlift_report::pictures::{
    GRAPH_NEIGHBORS, Graph, Marks, Picture, RecoveredView, ReleasedView,
};

use crate::Progress;
use crate::inversion::Inversion;
use unlift_report::Given;

/// Collects the pictures of all audited images, in their order.
pub struct Album<'a> {
    inverter: Option<Arc<Inversion>>,
    steps: &'a dyn Progress,
    pub pictures: Vec<Picture>,
    pub inversions: Vec<Inverted>,
}

impl<'a> Album<'a> {
    /// Creates an empty album. It paints if there is an inverter, and stops when `steps` does.
    pub fn new(inverter: Option<Arc<Inversion>>, steps: &'a dyn Progress) -> Self {
        Self { inverter, steps, pictures: Vec::new(), inversions: Vec::new() }
    }
}

impl<'a> Watcher<2> for Album<'a> {
    type OfItem = Page<'a>;

    fn begin(&mut self) -> Page<'a> {
        let (inverter, steps) = (self.inverter.clone(), self.steps);
        Page { inverter, steps, picture: Picture::default(), painted: Inverted::default() }
    }

    fn item(&mut self, name: &str, _: &[Row], page: Page<'a>) {
        let Page { picture, mut painted, .. } = page;
        painted.size = picture.size;
        painted.released.clone_from(&picture.released);
        if !picture.keypoints.is_empty() {
            self.pictures.push(Picture { name: name.to_owned(), ..picture });
        }
        if !painted.views.is_empty() {
            self.inversions.push(Inverted { name: name.to_owned(), ..painted });
        }
    }
}

pub struct Page<'a> {
    inverter: Option<Arc<Inversion>>,
    steps: &'a dyn Progress,
    picture: Picture,
    painted: Inverted,
}

impl Observer<2> for Page<'_> {
    fn goes_on(&self) -> bool {
        self.steps.goes_on()
    }

    fn cell(&mut self, cell: &Cell<'_, 2>) {
        if let Some(inverter) = self.inverter.clone() {
            // This error was reported when the image was measured.
            let _ = inverter.add(cell, &mut self.painted);
        }
        let picture = &mut self.picture;
        let truth = cell.original.reveal().positions();
        if picture.keypoints.is_empty() {
            picture.keypoints = truth.iter().map(narrow).collect();
            // Bounds reach half a pixel beyond the outermost pixel centers.
            let sides = cell.original.bounds().map(|b| [0, 1].map(|c| b.high[c] - b.low[c]));
            picture.size = sides.unwrap_or([1.0; 2]).map(|side| side.round() as u32);
        }
        let mut slot_of = vec![None; truth.len()];
        for (slot, original) in cell.secret.hidden().iter().enumerate() {
            slot_of[original.index()] = Some(slot);
        }
        let scheme = &cell.row.scheme;
        if picture.released.iter().all(|view| view.scheme != *scheme)
            && let Some(marks) = marks(cell.released, &slot_of)
        {
            picture.released.push(ReleasedView { scheme: scheme.clone(), marks });
        }
        let given = Given::of(cell.row);
        let first = picture.released.first().is_some_and(|view| view.scheme == *scheme);
        if first && picture.graphs.iter().all(|graph| graph.given != given) {
            let neighbors = slot_of.iter().map(|slot| slot.map_or(Vec::new(), |s| best(cell, s)));
            picture.graphs.push(Graph { given: given.clone(), neighbors: neighbors.collect() });
        }
        let recovered = slot_of.iter().map(|slot| {
            slot.and_then(|slot| cell.recovered.position(slot)).map(|place| narrow(&place))
        });
        picture.views.push(RecoveredView {
            scheme: scheme.to_owned(),
            given,
            solver: cell.row.solver.to_owned(),
            recovered: recovered.collect(),
        });
    }
}

/// Returns the true positions of the neighbors of `slot` in the drawn graph: those with the highest
/// scores. Lists without scores (oracle) are cut at the beginning, which is random because record
/// numbers are.
fn best(cell: &Cell<'_, 2>, slot: usize) -> Vec<[f32; 2]> {
    let lists = cell.lists;
    let listed = lists.of(slot);
    let mut order: Vec<usize> = (0..listed.len()).collect();
    if let Some(scores) = lists.scores_of(slot) {
        order.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]).then(a.cmp(&b)));
    }
    let truth = cell.original.reveal().positions();
    // Images have one slot per record.
    let place = |at: &usize| {
        let original = cell.secret.hidden().get(listed[*at].index())?;
        truth.get(original.index()).map(narrow)
    };
    order.iter().take(GRAPH_NEIGHBORS).filter_map(place).collect()
}

fn marks(released: &Released<2>, slot_of: &[Option<usize>]) -> Option<Marks> {
    let origin = released.origin();
    let bounds = released.bounds()?;
    let at = |p: &[f64; 2], t: f64, d: &[f64; 2]| -> [f32; 2] {
        [0, 1].map(|c| (p[c] + t * d[c]) as f32)
    };
    let place = |p: &[f32; 2]| [0, 1].map(|c| f64::from(p[c]) + origin[c]);
    let records = slot_of.iter();
    Some(match released.obfuscation() {
        Obfuscation::Lines(lines) => Marks::Lines(
            records
                .map(|slot| {
                    let foot = place(lines.foot().get((*slot)?)?);
                    let along = lines.direction().get((*slot)?)?.map(f64::from);
                    let (from, to) = bounds.clip(&foot, &along)?;
                    Some([at(&foot, from, &along), at(&foot, to, &along)])
                })
                .collect(),
        ),
        Obfuscation::Rays(rays) => Marks::Rays(
            records
                .map(|slot| {
                    let center = usize::from(*rays.center().get((*slot)?)?);
                    let anchor = place(rays.centers().get(center)?);
                    let along = rays.direction().get((*slot)?)?.map(f64::from);
                    let to = ray_end(released, center, &anchor, &along)?;
                    Some([at(&anchor, 0.0, &along), at(&anchor, to, &along)])
                })
                .collect(),
        ),
        Obfuscation::AxisCandidates(points) => Marks::Points(
            records
                .map(|slot| Some(place(points.position().get((*slot)?)?).map(|x| x as f32)))
                .collect(),
        ),
        // No scheme for images makes planes.
        Obfuscation::AxisPlanes(_) => return None,
    })
}

/// Returns where a ray leaves the region of the image in which its point lies.
fn ray_end(
    released: &Released<2>,
    center: usize,
    anchor: &[f64; 2],
    along: &[f64; 2],
) -> Option<f64> {
    let Obfuscation::Rays(rays) = released.obfuscation() else { return None };
    let bounds = released.bounds()?;
    let origin = released.origin();
    let region = rays.regions().and_then(|regions| regions.get(center));
    // Regions are relative to the origin.
    let region = region.map(|region| region.about(&origin.map(|x| -x))).unwrap_or(bounds);
    // Because of rounding, a ray along a border may miss the region.
    let (_, to) = region.clip(anchor, along).or_else(|| bounds.clip(anchor, along))?;
    Some(to.max(0.0))
}

fn narrow(place: &[f64; 2]) -> [f32; 2] {
    place.map(|x| x as f32)
}
