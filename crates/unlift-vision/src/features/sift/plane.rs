use crate::features::image::GrayImage;

/// Values per step of a vector loop.
pub(crate) const LANES: usize = 32;
/// Columns that may be read beyond a row, so that loops need no special case for its end.
const SLACK: usize = 16;

/// Rows of `f32`, each longer than the image is wide. Values beyond `width` are finite but
/// undefined.
#[derive(Default)]
pub(crate) struct Plane {
    pub(crate) width: usize,
    pub(crate) height: usize,
    stride: usize,
    values: Vec<f32>,
}

impl Plane {
    /// Resizes to `width` x `height` undefined values; keeps the memory.
    pub(crate) fn reshape(&mut self, width: usize, height: usize) {
        self.width = width;
        self.height = height;
        self.stride = (width + SLACK).next_multiple_of(LANES);
        self.values.resize(self.stride * height, 0.0);
    }

    #[inline(always)]
    pub(crate) fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.stride..(y + 1) * self.stride]
    }

    #[inline(always)]
    pub(crate) fn row_mut(&mut self, y: usize) -> &mut [f32] {
        &mut self.values[y * self.stride..(y + 1) * self.stride]
    }

    #[inline(always)]
    pub(crate) fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.stride + x]
    }

    /// Returns the length of a row with its slack, a multiple of [`LANES`].
    pub(crate) fn stride(&self) -> usize {
        self.stride
    }

    pub(crate) fn copy(&mut self, image: &GrayImage) {
        self.reshape(image.width(), image.height());
        for y in 0..self.height {
            let (row, slack) = self.row_mut(y).split_at_mut(image.width());
            row.copy_from_slice(image.row(y));
            slack.fill(0.0);
        }
    }

    /// Doubles an image by linear interpolation; the last pixel is repeated. Pixel `i` moves to
    /// `2 i`.
    pub(crate) fn double(&mut self, image: &GrayImage) {
        let (width, height) = (image.width(), image.height());
        self.reshape(2 * width, 2 * height);
        for y in 0..height {
            let (row, slack) = self.row_mut(2 * y).split_at_mut(2 * width);
            let from = image.row(y);
            for ((pair, &here), &next) in row.chunks_exact_mut(2).zip(from).zip(&from[1..]) {
                pair.copy_from_slice(&[here, 0.5 * (here + next)]);
            }
            row[2 * width - 2..].fill(from[width - 1]);
            slack.fill(0.0);
        }
        let stride = self.stride;
        for y in 0..height {
            let (above, rest) = self.values[2 * y * stride..].split_at_mut(stride);
            let (between, below) = rest.split_at_mut(stride);
            if y + 1 == height {
                between.copy_from_slice(above);
                continue;
            }
            for ((value, &a), &b) in between.iter_mut().zip(above.iter()).zip(below.iter()) {
                *value = 0.5 * (a + b);
            }
        }
    }

    /// Keeps every second value of every second row of `from`.
    pub(crate) fn halve(&mut self, from: &Self) {
        self.reshape(from.width / 2, from.height / 2);
        for y in 0..self.height {
            let row = self.row_mut(y);
            row.fill(0.0);
            for (value, pair) in row.iter_mut().zip(from.row(2 * y)[..from.width].chunks_exact(2)) {
                *value = pair[0];
            }
        }
    }
}

#[inline(always)]
pub(crate) fn lanes<const N: usize>(row: &[f32], at: usize) -> [f32; N] {
    let mut values = [0.0; N];
    values.copy_from_slice(&row[at..at + N]);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(plane: &Plane) -> Vec<Vec<f32>> {
        (0..plane.height).map(|y| plane.row(y)[..plane.width].to_vec()).collect()
    }

    #[test]
    fn doubling_interpolates_and_halving_undoes_it() {
        let image = GrayImage::try_new(3, 2, vec![0.0, 2.0, 4.0, 8.0, 8.0, 8.0]).unwrap();
        let mut plane = Plane::default();
        plane.double(&image);
        assert_eq!(
            rows(&plane),
            [[0.0, 1.0, 2.0, 3.0, 4.0, 4.0], [4.0, 4.5, 5.0, 5.5, 6.0, 6.0], [8.0; 6], [8.0; 6],]
        );
        let mut half = Plane::default();
        half.halve(&plane);
        assert_eq!(rows(&half), [[0.0, 2.0, 4.0], [8.0; 3]]);
        let mut quarter = Plane::default();
        quarter.halve(&half);
        assert_eq!(rows(&quarter), [[0.0]]);
    }
}
