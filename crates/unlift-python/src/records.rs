//! Records of one's own scheme: what a function returns that hides points.

use pyo3::PyClass;
use pyo3::prelude::*;
use unlift::obfuscate::Lifted;
use unlift::released::{
    AxisCandidates, AxisPlanes, Lines as LineRecords, Obfuscation, Rays as RayRecords,
};
use unlift::truth::{DropReason, Dropped};
use unlift::{Error, OriginalId};

use crate::arrays::{column, indices, rows, told};
use crate::errors::{raised, wrong};

/// Records, and which points they hide; `None` is one each, in order.
#[derive(Clone)]
pub struct Hiding {
    obfuscation: Obfuscation<3>,
    slots_per_record: usize,
    hidden: Option<Vec<u32>>,
    swapped_axis: Option<Vec<u8>>,
}

impl Hiding {
    /// With the points in `hidden`, an array `(n,)`, or `(n, 2)` of lines that hide two points each.
    fn of(obfuscation: Obfuscation<3>, hidden: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let n = obfuscation.len();
        let (mut slots_per_record, mut rows) = (1, None);
        if let Some(hidden) = hidden {
            let (of, shape) = indices("hidden", hidden, &[1, 2], u32::MAX)?;
            slots_per_record = shape.get(1).copied().unwrap_or(1);
            let most = if matches!(obfuscation, Obfuscation::Lines(_)) { 2 } else { 1 };
            if shape[0] != n || !(1..=most).contains(&slots_per_record) {
                let expected = format!("one row per record ({n}), of at most {most} points");
                return Err(wrong("hidden", expected, told(&shape)));
            }
            rows = Some(of);
        }
        Ok(Self { obfuscation, slots_per_record, hidden: rows, swapped_axis: None })
    }

    /// The same about `n` points: those in no record are dropped.
    pub fn lifted(self, n: usize, name: &str) -> Result<Lifted<3>, Error> {
        let Some(hidden) = self.hidden else {
            let found = self.obfuscation.len();
            if found != n {
                let expected = format!("{n} records, one per point, or `hidden`");
                return Err(Error::new(name, expected, found.to_string()));
            }
            let lifted = Lifted::one_each(self.obfuscation);
            return Ok(Lifted { swapped_axis: self.swapped_axis, ..lifted });
        };
        let mut seen = vec![false; n];
        for &row in &hidden {
            match seen.get_mut(row as usize) {
                Some(seen) if !*seen => *seen = true,
                Some(_) => {
                    let found = format!("point {row} twice");
                    return Err(Error::new(name, "every point in one record", found));
                }
                None => {
                    let expected = format!("points from 0 to {}", n.saturating_sub(1));
                    return Err(Error::new(name, expected, row.to_string()));
                }
            }
        }
        let left = (0..n).filter(|&row| !seen[row]);
        let dropped = left.map(|row| Dropped {
            original: OriginalId::from_index(row),
            reason: DropReason::Other,
        });
        Ok(Lifted {
            obfuscation: self.obfuscation,
            slots_per_record: self.slots_per_record,
            hidden: hidden.iter().map(|&row| OriginalId::from_index(row as usize)).collect(),
            swapped_axis: self.swapped_axis,
            dropped: dropped.collect(),
        })
    }
}

/// Records that hide points, and which ones: what Lines, Rays, Planes and Candidates have in common.
#[pyclass(frozen, subclass, module = "unlift")]
pub struct Records(Hiding);

#[pymethods]
impl Records {
    fn __len__(&self) -> usize {
        self.0.obfuscation.len()
    }

    fn __repr__(&self) -> String {
        let (n, family) = (self.0.obfuscation.len(), self.0.obfuscation.family());
        format!("<unlift.Records: {n} {family}>")
    }
}

/// A class of records.
fn of<T: PyClass<BaseType = Records>>(hiding: Hiding, class: T) -> PyClassInitializer<T> {
    PyClassInitializer::from(Records(hiding)).add_subclass(class)
}

/// Lines through `points` (n, 3) along `directions` (n, 3). With `hidden` (n, 2) each hides two points.
#[pyclass(frozen, extends = Records, module = "unlift")]
pub struct Lines;

#[pymethods]
impl Lines {
    #[new]
    #[pyo3(signature = (points, directions, *, hidden=None))]
    fn new(
        points: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        hidden: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let (points, directions) = (rows("points", points)?, rows("directions", directions)?);
        let lines = LineRecords::through(&points, &directions).map_err(raised)?;
        Ok(of(Hiding::of(Obfuscation::Lines(lines), hidden)?, Self))
    }
}

/// Half-lines from `centers` (m, 3), of which `center` (n,) says which, along `directions` (n, 3), from the center to the point.
#[pyclass(frozen, extends = Records, module = "unlift")]
pub struct Rays;

#[pymethods]
impl Rays {
    #[new]
    #[pyo3(signature = (centers, center, directions, *, hidden=None))]
    fn new(
        centers: &Bound<'_, PyAny>,
        center: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        hidden: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let centers = rows("centers", centers)?;
        let (center, _) = indices("center", center, &[1], centers.len().min(255) as u32)?;
        let center = center.iter().map(|&at| at as u8).collect();
        let rays = RayRecords::try_new(&centers, center, &rows("directions", directions)?);
        Ok(of(Hiding::of(Obfuscation::Rays(rays.map_err(raised)?), hidden)?, Self))
    }
}

/// Planes of which coordinate `axis` (n,), 0 to 2, is `offset` (n,).
#[pyclass(frozen, extends = Records, module = "unlift")]
pub struct Planes;

#[pymethods]
impl Planes {
    #[new]
    #[pyo3(signature = (axis, offset, *, hidden=None))]
    fn new(
        axis: &Bound<'_, PyAny>,
        offset: &Bound<'_, PyAny>,
        hidden: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let (axis, _) = indices("axis", axis, &[1], 3)?;
        let axis = axis.iter().map(|&at| at as u8).collect();
        let planes = AxisPlanes::try_new(axis, &column("offset", offset)?).map_err(raised)?;
        Ok(of(Hiding::of(Obfuscation::AxisPlanes(planes), hidden)?, Self))
    }
}

/// Points `positions` (n, 3) of which one coordinate, `swapped_axis` (n,), 0 to 2, is another point's: the secret, which is not
/// released.
#[pyclass(frozen, extends = Records, module = "unlift")]
pub struct Candidates;

#[pymethods]
impl Candidates {
    #[new]
    #[pyo3(signature = (positions, swapped_axis, *, hidden=None))]
    fn new(
        positions: &Bound<'_, PyAny>,
        swapped_axis: &Bound<'_, PyAny>,
        hidden: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let points = AxisCandidates::try_new(&rows("positions", positions)?).map_err(raised)?;
        let (axis, _) = indices("swapped_axis", swapped_axis, &[1], 3)?;
        if axis.len() != points.len() {
            let expected = format!("{} numbers, one per record", points.len());
            return Err(wrong("swapped_axis", expected, axis.len()));
        }
        let swapped_axis = Some(axis.iter().map(|&at| at as u8).collect());
        let hiding = Hiding::of(Obfuscation::AxisCandidates(points), hidden)?;
        Ok(of(Hiding { swapped_axis, ..hiding }, Self))
    }
}

/// What a function returned, as records.
pub fn hiding(returned: &Bound<'_, PyAny>) -> Option<Hiding> {
    returned.cast::<Records>().ok().map(|records| records.get().0.clone())
}
