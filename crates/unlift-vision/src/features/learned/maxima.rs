//! Non-maximum suppression in a map of scores.

use crate::features::Extraction;

/// A map of scores, `(height, width)`, row-major.
pub(crate) struct Scores {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f32>,
}

impl Scores {
    /// Returns the positions `(x, y)` of the maxima that `options` request, the best first, equal
    /// ones in reading order. None is within `radius` pixels of the border or, in x and y, of another one.
    ///
    /// Three passes, as in the authors' code: each maximum suppresses its neighborhood, then again.
    pub(crate) fn maxima(&self, radius: usize, options: &Extraction) -> Vec<[usize; 2]> {
        let Self { width, height, ref values } = *self;
        let largest = |map: &[f32]| windows(map, width, radius, f32::max);
        let mut taken: Vec<bool> =
            values.iter().zip(largest(values)).map(|(a, b)| *a == b).collect();
        for _ in 0..2 {
            let hidden = windows(&taken, width, radius, |a, b| a | b);
            let shown = |(value, hidden): (&f32, &bool)| if *hidden { 0.0 } else { *value };
            let rest: Vec<f32> = values.iter().zip(&hidden).map(shown).collect();
            let maxima = rest.iter().zip(largest(&rest)).map(|(a, b)| *a == b);
            for ((taken, hidden), maximum) in taken.iter_mut().zip(hidden).zip(maxima) {
                *taken |= maximum && !hidden;
            }
        }
        let inner = |at: usize, side: usize| at >= radius && at + radius < side;
        let mut maxima: Vec<usize> = (0..values.len())
            .filter(|&at| taken[at] && values[at] > options.min_score)
            .filter(|&at| inner(at % width, width) && inner(at / width, height))
            .collect();
        maxima.sort_by(|&a, &b| values[b].total_cmp(&values[a]).then(a.cmp(&b)));
        maxima.truncate(options.max_features);
        maxima.into_iter().map(|at| [at % width, at / width]).collect()
    }

    /// Returns the bilinearly interpolated score at a position; 0 outside.
    pub(crate) fn at(&self, place: [f32; 2]) -> f32 {
        let corners = corners(place, [self.width, self.height]);
        corners.map(|([x, y], weight)| weight * self.values[y * self.width + x]).sum()
    }
}

/// Returns those of the four pixels around a position that are in a map of `size` (width, height),
/// and their bilinear weights.
pub(crate) fn corners(
    [x, y]: [f32; 2],
    size: [usize; 2],
) -> impl Iterator<Item = ([usize; 2], f32)> {
    let (left, top) = (x.floor(), y.floor());
    let (right, bottom) = (x - left, y - top);
    let (column, row) = (left as isize, top as isize);
    let all = [
        ([column, row], (1.0 - right) * (1.0 - bottom)),
        ([column + 1, row], right * (1.0 - bottom)),
        ([column, row + 1], (1.0 - right) * bottom),
        ([column + 1, row + 1], right * bottom),
    ];
    // Negative numbers become large ones.
    let all = all.map(|(pixel, weight)| (pixel.map(|at| at as usize), weight));
    all.into_iter().filter(move |(pixel, _)| pixel[0] < size[0] && pixel[1] < size[1])
}

/// Returns the largest value within `radius` columns and rows of every pixel of a map.
fn windows<T: Copy>(map: &[T], width: usize, radius: usize, larger: fn(T, T) -> T) -> Vec<T> {
    let mut across = map.to_vec();
    for (row, out) in map.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
        for step in 1..=radius.min(width - 1) {
            merge(&mut out[step..], &row[..width - step], larger);
            merge(&mut out[..width - step], &row[step..], larger);
        }
    }
    let mut down = across.clone();
    let height = map.len() / width;
    for step in 1..=radius.min(height - 1) {
        merge(&mut down[step * width..], &across[..(height - step) * width], larger);
        merge(&mut down[..(height - step) * width], &across[step * width..], larger);
    }
    down
}

fn merge<T: Copy>(into: &mut [T], other: &[T], larger: fn(T, T) -> T) {
    into.iter_mut().zip(other).for_each(|(a, b)| *a = larger(*a, *b));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_suppressed_score_suppresses_none() {
        // 5 suppresses 4, and so 3 is a maximum of the rest; 2 is beside it. Around them the border.
        let mut values = vec![0.0; 18];
        values[7..11].copy_from_slice(&[0.5, 0.4, 0.3, 0.2]);
        let row = Scores { width: 6, height: 3, values };
        let all = Extraction { min_score: 0.1, ..Extraction::ALIKED };
        assert_eq!(row.maxima(1, &all), [[1, 1], [3, 1]]);
        let limited = Extraction { max_features: 1, ..all };
        assert_eq!(row.maxima(1, &limited), [[1, 1]]);
        let high = Extraction { min_score: 0.3, ..all };
        assert_eq!(row.maxima(1, &high), [[1, 1]]);
    }
}
