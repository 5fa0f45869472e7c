//! Non-maximum suppression in a map of scores.

/// A map of scores, `(height, width)`, row-major.
pub(crate) struct Scores {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f32>,
}

/// Criteria of maxima.
pub(crate) struct Wanted {
    /// Half side of the square around a maximum that contains no other one.
    pub radius: usize,
    /// Width in pixels of the image border without maxima.
    pub border: usize,
    /// The score that must be exceeded.
    pub min_score: f32,
    /// Maximum number of maxima, the best ones.
    pub most: usize,
}

impl Scores {
    /// Returns the positions `(x, y)` of the maxima, the best first, equal ones in reading order.
    ///
    /// Three passes, as in the code of ALIKED and SuperPoint: each maximum suppresses its
    /// neighborhood, then the rest may have new maxima.
    pub(crate) fn maxima(&self, wanted: &Wanted) -> Vec<[usize; 2]> {
        let Self { width, height, ref values } = *self;
        let radius = wanted.radius;
        let largest = |map: &[f32]| windows(map, width, radius, f32::max);
        let mut taken: Vec<bool> =
            values.iter().zip(largest(values)).map(|(a, b)| *a == b).collect();
        for _ in 0..2 {
            let hidden = windows(&taken, width, radius, |a, b| a | b);
            let rest: Vec<f32> = values
                .iter()
                .zip(&hidden)
                .map(|(v, hidden)| if *hidden { 0.0 } else { *v })
                .collect();
            let maxima = rest.iter().zip(largest(&rest)).map(|(a, b)| *a == b);
            for ((taken, hidden), maximum) in taken.iter_mut().zip(hidden).zip(maxima) {
                *taken |= maximum && !hidden;
            }
        }
        let inner = |at: usize, side: usize| at >= wanted.border && at + wanted.border < side;
        let mut found: Vec<usize> = (0..values.len())
            .filter(|&at| taken[at] && values[at] > wanted.min_score)
            .filter(|&at| inner(at % width, width) && inner(at / width, height))
            .collect();
        found.sort_by(|&a, &b| values[b].total_cmp(&values[a]).then(a.cmp(&b)));
        found.truncate(wanted.most);
        found.into_iter().map(|at| [at % width, at / width]).collect()
    }

    /// Returns the bilinearly interpolated score at a position; 0 outside.
    pub(crate) fn at(&self, [x, y]: [f32; 2]) -> f32 {
        corners(x, y)
            .into_iter()
            .filter(|&([x, y], _)| {
                (0..self.width as isize).contains(&x) && (0..self.height as isize).contains(&y)
            })
            .map(|([x, y], weight)| weight * self.values[y as usize * self.width + x as usize])
            .sum()
    }
}

/// Returns the four pixels around a position and their bilinear weights.
pub(crate) fn corners(x: f32, y: f32) -> [([isize; 2], f32); 4] {
    let (left, top) = (x.floor(), y.floor());
    let (right, bottom) = (x - left, y - top);
    let (column, row) = (left as isize, top as isize);
    [
        ([column, row], (1.0 - right) * (1.0 - bottom)),
        ([column + 1, row], right * (1.0 - bottom)),
        ([column, row + 1], (1.0 - right) * bottom),
        ([column + 1, row + 1], right * bottom),
    ]
}

/// Returns the largest value in the square of `2 * radius + 1` pixels around every pixel of a map
/// with rows of `width`.
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

    fn scores(width: usize, values: &[f32]) -> Scores {
        Scores { width, height: values.len() / width, values: values.to_vec() }
    }

    const ALL: Wanted = Wanted { radius: 1, border: 0, min_score: 0.0, most: 100 };

    #[test]
    fn a_suppressed_score_suppresses_none() {
        // 5 suppresses 4, and so 3 is a maximum of the rest; 2 is beside it.
        let row = scores(4, &[0.5, 0.4, 0.3, 0.2]);
        assert_eq!(row.maxima(&ALL), [[0, 0], [2, 0]]);
        let limited = Wanted { most: 1, ..ALL };
        assert_eq!(row.maxima(&limited), [[0, 0]]);
        let high = Wanted { min_score: 0.3, ..ALL };
        assert_eq!(row.maxima(&high), [[0, 0]]);
    }
}
