//! The attacker's side: records, and nothing else.
//!
//! One file per record family. Every family stores `f32` columns about a published origin in a
//! normal form, so that moving an original along its own record changes no stored byte.

mod axis_candidates;
mod axis_planes;
mod fingerprint;
mod lines;
mod rays;

pub use axis_candidates::AxisCandidates;
pub use axis_planes::AxisPlanes;
pub use lines::Lines;
pub use rays::Rays;

use crate::geometry::frame::Bounds;
use crate::{Descriptors, Error, Fingerprint, Unit};

/// The records of a map: what the set `O(x)` of Eq. (1) is for each hidden point.
#[derive(Clone, Debug, PartialEq)]
pub enum Obfuscation<const D: usize> {
    /// A line through the point, or through two points (`olc`, `ppl`, `ppl+`).
    Lines(Lines<D>),
    /// A half-line from one of a few published centers (`ray`, `ray-voxel`).
    Rays(Rays<D>),
    /// A plane perpendicular to an axis (`plane`).
    AxisPlanes(AxisPlanes<D>),
    /// One of the `D` axis-parallel lines through a published point (`cp`).
    AxisCandidates(AxisCandidates<D>),
}

impl<const D: usize> Obfuscation<D> {
    /// Number of records.
    pub fn len(&self) -> usize {
        match self {
            Self::Lines(lines) => lines.len(),
            Self::Rays(rays) => rays.len(),
            Self::AxisPlanes(planes) => planes.len(),
            Self::AxisCandidates(candidates) => candidates.len(),
        }
    }

    /// Whether there are no records.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The records `order[0], order[1], ...`.
    pub(crate) fn select(&self, order: &[u32]) -> Self {
        match self {
            Self::Lines(lines) => Self::Lines(lines.select(order)),
            Self::Rays(rays) => Self::Rays(rays.select(order)),
            Self::AxisPlanes(planes) => Self::AxisPlanes(planes.select(order)),
            Self::AxisCandidates(candidates) => Self::AxisCandidates(candidates.select(order)),
        }
    }

    /// The family's name in files.
    pub fn family(&self) -> &'static str {
        match self {
            Self::Lines(_) => "lines",
            Self::Rays(_) => "rays",
            Self::AxisPlanes(_) => "axis_planes",
            Self::AxisCandidates(_) => "axis_candidates",
        }
    }
}

/// A released map: all that an attacker sees.
#[derive(Clone, Debug, PartialEq)]
pub struct Released<const D: usize> {
    obfuscation: Obfuscation<D>,
    slots_per_record: usize,
    origin: [f64; D],
    unit: Unit,
    descriptors: Option<Descriptors>,
    bounds: Option<Bounds<D>>,
    fingerprint: Fingerprint,
}

impl<const D: usize> Released<D> {
    /// Records about `origin`, in `unit`; record `r` hides the points of slots
    /// `r * slots_per_record ..`, and descriptor rows are counted likewise (which of a paired line's
    /// two rows belongs to which of its slots is not known).
    ///
    /// # Errors
    /// When `slots_per_record` is not 1 (2 is allowed for lines), the origin is not finite, or the
    /// descriptors have another number of rows than there are slots.
    pub fn try_new(
        obfuscation: Obfuscation<D>,
        slots_per_record: usize,
        origin: [f64; D],
        unit: Unit,
        descriptors: Option<Descriptors>,
    ) -> Result<Self, Error> {
        let most = if matches!(obfuscation, Obfuscation::Lines(_)) { 2 } else { 1 };
        if slots_per_record == 0 || slots_per_record > most {
            let expected = format!("1 to {most} for {}", obfuscation.family());
            return Err(Error::new("slots per record", expected, slots_per_record.to_string()));
        }
        if !origin.iter().all(|x| x.is_finite()) {
            return Err(Error::new("origin", "finite coordinates", format!("{origin:?}")));
        }
        let n_slots = obfuscation.len() * slots_per_record;
        if let Some(descriptors) = &descriptors
            && descriptors.len() != n_slots
        {
            let expected = format!("{n_slots} rows, one per slot");
            return Err(Error::new("descriptors", expected, descriptors.len().to_string()));
        }
        let fingerprint = Fingerprint([0; 16]);
        let bare = Self {
            obfuscation,
            slots_per_record,
            origin,
            unit,
            descriptors,
            bounds: None,
            fingerprint,
        };
        Ok(Self { fingerprint: fingerprint::of(&bare), ..bare })
    }

    /// The same map, every hidden point of which is known to lie within `bounds` (in the map's frame):
    /// the size of an image is public.
    #[must_use]
    pub fn with_bounds(self, bounds: Option<Bounds<D>>) -> Self {
        let known = self.bounds.is_some() || bounds.is_some();
        let bounded = Self { bounds, ..self };
        match known {
            true => Self { fingerprint: fingerprint::of(&bounded), ..bounded },
            false => bounded,
        }
    }

    /// The box in which every hidden point is known to lie, in the map's frame; `None` where nothing is
    /// known.
    pub fn bounds(&self) -> Option<Bounds<D>> {
        self.bounds
    }

    /// What tells this map from others: a hash of all that is released. Lists and positions made from the map
    /// carry it.
    pub fn fingerprint(&self) -> Fingerprint {
        self.fingerprint
    }

    /// The records, about [`origin`](Self::origin).
    pub fn obfuscation(&self) -> &Obfuscation<D> {
        &self.obfuscation
    }

    /// How many hidden points each record has: 2 for paired lines, else 1.
    pub fn slots_per_record(&self) -> usize {
        self.slots_per_record
    }

    /// Number of records.
    pub fn n_records(&self) -> usize {
        self.obfuscation.len()
    }

    /// Number of hidden points.
    pub fn n_slots(&self) -> usize {
        self.n_records() * self.slots_per_record
    }

    /// The point of the map's frame that every record is stored about.
    pub fn origin(&self) -> [f64; D] {
        self.origin
    }

    /// The unit of every length.
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// One row per slot, in random order within a record.
    pub fn descriptors(&self) -> Option<&Descriptors> {
        self.descriptors.as_ref()
    }
}

/// The rows `order[0], order[1], ...` of one column.
fn rows<T: Copy>(column: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|&row| column[row as usize]).collect()
}

/// Stored directions closer to unit length than this (in squared length) stay as they are, so that
/// normalizing twice changes no bit. `f32` rounding of a unit vector stays below it.
const UNIT_SLACK: f64 = 6e-7;

/// Whether `v` may have been stored before. Only then may a normal form keep it: a length near 1 or
/// a point near its foot would otherwise show in the last bits.
fn is_f32<const D: usize>(v: &[f64; D]) -> bool {
    v.iter().all(|&x| f64::from(x as f32) == x)
}

/// The unit vector along `v`, as stored: left alone when it already is one up to `f32` rounding.
///
/// # Errors
/// When `v` is not finite or has no length.
fn unit_direction<const D: usize>(v: [f64; D], row: usize) -> Result<[f64; D], Error> {
    let norm2: f64 = v.iter().map(|x| x * x).sum();
    if !norm2.is_finite() || norm2 <= 0.0 {
        let what = format!("direction of record {row}");
        return Err(Error::new(what, "a finite vector with length", format!("{v:?}")));
    }
    if is_f32(&v) && (norm2 - 1.0).abs() <= UNIT_SLACK {
        return Ok(v);
    }
    let norm = norm2.sqrt();
    Ok(v.map(|x| x / norm))
}

/// `v` in `f32`, or an error that names the row.
fn finite_f32<const D: usize>(v: [f64; D], what: &str, row: usize) -> Result<[f32; D], Error> {
    let rounded = v.map(|x| x as f32);
    if rounded.iter().all(|x| x.is_finite()) {
        Ok(rounded)
    } else {
        let what = format!("{what} of record {row}");
        Err(Error::new(what, "coordinates in the range of f32", format!("{v:?}")))
    }
}
