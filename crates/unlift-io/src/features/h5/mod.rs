//! Reads and writes arrays by path in an HDF5 file.
//!
//! A library reads ([`FeatureStore`]). Our own code writes ([`Writer`]): the library's writer keeps
//! the whole file in memory, or rewrites a group's list of names at every addition, which is
//! quadratic in images.

#[cfg(test)]
mod hostile;
mod links;
mod messages;
mod read;
mod source;
mod tree;
mod write;

use half::f16;

pub(crate) use read::FeatureStore;
pub(crate) use write::Writer;

/// The maximum depth of groups, because links may form cycles.
pub(crate) const DEEPEST: usize = 64;

/// The values of an array, row-major.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Numbers {
    U8(Vec<u8>),
    F16(Vec<f16>),
    F32(Vec<f32>),
    F64(Vec<f64>),
    I64(Vec<i64>),
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Array {
    pub shape: Vec<u64>,
    pub values: Numbers,
}

impl Numbers {
    pub fn len(&self) -> usize {
        match self {
            Self::U8(v) => v.len(),
            Self::F16(v) => v.len(),
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
            Self::I64(v) => v.len(),
        }
    }

    fn bytes(&self) -> Vec<u8> {
        match self {
            Self::U8(v) => v.clone(),
            Self::F16(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Self::F32(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Self::F64(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Self::I64(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
        }
    }

    pub fn to_f64(&self) -> Vec<f64> {
        match self {
            Self::U8(v) => v.iter().map(|&x| f64::from(x)).collect(),
            Self::F16(v) => v.iter().map(|&x| f64::from(x)).collect(),
            Self::F32(v) => v.iter().map(|&x| f64::from(x)).collect(),
            Self::F64(v) => v.clone(),
            Self::I64(v) => v.iter().map(|&x| x as f64).collect(),
        }
    }
}

pub(crate) fn transposed<T: Copy>(values: &[T], rows: usize) -> Vec<T> {
    let columns = values.len().checked_div(rows).unwrap_or(0);
    let mut transposed = Vec::with_capacity(values.len());
    for column in 0..columns {
        transposed.extend((0..rows).map(|row| values[row * columns + column]));
    }
    transposed
}

/// Formats a shape like NumPy: `(128, 40)`.
pub(crate) fn shape_text(shape: &[u64]) -> String {
    match shape {
        [n] => format!("({n},)"),
        _ => {
            let sides: Vec<String> = shape.iter().map(u64::to_string).collect();
            format!("({})", sides.join(", "))
        }
    }
}
