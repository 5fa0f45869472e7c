//! Records of a map as shapes.

use unlift::geometry::frame::Bounds;
use unlift::released::{Obfuscation, Released};
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
            let ends = |&record: &usize| segment(released, &frame, record);
            let near = |ends: [[f64; 3]; 2]| ends.map(|end| near(&end, middle));
            Shapes::Segments(records.iter().filter_map(ends).map(near).collect())
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

/// Returns the part of a line or ray in the box, in the map's frame; `None` if it misses or only touches it.
fn segment(released: &Released<3>, bounds: &Bounds<3>, record: usize) -> Option<[[f64; 3]; 2]> {
    let (point, direction, start) = match released.obfuscation() {
        Obfuscation::Lines(lines) => {
            (lines.foot()[record], lines.direction()[record], f64::NEG_INFINITY)
        }
        Obfuscation::Rays(rays) => {
            let center = rays.centers()[usize::from(rays.center()[record])];
            (center, rays.direction()[record], 0.0)
        }
        Obfuscation::AxisPlanes(_) | Obfuscation::AxisCandidates(_) => return None,
    };
    let origin = released.origin();
    let point = [0, 1, 2].map(|c| f64::from(point[c]) + origin[c]);
    let direction = direction.map(f64::from);
    let (from, to) = bounds.clip(&point, &direction)?;
    // Rounding may leave the box by an ulp.
    let at = |t: f64| {
        [0, 1, 2].map(|c| (point[c] + t * direction[c]).clamp(bounds.low[c], bounds.high[c]))
    };
    (from.max(start) < to).then(|| [at(from.max(start)), at(to)])
}

/// Returns a point relative to `middle`.
pub fn near(point: &[f64; 3], middle: &[f64; 3]) -> [f32; 3] {
    std::array::from_fn(|c| (point[c] - middle[c]) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use unlift::Unit;
    use unlift::released::{Lines, Rays};

    #[test]
    fn records_are_clipped_in_the_frame_of_the_map() {
        let bounds = Bounds { low: [1e6 - 1.0, -1.0, -1.0], high: [1e6 + 1.0, 1.0, 1.0] };
        let segments = |obfuscation: Obfuscation<3>| -> Vec<[[f64; 3]; 2]> {
            let n = obfuscation.len();
            let released = Released::try_new(obfuscation, 1, [1e6, 0.0, 0.0], Unit::Meter, None);
            let released = released.unwrap();
            (0..n).filter_map(|record| segment(&released, &bounds, record)).collect()
        };
        let up = [0.0, 0.0, 1.0];
        // The second line misses the box, the third one touches it.
        let feet = [[0.5, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 1.0]];
        let lines = Lines::through(&feet, &[up, up, [0.0, 1.0, -1.0]]).unwrap();
        let within = |x: f64, from: f64| [[1e6 + x, 0.0, from], [1e6 + x, 0.0, 1.0]];
        assert_eq!(segments(Obfuscation::Lines(lines)), [within(0.5, -1.0)]);
        // Rays from the middle, from below the box, and from above it.
        let centers = [[0.0; 3], [0.0, 0.0, -5.0], [0.0, 0.0, 5.0]];
        let rays = Rays::try_new(&centers, vec![0, 1, 2], &[up; 3]).unwrap();
        assert_eq!(segments(Obfuscation::Rays(rays)), [within(0.0, 0.0), within(0.0, -1.0)]);
    }
}
