//! Interface of schemes, and entries of the registry.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use super::changed::Change;
use crate::geometry::frame::Bounds;
use crate::released::Obfuscation;
use crate::seed::Key;
use crate::truth::Dropped;
use crate::{Error, OriginalId, Unit};

/// A built-in scheme, for maps or for images. It is an entry of the registry.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Name that users type.
    pub name: &'static str,
    /// Title in a few words.
    pub title: &'static str,
    /// Sentence on what is published in place of a point.
    pub rule: &'static str,
    /// Number of its color in charts, 0 to 7. Schemes with similar rules for maps and images share one.
    pub color: usize,
    /// Publication.
    pub source: &'static str,
    /// Part of a point that stays secret.
    pub hidden: &'static str,
    /// Patents that its authors state (not legal advice).
    pub patents: &'static str,
    /// Rule for hiding points.
    pub lift: Lift,
    /// Parameters of the rule by name, for reports.
    pub parameters: fn(&SchemeOptions) -> Vec<(&'static str, f64)>,
    /// Options of the rule.
    pub options: SchemeOptions,
}

/// The rule of a built-in scheme.
#[derive(Clone, Copy, Debug)]
pub enum Lift {
    /// Hides keypoints of images.
    In2d(LiftIn<2>),
    /// Hides points of maps.
    In3d(LiftIn<3>),
}

/// A [`Scheme::lift`] with options.
pub type LiftIn<const D: usize> =
    fn(&LocalPoints<'_, D>, &Key, &SchemeOptions) -> Result<Lifted<D>, Error>;

impl Entry {
    /// Returns a scheme without facts and parameters, with options for points in meters.
    pub(super) const fn new(name: &'static str, lift: Lift) -> Self {
        let [title, rule, source, hidden, patents] = [""; 5];
        let (parameters, options) = (|_: &_| Vec::new(), SchemeOptions { voxel: 0.5 });
        Self { name, title, rule, color: 0, source, hidden, patents, lift, parameters, options }
    }

    /// Returns the number of dimensions of the points that the scheme hides.
    pub fn dimensions(&self) -> usize {
        match self.lift {
            Lift::In2d(_) => 2,
            Lift::In3d(_) => 3,
        }
    }

    /// Returns the scheme for points of `D` dimensions, if it is defined there.
    pub fn of_dimension<const D: usize>(
        &self,
        options: &SchemeOptions,
    ) -> Option<Arc<dyn Scheme<D>>> {
        (self.dimensions() == D).then(|| Arc::new(Self { options: *options, ..*self }) as Arc<_>)
    }
}

impl<const D: usize> Scheme<D> for Entry {
    fn name(&self) -> &str {
        self.name
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        (self.parameters)(&self.options)
    }

    fn lift(&self, points: &LocalPoints<'_, D>, key: &Key) -> Result<Lifted<D>, Error> {
        // `Any` compares the types at run time, because a constant cannot choose between two types.
        let lift: &dyn Any = match &self.lift {
            Lift::In2d(lift) => lift,
            Lift::In3d(lift) => lift,
        };
        match lift.downcast_ref::<LiftIn<D>>() {
            Some(lift) => lift(points, key, &self.options),
            None => Err(Error::new("scheme", format!("one for {D} dimensions"), self.name)),
        }
    }
}

/// Parameters of the built-in schemes, in the unit of the points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SchemeOptions {
    /// Edge of a voxel of `ray-voxel`. The paper's authors use 0.5 m.
    pub voxel: f64,
}

impl SchemeOptions {
    /// Returns the default parameters for points in `unit`.
    pub fn usual(unit: Unit) -> Self {
        let voxel = match unit {
            Unit::Meter => 0.5,
            Unit::KthNeighbor => 5.0,
            // No scheme on keypoints has voxels.
            Unit::Pixel => 1.0,
        };
        Self { voxel }
    }
}

/// Points to hide, relative to the released origin.
#[derive(Clone, Copy, Debug)]
pub struct LocalPoints<'a, const D: usize> {
    /// Coordinates, `(n, D)`.
    pub positions: &'a [[f64; D]],
    /// Public bounds of an image.
    pub bounds: Option<Bounds<D>>,
}

/// A rule for hiding points, built-in or custom. Parameters are fields of the type.
pub trait Scheme<const D: usize>: Debug + Send + Sync {
    /// Returns the name in rows, gates and reports: one word, unique in a plan.
    fn name(&self) -> &str;

    /// Returns the parameters by name, for reports. Lengths are in the unit of the points.
    fn parameters(&self) -> Vec<(&'static str, f64)> {
        Vec::new()
    }

    /// Hides `points`.
    ///
    /// All randomness must come from `key` with [`Stage::Scheme`](crate::seed::Stage::Scheme), because these draws are
    /// released. Every original must be in exactly one slot, or dropped with a reason.
    ///
    /// # Errors
    /// When the rule cannot hide the points, or a parameter is out of range.
    fn lift(&self, points: &LocalPoints<'_, D>, key: &Key) -> Result<Lifted<D>, Error>;

    /// Returns the mitigations and the protection of descriptors that are part of the scheme, in order.
    fn changes(&self) -> Vec<&Change> {
        Vec::new()
    }
}

/// Result of a scheme, before shuffling.
#[derive(Clone, Debug)]
pub struct Lifted<const D: usize> {
    /// Records.
    pub obfuscation: Obfuscation<D>,
    /// Hidden points per record: 2 for paired lines, otherwise 1.
    pub slots_per_record: usize,
    /// Original of each slot, record by record.
    pub hidden: Vec<OriginalId>,
    /// Exchanged axis of each slot (`cp`).
    pub swapped_axis: Option<Vec<u8>>,
    /// Originals that are in no record.
    pub dropped: Vec<Dropped>,
}

impl<const D: usize> Lifted<D> {
    /// Creates the result of a scheme that gives every original its own record, in order.
    pub fn one_each(obfuscation: Obfuscation<D>) -> Self {
        let hidden = (0..obfuscation.len()).map(OriginalId::from_index).collect();
        let (swapped_axis, dropped) = (None, Vec::new());
        Self { obfuscation, slots_per_record: 1, hidden, swapped_axis, dropped }
    }
}
