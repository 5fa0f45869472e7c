//! What of an endless line lies in a box.

use unlift::geometry::frame::Bounds;
use unlift::released::{Obfuscation, Released};

/// The two ends of a piece of a line.
pub type Segment<const D: usize> = [[f64; D]; 2];

/// The part of the line through `point` along `direction` inside the box from `low` to `high`, or
/// `None` when the line misses the box, only touches it, or has no direction.
pub fn clip_line_to_box<const D: usize>(
    point: &[f64; D],
    direction: &[f64; D],
    low: &[f64; D],
    high: &[f64; D],
) -> Option<Segment<D>> {
    clip(point, direction, f64::NEG_INFINITY, low, high)
}

/// [`clip_line_to_box`] for the half-line that starts at `point`.
pub fn clip_ray_to_box<const D: usize>(
    point: &[f64; D],
    direction: &[f64; D],
    low: &[f64; D],
    high: &[f64; D],
) -> Option<Segment<D>> {
    clip(point, direction, 0.0, low, high)
}

/// The lines or rays of a released map inside the box from `low` to `high`, all in the map's frame
/// (the origin is added), in record order; records that miss the box are left out. Empty for
/// families that are neither.
pub fn record_segments<const D: usize>(
    released: &Released<D>,
    low: &[f64; D],
    high: &[f64; D],
) -> Vec<Segment<D>> {
    let origin = released.origin();
    let placed = |p: [f32; D]| -> [f64; D] { std::array::from_fn(|c| f64::from(p[c]) + origin[c]) };
    match released.obfuscation() {
        Obfuscation::Lines(lines) => lines
            .foot()
            .iter()
            .zip(lines.direction())
            .filter_map(|(&f, d)| clip_line_to_box(&placed(f), &d.map(f64::from), low, high))
            .collect(),
        Obfuscation::Rays(rays) => rays
            .center()
            .iter()
            .zip(rays.direction())
            .filter_map(|(&c, d)| {
                let center = placed(rays.centers()[usize::from(c)]);
                clip_ray_to_box(&center, &d.map(f64::from), low, high)
            })
            .collect(),
        Obfuscation::AxisPlanes(_) | Obfuscation::AxisCandidates(_) => Vec::new(),
    }
}

/// Slab by slab: `t` runs over what is inside all of them.
fn clip<const D: usize>(
    point: &[f64; D],
    direction: &[f64; D],
    start: f64,
    low: &[f64; D],
    high: &[f64; D],
) -> Option<Segment<D>> {
    let bounds = Bounds { low: *low, high: *high };
    let finite = |row: &[f64; D]| row.iter().all(|x| x.is_finite());
    let is_box = low.iter().zip(high).all(|(low, high)| low <= high);
    let (from, to) = bounds.clip(point, direction)?;
    let from = from.max(start);
    if !(from < to && is_box && finite(point) && finite(direction)) {
        return None;
    }
    // Rounding may leave the box by an ulp: the ends are held inside it.
    let at = |t: f64| std::array::from_fn(|c| (point[c] + t * direction[c]).clamp(low[c], high[c]));
    Some([at(from), at(to)])
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOW: [f64; 3] = [0.0; 3];
    const HIGH: [f64; 3] = [1.0, 2.0, 3.0];

    #[test]
    fn a_line_through_the_box_ends_on_its_faces() {
        let segment = clip_line_to_box(&[0.5, 9.0, 1.0], &[0.0, -2.0, 0.0], &LOW, &HIGH);
        assert_eq!(segment, Some([[0.5, 2.0, 1.0], [0.5, 0.0, 1.0]]));
    }

    #[test]
    fn a_ray_starts_at_its_center() {
        let segment = clip_ray_to_box(&[0.5, 1.0, 1.0], &[0.0, 1.0, 0.0], &LOW, &HIGH);
        assert_eq!(segment, Some([[0.5, 1.0, 1.0], [0.5, 2.0, 1.0]]));
        assert_eq!(clip_ray_to_box(&[0.5, 9.0, 1.0], &[0.0, 1.0, 0.0], &LOW, &HIGH), None);
    }

    #[test]
    fn misses_touches_and_lines_without_direction_have_no_segment() {
        for (point, direction) in [
            ([5.0, 5.0, 5.0], [0.0, 0.0, 1.0]),
            ([1.0, 2.0, 0.0], [1.0, -1.0, 0.0]),
            ([0.5, 0.5, 0.5], [0.0, 0.0, 0.0]),
            ([0.5, 0.5, 0.5], [f64::NAN, 0.0, 1.0]),
        ] {
            let segment = clip_line_to_box(&point, &direction, &LOW, &HIGH);
            assert_eq!(segment, None, "{point:?} {direction:?}");
        }
    }

    #[test]
    fn what_is_no_box_holds_nothing() {
        for high in [[1.0, -1.0, 1.0], [f64::NAN; 3]] {
            let segment = clip_line_to_box(&[0.5; 3], &[0.0, 1.0, 0.0], &LOW, &high);
            assert_eq!(segment, None);
        }
    }
}
