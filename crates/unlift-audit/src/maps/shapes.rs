//! Records of a map as shapes.

use unlift::geometry::frame::Bounds;
use unlift::released::{Obfuscation, Released};
use unlift_io::clouds::record_segments;
use unlift_report::scene::{SceneBox, Shapes};

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

/// Returns a point relative to `middle`.
pub fn near(point: &[f64; 3], middle: &[f64; 3]) -> [f32; 3] {
    std::array::from_fn(|c| (point[c] - middle[c]) as f32)
}
