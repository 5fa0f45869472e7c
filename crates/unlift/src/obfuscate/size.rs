//! Check of the size and precision of a map's coordinates.

use crate::Error;
use crate::geometry::frame::Bounds;
use crate::geometry::vector::quantile_of;

/// Allowed size of a map in its own unit. Records are released as `f32`, which must represent the
/// cubes of lengths, and of thousandths of them.
const SIZES: std::ops::RangeInclusive<f64> = 1e-10..=1e12;
/// Minimum size of a map, in steps between adjacent doubles.
const STEPS: f64 = 1e4;

/// Rejects maps whose coordinates are too small, too large or too coarse. Little could be recovered
/// from them, which is not protection.
pub(super) fn check<const D: usize>(points: &[[f64; D]]) -> Result<(), Error> {
    // Quantiles ignore a few outliers.
    let Some(bounds) = Bounds::quantiles(points, 0.05) else { return Ok(()) };
    let size = bounds.longest_side();
    let middle = |c: usize| quantile_of(points.iter().map(|p| p[c]), 0.5).abs();
    let step = (0..D).map(middle).fold(0.0, f64::max) * f64::EPSILON;
    // Coincident points differ by rounding only.
    if size <= 4.0 * step {
        return Ok(());
    }
    if !SIZES.contains(&size) {
        let (least, most) = (SIZES.start(), SIZES.end());
        let expected =
            format!("a size between {least:e} and {most:e} units (use another unit or scale)");
        return Err(Error::new("map", expected, format!("{size:.1e}")));
    }
    if size < STEPS * step {
        let expected = "coordinates nearer to the origin: doubles there are too coarse for a map";
        let found = format!("steps of {step:.1e} in a size of {size:.1e}");
        return Err(Error::new("map", expected, found));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_numbers_that_cannot_be_worked_with_are_refused() {
        let line = |from: f64, step: f64| -> Vec<[f64; 3]> {
            (0..100).map(|i| [from + step * f64::from(i), from, 0.0]).collect()
        };
        let usual = [(0.0, 0.1), (5e6, 0.01), (0.0, 1e-9), (-1e9, 1.0), (1e15, 0.0), (0.0, 1e9)];
        let refused = [(0.0, 1e-14), (0.0, 1e11), (1e15, 0.1)];
        for (from, step) in usual.into_iter().chain(refused) {
            let is_usual = usual.contains(&(from, step));
            assert_eq!(check(&line(from, step)).is_ok(), is_usual, "{from} {step}");
        }
        let far = [line(0.0, 0.1), vec![[1e30; 3]]].concat();
        assert!(check(&far).is_ok() && check::<2>(&[]).is_ok());
    }
}
