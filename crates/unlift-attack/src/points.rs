//! Sets of points with a unit, and the index of a record.

use crate::{Error, named};

named! {
    /// What one unit of a coordinate means.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Unit {
        /// Meters: the owner declared a scale.
        Meter = "m",
        /// Pixels of an image.
        Pixel = "px",
        /// The map's median distance to the K-th neighbor: the unit of maps without a declared scale.
        #[default]
        KthNeighbor = "kth_neighbor",
    }
}

/// Points of `D` dimensions (2 or 3), one row each, all finite, in one [`Unit`].
#[derive(Clone, Debug, PartialEq)]
pub struct PointSet<const D: usize> {
    positions: Vec<[f64; D]>,
    unit: Unit,
}

impl<const D: usize> PointSet<D> {
    const DIMENSION_IS_2_OR_3: () = assert!(D == 2 || D == 3);

    /// Creates the set from points `(n, D)` in `unit`.
    ///
    /// # Errors
    /// When a coordinate is not finite, or there are 2^31 points or more.
    pub fn try_new(positions: Vec<[f64; D]>, unit: Unit) -> Result<Self, Error> {
        let () = Self::DIMENSION_IS_2_OR_3;
        if positions.len() > i32::MAX as usize {
            return Err(Error::new("points", "fewer than 2^31", positions.len()));
        }
        if let Some(row) = positions.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            let found = format!("{:?}", positions[row]);
            return Err(Error::new(format!("point {row}"), "finite coordinates", found));
        }
        Ok(Self { positions, unit })
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Coordinates, `(n, D)`, in [`unit`](Self::unit).
    pub fn positions(&self) -> &[[f64; D]] {
        &self.positions
    }

    /// The unit of every coordinate.
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// Returns the points multiplied by `factor`, in `unit`.
    ///
    /// # Errors
    /// When a scaled coordinate is not finite.
    pub fn scaled(&self, factor: f64, unit: Unit) -> Result<Self, Error> {
        Self::try_new(self.positions.iter().map(|p| p.map(|x| x * factor)).collect(), unit)
    }
}

/// A row of the released map. It replaces one point, or two for paired lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[repr(transparent)]
pub struct RecordId(pub u32);

/// Converts an id of rows from and to an index.
#[doc(hidden)]
#[macro_export]
macro_rules! index {
    ($id:ident) => {
        impl $id {
            /// Returns the id as an array index.
            #[inline(always)]
            pub fn index(self) -> usize {
                self.0 as usize
            }

            /// Creates the id of row `index`.
            ///
            /// # Panics
            /// When `index` does not fit 32 bits; sizes are checked where points enter.
            #[inline(always)]
            pub fn from_index(index: usize) -> Self {
                Self(u32::try_from(index).expect("sizes are checked where points enter"))
            }
        }
    };
}

index! { RecordId }
