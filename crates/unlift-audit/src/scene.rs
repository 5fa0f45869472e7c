//! The data of the report's 3D view: a sample of original, hidden and recovered points.

use unlift::audit::{Cell, Plan};
use unlift::geometry::frame::{Bounds, rounded_origin};
use unlift::released::{Obfuscation, Released};
use unlift::truth::Original;
use unlift_io::clouds::record_segments;
use unlift_report::scene::{
    ObfuscationView, Scene3d, SceneBox, Shapes, View, points_within_budget, subsample,
};

use unlift_report::Given;

/// Points and shapes that are collected while an audit runs.
pub struct Pictures {
    sample: Vec<usize>,
    /// The middle of the map. Relative to it `f32` is precise enough, even for georeferenced maps.
    middle: [f64; 3],
    bounds: SceneBox,
    scene: Scene3d,
}

/// Maximum number of shapes per scheme; more lines cannot be distinguished.
const MOST_SHAPES: usize = 3_000;

impl Pictures {
    /// Chooses the points for `n_views` results.
    pub fn new(original: &Original<3>, plan: &Plan<3>, n_views: usize) -> Self {
        let points = original.reveal().positions();
        let max_points = points_within_budget(n_views, plan.schemes.len());
        let sample = subsample(points.len(), max_points, plan.seed);
        let middle = rounded_origin(points);
        let originals: Vec<[f32; 3]> =
            sample.iter().map(|&at| near(&points[at], &middle)).collect();
        let bounds = SceneBox::robust(&originals);
        let scene = Scene3d { originals, n_points: points.len() as u64, ..Scene3d::default() };
        Self { sample, middle, bounds, scene }
    }

    /// Adds one result.
    pub fn add(&mut self, cell: &Cell<'_>) {
        let mut slot_of = vec![None; cell.original.len()];
        for (slot, original) in cell.secret.hidden().iter().enumerate() {
            slot_of[original.index()] = Some(slot);
        }
        if self.scene.obfuscations.iter().all(|view| view.scheme != cell.row.scheme) {
            let slots = self.sample.iter().filter_map(|&at| slot_of[at]);
            let mut records: Vec<usize> =
                slots.map(|slot| slot / cell.released.slots_per_record()).collect();
            records.sort_unstable();
            records.dedup();
            records.truncate(MOST_SHAPES);
            let shapes = shapes(&self.bounds, &self.middle, cell.released, &records);
            let shown = self.sample.iter().enumerate();
            let withheld = shown.filter(|&(_, &at)| slot_of[at].is_none()).map(|(i, _)| i);
            self.scene.obfuscations.push(ObfuscationView {
                scheme: cell.row.scheme.to_owned(),
                shapes,
                n_records: cell.released.obfuscation().len() as u64,
                withheld: withheld.collect(),
            });
        }
        let recovered = self.sample.iter().map(|&at| {
            let position = slot_of[at].and_then(|slot| cell.recovered.position(slot));
            position.map_or([f32::NAN; 3], |p| near(&p, &self.middle))
        });
        self.scene.views.push(View {
            scheme: cell.row.scheme.to_owned(),
            given: Given::of(cell.row),
            solver: cell.row.solver.to_owned(),
            recovered: recovered.collect(),
        });
    }

    /// Returns the finished scene; `cameras` are in the unit of the audit.
    pub fn into_scene(mut self, cameras: &[[f64; 3]], up: Option<[f64; 3]>) -> Scene3d {
        self.scene.cameras = cameras.iter().map(|c| near(c, &self.middle)).collect();
        self.scene.up = up.map(|v| v.map(|x| x as f32));
        self.scene
    }
}

/// Returns the records with these numbers, clipped to `bounds`, relative to `middle`.
pub fn shapes(
    bounds: &SceneBox,
    middle: &[f64; 3],
    released: &Released<3>,
    records: &[usize],
) -> Shapes {
    let origin = released.origin();
    let place = |p: &[f32; 3]| -> [f32; 3] {
        std::array::from_fn(|c| (f64::from(p[c]) + origin[c] - middle[c]) as f32)
    };
    match released.obfuscation() {
        Obfuscation::Lines(_) | Obfuscation::Rays(_) => {
            let corner = |corner: [f32; 3]| [0, 1, 2].map(|c| f64::from(corner[c]) + middle[c]);
            let frame = Bounds { low: corner(bounds.low), high: corner(bounds.high) };
            let segments = record_segments(released, &frame, records.iter().copied());
            let ends = |ends: [[f64; 3]; 2]| ends.map(|end| near(&end, middle));
            Shapes::Segments(segments.into_iter().map(ends).collect())
        }
        Obfuscation::AxisPlanes(planes) => {
            let patch = |&r: &usize| {
                let axis = usize::from(planes.axis()[r]);
                let shift = (origin[axis] - middle[axis]) as f32;
                bounds.axis_patch(axis, planes.offset()[r] + shift)
            };
            Shapes::Patches(records.iter().filter_map(patch).collect())
        }
        Obfuscation::AxisCandidates(candidates) => {
            Shapes::Points(records.iter().map(|&r| place(&candidates.position()[r])).collect())
        }
    }
}

pub fn near(point: &[f64; 3], middle: &[f64; 3]) -> [f32; 3] {
    std::array::from_fn(|c| (point[c] - middle[c]) as f32)
}
