//! Position and extent of a map, robust to outliers.

use super::vector::{median, quantile, sub};
use crate::Error;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<const D: usize> {
    /// Smallest coordinates.
    pub low: [f64; D],
    /// Largest coordinates.
    pub high: [f64; D],
}

impl<const D: usize> Bounds<D> {
    /// Returns the box between the quantiles `q` and `1 - q` of each coordinate; `None` without points.
    pub fn quantiles(points: &[[f64; D]], q: f64) -> Option<Self> {
        if points.is_empty() {
            return None;
        }
        let ends: [[f64; 2]; D] = std::array::from_fn(|c| {
            let mut column: Vec<f64> = points.iter().map(|p| p[c]).collect();
            column.sort_unstable_by(f64::total_cmp);
            [q, 1.0 - q].map(|q| quantile(&column, q))
        });
        Some(Self { low: ends.map(|e| e[0]), high: ends.map(|e| e[1]) })
    }

    /// Creates the box from `low` to `high`.
    ///
    /// # Errors
    /// When a corner is not finite, or the box has no extent along an axis.
    pub fn try_new(low: [f64; D], high: [f64; D]) -> Result<Self, Error> {
        let sound = |c: usize| low[c].is_finite() && high[c].is_finite() && low[c] < high[c];
        if !(0..D).all(sound) {
            let found = format!("{low:?} to {high:?}");
            return Err(Error::new("bounds", "finite corners, the low one first", found));
        }
        Ok(Self { low, high })
    }

    /// Whether `point` lies in the box or on its border.
    pub fn contains(&self, point: &[f64; D]) -> bool {
        (0..D).all(|c| (self.low[c]..=self.high[c]).contains(&point[c]))
    }

    /// Returns the box relative to `origin`.
    #[must_use]
    pub fn about(&self, origin: &[f64; D]) -> Self {
        Self { low: sub(&self.low, origin), high: sub(&self.high, origin) }
    }

    /// Middle of the box.
    pub fn center(&self) -> [f64; D] {
        std::array::from_fn(|c| 0.5 * (self.low[c] + self.high[c]))
    }

    /// Longest side.
    pub fn longest_side(&self) -> f64 {
        (0..D).map(|c| self.high[c] - self.low[c]).fold(0.0, f64::max)
    }

    /// Returns the range of `t` for which `point + t direction` lies in the box; `None` if the line misses it.
    pub fn clip(&self, point: &[f64; D], direction: &[f64; D]) -> Option<(f64, f64)> {
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        for c in 0..D {
            if direction[c] == 0.0 {
                if point[c] < self.low[c] || point[c] > self.high[c] {
                    return None;
                }
                continue;
            }
            let one = (self.low[c] - point[c]) / direction[c];
            let other = (self.high[c] - point[c]) / direction[c];
            from = from.max(one.min(other));
            to = to.min(one.max(other));
        }
        (from <= to && from.is_finite() && to.is_finite()).then_some((from, to))
    }
}

/// Returns the origin for releasing a map: its median per coordinate, rounded to a power of two near an eighth of the spread. The rounding
/// reveals nothing about a single point, and `f32` coordinates relative to it are exact enough for georeferenced maps.
pub fn rounded_origin<const D: usize>(points: &[[f64; D]]) -> [f64; D] {
    let Some(bounds) = Bounds::quantiles(points, 0.1) else {
        return [0.0; D];
    };
    let step = power_of_two_below(bounds.longest_side() / 8.0);
    std::array::from_fn(|c| {
        let mut column: Vec<f64> = points.iter().map(|p| p[c]).collect();
        (median(&mut column) / step).round() * step + 0.0
    })
}

/// Returns the largest power of two that is at most `x`; 1 if there is none.
fn power_of_two_below(x: f64) -> f64 {
    if !(x.is_normal() && x > 0.0) {
        return 1.0;
    }
    // Clearing the mantissa is exact, unlike 2^floor(log2 x).
    f64::from_bits(x.to_bits() & 0x7FF0_0000_0000_0000)
}
