//! Pictures of the chosen images, collected while these are audited again.

use std::sync::Arc;

use unlift::audit::{Cell, Observer, Row, Watcher};
use unlift::released::{Obfuscation, Released};
use unlift_report::inversions::Inversion as Sheet;
use unlift_report::pictures::{GRAPH_NEIGHBORS, Graph, Marks, Picture, ReleasedView};
use unlift_report::{ByAttack, same_lists};

use crate::Progress;
use crate::inversion::Inversion;
use crate::maps::released::slot_of;

/// Collects the pictures of all audited images, in their order. It paints if there is an inverter, and stops when `steps` does.
pub struct Album<'a> {
    pub inverter: Option<Arc<Inversion>>,
    pub steps: &'a dyn Progress,
    pub pictures: Vec<Picture>,
    pub inversions: Vec<Sheet>,
}

impl<'a> Watcher<2> for Album<'a> {
    type OfItem = Page<'a>;

    fn begin(&mut self) -> Page<'a> {
        let (inverter, steps) = (self.inverter.clone(), self.steps);
        Page { inverter, steps, picture: Picture::default(), painted: Sheet::default() }
    }

    fn item(&mut self, name: &str, _: &[Row], page: Page<'a>) {
        let Page { picture, mut painted, .. } = page;
        painted.size = picture.size;
        painted.released.clone_from(&picture.released);
        if !picture.keypoints.is_empty() {
            self.pictures.push(Picture { name: name.to_owned(), ..picture });
        }
        if !painted.views.is_empty() {
            self.inversions.push(Sheet { name: name.to_owned(), ..painted });
        }
    }
}

pub struct Page<'a> {
    inverter: Option<Arc<Inversion>>,
    steps: &'a dyn Progress,
    picture: Picture,
    painted: Sheet,
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
        let slot_of = slot_of(cell.secret);
        let scheme = &cell.row.scheme;
        if picture.released.iter().all(|view| view.scheme != *scheme)
            && let Some(marks) = marks(cell.released, &slot_of)
        {
            picture.released.push(ReleasedView { scheme: scheme.clone(), marks });
        }
        let first = picture.released.first().is_some_and(|view| view.scheme == *scheme);
        if first && picture.graphs.iter().all(|graph| !same_lists(&graph.row, cell.row)) {
            let neighbors = slot_of.iter().map(|slot| slot.map_or(Vec::new(), |s| best(cell, s)));
            picture.graphs.push(Graph { row: cell.row.clone(), neighbors: neighbors.collect() });
        }
        let recovered = slot_of.iter().map(|slot| {
            slot.and_then(|slot| cell.recovered.position(slot)).map(|place| narrow(&place))
        });
        picture.views.push(ByAttack { row: cell.row.clone(), recovered: recovered.collect() });
    }
}

/// Returns the true positions of the neighbors of `slot` in the drawn graph: those with the highest
/// scores. Lists without scores (oracle) are cut at the beginning, which is random because record numbers are.
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
    let (origin, bounds) = (released.origin(), released.bounds()?);
    let place = |p: &[f32; 2]| [0, 1].map(|c| f64::from(p[c]) + origin[c]);
    let part = |p: [f64; 2], along: [f64; 2], (from, to): (f64, f64)| {
        [from, to].map(|t| [0, 1].map(|c| (p[c] + t * along[c]) as f32))
    };
    let segments = |of: &dyn Fn(usize) -> Option<[[f32; 2]; 2]>| -> Vec<_> {
        slot_of.iter().map(|slot| of((*slot)?)).collect()
    };
    Some(match released.obfuscation() {
        Obfuscation::Lines(lines) => Marks::Lines(segments(&|slot| {
            let (foot, along) =
                (place(&lines.foot()[slot]), lines.direction()[slot].map(f64::from));
            Some(part(foot, along, bounds.clip(&foot, &along)?))
        })),
        Obfuscation::Rays(rays) => Marks::Rays(segments(&|slot| {
            let center = usize::from(rays.center()[slot]);
            let anchor = place(&rays.centers()[center]);
            let along = rays.direction()[slot].map(f64::from);
            // The ray leaves the region of the image in which its point lies. Regions are relative to the origin.
            let region = rays.regions().and_then(|regions| regions.get(center));
            let region = region.map_or(bounds, |region| region.about(&origin.map(|x| -x)));
            // Because of rounding, a ray along a border may miss the region.
            let (_, to) = region.clip(&anchor, &along).or_else(|| bounds.clip(&anchor, &along))?;
            Some(part(anchor, along, (0.0, to.max(0.0))))
        })),
        Obfuscation::AxisCandidates(points) => {
            let point = |slot: &Option<usize>| Some(narrow(&place(&points.position()[(*slot)?])));
            Marks::Points(slot_of.iter().map(point).collect())
        }
        // No scheme for images makes planes.
        Obfuscation::AxisPlanes(_) => return None,
    })
}

fn narrow(place: &[f64; 2]) -> [f32; 2] {
    place.map(|x| x as f32)
}
