//! Descriptors: one row per hidden point. Every geometric obfuscation releases them unchanged.

use std::ops::Range;

use crate::Error;

/// Largest number of columns, so that a sum of squares of bytes fits 32 bits.
const MOST_COLUMNS: usize = 1 << 16;

/// The values of a descriptor matrix, row-major.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Bytes, as COLMAP stores SIFT (RootSIFT times 512).
    U8(Vec<u8>),
    /// Floats, as for learned features.
    F32(Vec<f32>),
}

/// A matrix `(rows, dim)` of descriptors.
#[derive(Clone, Debug, PartialEq)]
pub struct Descriptors {
    values: Values,
    dim: usize,
}

impl Descriptors {
    /// Creates a matrix with `dim` columns.
    ///
    /// # Errors
    /// When `dim` is 0, above 65,536 or does not divide the number of values, a float is not finite, or the matrix has no information: it is
    /// all zero, or all rows are equal (some exporters write such dummies).
    pub fn try_new(values: Values, dim: usize) -> Result<Self, Error> {
        let (len, dummies) = match &values {
            Values::U8(v) => (v.len(), dummies(v, dim)),
            Values::F32(v) => (v.len(), dummies(v, dim)),
        };
        if dim == 0 || !len.is_multiple_of(dim) {
            let expected = format!("a multiple of the dimension {dim}");
            return Err(Error::new("descriptors", expected, format!("{len} values")));
        }
        if dim > MOST_COLUMNS {
            let expected = format!("at most {MOST_COLUMNS} values each");
            return Err(Error::new("descriptors", expected, dim));
        }
        if let Values::F32(v) = &values
            && let Some(at) = v.iter().position(|x| !x.is_finite())
        {
            let what = format!("descriptor {}, value {}", at / dim, at % dim);
            return Err(Error::new(what, "a finite value", v[at]));
        }
        match dummies {
            Some(found) => Err(Error::new("descriptors", "real descriptors", found)),
            None => Ok(Self { values, dim }),
        }
    }

    pub(crate) fn unchecked(values: Values, dim: usize) -> Self {
        Self { values, dim }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        match &self.values {
            Values::U8(v) => v.len() / self.dim,
            Values::F32(v) => v.len() / self.dim,
        }
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of columns.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// The range of row `at` in the values.
    #[inline]
    pub(crate) fn range(&self, at: usize) -> Range<usize> {
        at * self.dim..(at + 1) * self.dim
    }

    /// All values, row-major `(rows, dim)`.
    pub fn values(&self) -> &Values {
        &self.values
    }

    /// Returns the rows `order[0], order[1], ...` as a new matrix.
    ///
    /// # Panics
    /// When an index is out of range.
    pub fn select(&self, order: &[u32]) -> Self {
        let rows = order.iter().map(|&row| self.range(row as usize));
        let values = match &self.values {
            Values::U8(v) => Values::U8(rows.map(|row| &v[row]).collect::<Vec<_>>().concat()),
            Values::F32(v) => Values::F32(rows.map(|row| &v[row]).collect::<Vec<_>>().concat()),
        };
        Self { values, dim: self.dim }
    }

    /// Copies row `at` to `row`, which has one value per column.
    #[inline]
    pub fn read_row(&self, at: usize, row: &mut [f32]) {
        let at = self.range(at);
        match &self.values {
            Values::U8(v) => row.iter_mut().zip(&v[at]).for_each(|(x, &v)| *x = f32::from(v)),
            Values::F32(v) => row.copy_from_slice(&v[at]),
        }
    }

    /// Whether row `at` has only zeros, as exporters and `drop` mark a missing descriptor.
    pub fn is_zero(&self, at: usize) -> bool {
        match &self.values {
            Values::U8(v) => v[self.range(at)].iter().all(|&x| x == 0),
            Values::F32(v) => v[self.range(at)].iter().all(|&x| x == 0.0),
        }
    }

    pub(crate) fn row(&self, at: usize) -> Vec<f32> {
        let mut row = vec![0.0; self.dim];
        self.read_row(at, &mut row);
        row
    }

    /// Returns all rows as floats.
    pub fn rows(&self) -> impl Iterator<Item = Vec<f32>> {
        (0..self.len()).map(|at| self.row(at))
    }

    /// Returns the squared Euclidean distance between rows `a` and `b`.
    #[inline]
    pub fn squared_distance(&self, a: usize, b: usize) -> f32 {
        let (a, b) = (self.range(a), self.range(b));
        match &self.values {
            Values::U8(v) => {
                // Fits 32 bits, see MOST_COLUMNS.
                let square = |(&x, &y): (&u8, &u8)| u32::from(x.abs_diff(y)).pow(2);
                v[a].iter().zip(&v[b]).map(square).sum::<u32>() as f32
            }
            Values::F32(v) => v[a].iter().zip(&v[b]).map(|(x, y)| (x - y) * (x - y)).sum(),
        }
    }
}

/// Returns what is wrong with values that some exporters write in place of descriptors.
fn dummies<T: Default + PartialEq>(values: &[T], dim: usize) -> Option<&'static str> {
    if !values.is_empty() && values.iter().all(|x| *x == T::default()) {
        return Some("only zeros (dummies)");
    }
    let (first, others) = values.split_at(dim.min(values.len()));
    let is_constant = !others.is_empty() && others.chunks(dim.max(1)).all(|row| row == first);
    is_constant.then_some("the same row for every point (dummies)")
}
