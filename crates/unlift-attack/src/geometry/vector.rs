//! Vector operations, median and quantile.

/// Inner product.
#[inline(always)]
pub fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let mut sum = 0.0;
    for c in 0..D {
        sum += a[c] * b[c];
    }
    sum
}

/// Cross product.
#[inline(always)]
pub fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a - b`.
#[inline(always)]
pub fn sub<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|c| a[c] - b[c])
}

/// `a + t b`.
#[inline(always)]
pub fn along<const D: usize>(a: &[f64; D], t: f64, b: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|c| a[c] + t * b[c])
}

/// Squared Euclidean distance.
#[inline(always)]
pub fn squared_distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let mut sum = 0.0;
    for c in 0..D {
        let d = a[c] - b[c];
        sum += d * d;
    }
    sum
}

/// Euclidean distance.
#[inline(always)]
pub fn distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    squared_distance(a, b).sqrt()
}

/// Converts `f32` coordinates to `f64`.
#[inline(always)]
pub fn widen<const D: usize>(a: &[f32; D]) -> [f64; D] {
    a.map(f64::from)
}

/// Returns the median of `values` (the lower one of an even number); reorders them.
///
/// # Panics
/// When `values` is empty or holds a NaN.
pub fn median(values: &mut [f64]) -> f64 {
    let middle = (values.len() - 1) / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Returns the [`quantile`] of values in any order; 0 without values.
pub fn quantile_of(values: impl Iterator<Item = f64>, q: f64) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    if sorted.is_empty() { 0.0 } else { quantile(&sorted, q) }
}

/// Returns the value below which the fraction `q` in `[0, 1]` of `sorted` lies, linearly interpolated.
///
/// # Panics
/// When `sorted` is empty.
pub fn quantile(sorted: &[f64], q: f64) -> f64 {
    let at = q * (sorted.len() - 1) as f64;
    let low = at as usize;
    let high = (low + 1).min(sorted.len() - 1);
    sorted[low] + (at - low as f64) * (sorted[high] - sorted[low])
}
