//! The blind baseline: an attack without neighborhoods. Only what exceeds it is a leak.

use super::Accuracy;
use crate::geometry::frame::Bounds;
use crate::geometry::vector::{along, distance, dot, sub, widen};
use crate::released::{Obfuscation, Released};
use crate::truth::{Original, Secret};

/// Computes the errors of the blind baseline, which guesses from one record at a time and the box
/// that contains the points: the image, or else the 1-99 % box of the originals. The latter makes
/// the baseline generous, because an attacker does not have it.
///
/// The guess depends on the family:
/// - lines: the middle of the segment in the box, or the point nearest to the box's center if the
///   line misses the box;
/// - rays: likewise on the half-line. If each center has a region of its own, the guess is the
///   median range under uniform density, r_max / sqrt 2 in an image;
/// - axis planes: the box's center, projected onto the plane;
/// - axis candidates: the published point.
pub fn blind<const D: usize>(
    released: &Released<D>,
    original: &Original<D>,
    secret: &Secret,
) -> Accuracy {
    let points = original.reveal().positions();
    let origin = released.origin();
    let local: Vec<[f64; D]> = points.iter().map(|p| sub(p, &origin)).collect();
    let known = released.bounds().map(|bounds| bounds.about(&origin));
    let guess = match known.or_else(|| Bounds::quantiles(&local, 0.01)) {
        Some(bounds) => guesses(released, &bounds),
        None => Vec::new(),
    };
    let errors = secret
        .hidden()
        .iter()
        .enumerate()
        .map(|(slot, original)| {
            distance(&guess[slot / released.slots_per_record()], &local[original.index()])
        })
        .collect();
    Accuracy::of(errors)
}

/// Returns one guess per record, relative to the released origin.
fn guesses<const D: usize>(released: &Released<D>, bounds: &Bounds<D>) -> Vec<[f64; D]> {
    let center = bounds.center();
    match released.obfuscation() {
        Obfuscation::Lines(lines) => lines
            .foot()
            .iter()
            .zip(lines.direction())
            .map(|(p, d)| middle(bounds, &widen(p), &widen(d), f64::NEG_INFINITY))
            .collect(),
        Obfuscation::Rays(rays) => rays
            .center()
            .iter()
            .zip(rays.direction())
            .map(|(&c, d)| {
                let (center, d) = (widen(&rays.centers()[usize::from(c)]), widen(d));
                match rays.regions().and_then(|of| of[usize::from(c)].clip(&center, &d)) {
                    // Under uniform density the share within r is proportional to r^D.
                    Some((_, to)) => along(&center, to * libm::pow(0.5, 1.0 / D as f64), &d),
                    None => middle(bounds, &center, &d, 0.0),
                }
            })
            .collect(),
        Obfuscation::AxisPlanes(planes) => planes
            .axis()
            .iter()
            .zip(planes.offset())
            .map(|(&axis, &offset)| {
                let mut guess = center;
                guess[usize::from(axis)] = f64::from(offset);
                guess
            })
            .collect(),
        Obfuscation::AxisCandidates(candidates) => {
            candidates.position().iter().map(widen).collect()
        }
    }
}

/// Returns the middle of the part of a line in the box, from parameter `from` on.
fn middle<const D: usize>(
    bounds: &Bounds<D>,
    point: &[f64; D],
    direction: &[f64; D],
    from: f64,
) -> [f64; D] {
    let segment = bounds.clip(point, direction).map(|(a, b)| (a.max(from), b));
    let t = match segment {
        Some((a, b)) if a <= b => 0.5 * (a + b),
        _ => dot(&sub(&bounds.center(), point), direction).max(from),
    };
    along(point, t, direction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_half_line_starts_at_its_center() {
        let bounds = Bounds { low: [0.0; 3], high: [4.0; 3] };
        let guess = middle(&bounds, &[1.0, 2.0, 2.0], &[1.0, 0.0, 0.0], 0.0);
        assert_eq!(guess, [2.5, 2.0, 2.0]);
        let line = middle(&bounds, &[1.0, 2.0, 2.0], &[1.0, 0.0, 0.0], f64::NEG_INFINITY);
        assert_eq!(line, [2.0, 2.0, 2.0]);
    }
}
