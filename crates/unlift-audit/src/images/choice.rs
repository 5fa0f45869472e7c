//! The choice of images to use, and of the headline threshold.

use unlift::audit::Threshold;

/// The headline threshold in pixels; the nearest given threshold is used.
const HEADLINE_PX: f64 = 10.0;

/// Returns the index of the headline threshold in `thresholds`.
pub fn headline(thresholds: &[Threshold]) -> usize {
    let away = |at: &usize| (thresholds[*at].value / HEADLINE_PX).ln().abs();
    (0..thresholds.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0)
}

/// Returns the numbers of at most `max_images` of `n` images, evenly spaced: the middles of equal parts.
pub fn evenly(n: usize, max_images: Option<usize>) -> Vec<usize> {
    let max_images = max_images.unwrap_or(n).min(n);
    (0..max_images).map(|at| ((2 * at + 1) * n) / (2 * max_images)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_evenly_spaced_and_all_without_a_limit() {
        assert_eq!(evenly(4, None), [0, 1, 2, 3]);
        assert_eq!(evenly(10, Some(3)), [1, 5, 8]);
        assert_eq!(evenly(3, Some(9)), [0, 1, 2]);
        assert_eq!(evenly(0, Some(2)), [0; 0]);
    }
}
