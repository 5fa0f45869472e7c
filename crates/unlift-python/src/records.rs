//! Records that a user's scheme returns.

use std::any::Any;

use pyo3::prelude::*;
use unlift::obfuscate::Lifted;
use unlift::released::{AxisCandidates, AxisPlanes, Lines, Obfuscation, Rays};
use unlift::truth::{DropReason, Dropped};
use unlift::{Error, OriginalId};

use crate::arrays::{column, is_of_pairs, raised, rows, shape_text, whole, wrong};
use crate::hidden::{Either, of_either};

/// Records, and the points that they hide; `None` means one point each, in order.
#[derive(Clone)]
pub struct Hiding<const D: usize> {
    obfuscation: Obfuscation<D>,
    slots_per_record: usize,
    hidden: Option<Vec<u32>>,
    swapped_axis: Option<Vec<u8>>,
}

impl<const D: usize> Hiding<D> {
    /// Combines records with the points in `hidden`, an array `(n,)`, or `(n, 2)` for lines that hide two points each.
    fn of(obfuscation: Obfuscation<D>, hidden: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let n = obfuscation.len();
        let (mut slots_per_record, mut rows) = (1, None);
        if let Some(hidden) = hidden {
            let (of, shape) = whole("hidden", hidden, &[1, 2], 0..=i64::from(u32::MAX) - 1)?;
            slots_per_record = shape.get(1).copied().unwrap_or(1);
            let max_points = if matches!(obfuscation, Obfuscation::Lines(_)) { 2 } else { 1 };
            if shape[0] != n || !(1..=max_points).contains(&slots_per_record) {
                let expected = format!("one row per record ({n}), of at most {max_points} points");
                return Err(wrong("hidden", expected, shape_text(&shape)));
            }
            rows = Some(of);
        }
        Ok(Self { obfuscation, slots_per_record, hidden: rows, swapped_axis: None })
    }

    /// Converts to records of `n` points. Points that `hidden` does not name are dropped.
    pub fn lifted(self, n: usize, name: &str) -> Result<Lifted<D>, Error> {
        let Self { obfuscation, slots_per_record, hidden, swapped_axis } = self;
        let n_records = obfuscation.len();
        if hidden.is_none() && n_records != n {
            let expected = format!("{n} records, one per point, or `hidden`");
            return Err(Error::new(name, expected, n_records.to_string()));
        }
        let hidden = hidden.unwrap_or_else(|| (0..n_records as u32).collect());
        let mut is_hidden = vec![false; n];
        for &row in &hidden {
            let place = is_hidden.get_mut(row as usize).ok_or_else(|| {
                Error::new(name, format!("points from 0 to {}", n.saturating_sub(1)), row)
            })?;
            *place = true;
        }
        let reason = DropReason::Other;
        let left = (0..n).filter(|&row| !is_hidden[row]).map(OriginalId::from_index);
        Ok(Lifted {
            obfuscation,
            slots_per_record,
            hidden: hidden.into_iter().map(OriginalId).collect(),
            swapped_axis,
            dropped: left.map(|original| Dropped { original, reason }).collect(),
        })
    }
}

/// Records and the points that they hide, of an image or of a map.
#[pyclass(frozen, module = "unlift")]
pub struct Records(Either<Hiding<2>, Hiding<3>>);

#[pymethods]
impl Records {
    fn __len__(&self) -> usize {
        of_either!(&self.0, of => of.obfuscation.len())
    }

    fn __repr__(&self) -> String {
        let family = of_either!(&self.0, of => of.obfuscation.family());
        format!("<unlift.Records: {} {family}>", self.__len__())
    }
}

/// Makes records of an image if the rows of an array are pairs, else of a map.
macro_rules! records_by {
    ($rows:ident => $hiding:expr) => {
        Ok(Records(match is_of_pairs(stringify!($rows), $rows)? {
            true => Either::Image($hiding),
            false => Either::Map($hiding),
        }))
    };
}

/// Lines through `points` (n, 3) along `directions` (n, 3); for an image, both (n, 2). With
/// `hidden` (n, 2) each hides two points.
#[pyfunction(name = "Lines")]
#[pyo3(signature = (points, directions, *, hidden=None))]
pub fn lines(
    points: &Bound<'_, PyAny>,
    directions: &Bound<'_, PyAny>,
    hidden: Option<&Bound<'_, PyAny>>,
) -> PyResult<Records> {
    records_by!(points => {
        let lines = Lines::through(&rows("points", points)?, &rows("directions", directions)?);
        Hiding::of(Obfuscation::Lines(lines.map_err(raised)?), hidden)?
    })
}

/// Rays from `centers` (m, 3) along `directions` (n, 3), from the center to the point; `center`
/// (n,) is the index of each ray's center. For an image, centers (m, 2) and directions (n, 2).
#[pyfunction(name = "Rays")]
#[pyo3(signature = (centers, center, directions, *, hidden=None))]
pub fn rays(
    centers: &Bound<'_, PyAny>,
    center: &Bound<'_, PyAny>,
    directions: &Bound<'_, PyAny>,
    hidden: Option<&Bound<'_, PyAny>>,
) -> PyResult<Records> {
    records_by!(centers => {
        let centers = rows("centers", centers)?;
        let (center, _) = whole("center", center, &[1], 0..=centers.len().min(255) as i64 - 1)?;
        let rays = Rays::try_new(&centers, center, &rows("directions", directions)?);
        Hiding::of(Obfuscation::Rays(rays.map_err(raised)?), hidden)?
    })
}

/// Planes on which coordinate `axis` (n,), 0 to 2, equals `offset` (n,). Not for images.
#[pyfunction(name = "Planes")]
#[pyo3(signature = (axis, offset, *, hidden=None))]
pub fn planes(
    axis: &Bound<'_, PyAny>,
    offset: &Bound<'_, PyAny>,
    hidden: Option<&Bound<'_, PyAny>>,
) -> PyResult<Records> {
    let (axis, _) = whole("axis", axis, &[1], 0..=2)?;
    let planes = AxisPlanes::try_new(axis, &column("offset", offset)?).map_err(raised)?;
    Ok(Records(Either::Map(Hiding::of(Obfuscation::AxisPlanes(planes), hidden)?)))
}

/// Points `positions` (n, 3) with one coordinate, `swapped_axis` (n,), 0 to 2, of another point.
/// The axis is secret and not released. For an image, positions (n, 2), and axes 0 and 1.
#[pyfunction(name = "Candidates")]
#[pyo3(signature = (positions, swapped_axis, *, hidden=None))]
pub fn candidates(
    positions: &Bound<'_, PyAny>,
    swapped_axis: &Bound<'_, PyAny>,
    hidden: Option<&Bound<'_, PyAny>>,
) -> PyResult<Records> {
    let last_axis = if is_of_pairs("positions", positions)? { 1 } else { 2 };
    records_by!(positions => {
        let points = AxisCandidates::try_new(&rows("positions", positions)?).map_err(raised)?;
        let (axis, _) = whole("swapped_axis", swapped_axis, &[1], 0..=last_axis)?;
        if axis.len() != points.position().len() {
            let expected = format!("{} numbers, one per record", points.position().len());
            return Err(wrong("swapped_axis", expected, axis.len()));
        }
        let hiding = Hiding::of(Obfuscation::AxisCandidates(points), hidden)?;
        Hiding { swapped_axis: Some(axis), ..hiding }
    })
}

/// Converts the result of the function `name` to records of points `(n, D)`.
pub fn hiding<const D: usize>(returned: &Bound<'_, PyAny>, name: &str) -> PyResult<Hiding<D>> {
    let Ok(records) = returned.cast::<Records>() else {
        let expected = "Lines, Rays, Planes or Candidates";
        return Err(wrong(name, expected, returned.get_type()));
    };
    let mismatch = || wrong(name, format!("records of points (n, {D})"), format!("(n, {})", 5 - D));
    let records = of_either!(&records.get().0, hiding => hiding as &dyn Any);
    records.downcast_ref::<Hiding<D>>().cloned().ok_or_else(mismatch)
}
