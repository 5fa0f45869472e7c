//! The blind baseline: an attack without neighborhoods. Only what exceeds it is a leak.

use super::Accuracy;
use super::plausible::on_record;
use crate::OriginalId;
use crate::geometry::frame::Bounds;
use crate::geometry::vector::{along, distance, dot, sub, widen};
use crate::released::{Obfuscation, Released};
use crate::truth::{Original, Secret};

/// Computes the errors of the blind baseline, which guesses from one record at a time and the
/// image, or else the 1-99 % box of the originals, which an attacker does not have.
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
    let Some(bounds) = known.or_else(|| Bounds::quantiles(&local, 0.01)) else {
        return Accuracy::default();
    };
    let error = |(slot, original): (usize, &OriginalId)| {
        let guess = guess(released.obfuscation(), slot / released.slots_per_record(), &bounds);
        distance(&guess, &local[original.index()])
    };
    Accuracy::of(secret.hidden().iter().enumerate().map(error).collect())
}

/// Returns the guess for a record, relative to the released origin.
fn guess<const D: usize>(records: &Obfuscation<D>, record: usize, bounds: &Bounds<D>) -> [f64; D] {
    match records {
        Obfuscation::Lines(lines) => {
            let (foot, direction) = (&lines.foot()[record], &lines.direction()[record]);
            middle(bounds, &widen(foot), &widen(direction), f64::NEG_INFINITY)
        }
        Obfuscation::Rays(rays) => {
            let at = usize::from(rays.center()[record]);
            let (center, direction) =
                (widen(&rays.centers()[at]), widen(&rays.direction()[record]));
            match rays.regions().and_then(|of| of[at].clip(&center, &direction)) {
                // Under uniform density the share within r is proportional to r^D.
                Some((_, to)) => along(&center, to * libm::pow(0.5, 1.0 / D as f64), &direction),
                None => middle(bounds, &center, &direction, 0.0),
            }
        }
        Obfuscation::AxisPlanes(_) => on_record(records, record, &bounds.center()),
        Obfuscation::AxisCandidates(candidates) => widen(&candidates.position()[record]),
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
