//! What a scheme is: the seam that anybody may implement, and a row of the registry of ours.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use crate::geometry::frame::Bounds;
use crate::released::Obfuscation;
use crate::seed::Key;
#[cfg(doc)]
use crate::seed::Stage;
use crate::truth::Dropped;
use crate::{Error, OriginalId, Unit};

/// A row of the registry: a scheme of ours, and how it is made.
#[derive(Debug)]
pub struct Entry {
    /// The name users know it by.
    pub name: &'static str,
    /// What is known about it.
    pub facts: Facts,
    /// The scheme on keypoints, if it is defined there.
    pub in_2d: Option<Build<2>>,
    /// The scheme on map points, if it is defined there.
    pub in_3d: Option<Build<3>>,
}

/// Makes a scheme with the parameters that it has.
pub type Build<const D: usize> = fn(&SchemeOptions) -> Arc<dyn Scheme<D>>;

impl Entry {
    /// The scheme on points of `D` dimensions, if it is defined there.
    pub fn of_dimension<const D: usize>(
        &self,
        options: &SchemeOptions,
    ) -> Option<Arc<dyn Scheme<D>>> {
        // A constant cannot choose between two types; `Any` asks whether they are the same.
        let of: &dyn Any = if D == 2 { &self.in_2d } else { &self.in_3d };
        let build = of.downcast_ref::<Option<Build<D>>>().copied().flatten();
        build.map(|build| build(options))
    }
}

/// What is known about a scheme; empty where nothing is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// The rule in one line.
    pub summary: &'static str,
    /// Where it was published.
    pub source: &'static str,
    /// What of a point stays secret.
    pub hidden: &'static str,
    /// Patents its authors state (facts, no legal advice).
    pub patents: &'static str,
}

/// Parameters of the schemes of the registry, in the unit of the points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SchemeOptions {
    /// Edge of a voxel of `ray-voxel`. The paper's authors use 0.5 m.
    pub voxel: f64,
}

impl SchemeOptions {
    /// The usual ones for points in `unit`.
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

/// A rule for hiding points. Anybody may write one: what is audited is `Arc<dyn Scheme<D>>`, and the registry
/// only lists ours. Parameters are fields of the type.
pub trait Scheme<const D: usize>: Debug + Send + Sync {
    /// The name in rows, gates and reports: one word, told apart from those of other schemes of a plan.
    fn name(&self) -> &str;

    /// What is known about it.
    fn facts(&self) -> Facts {
        Facts::default()
    }

    /// Its parameters, by name, for the record. Lengths are in the unit of the points.
    fn parameters(&self) -> Vec<(&'static str, f64)> {
        Vec::new()
    }

    /// Hides `points`, given about the released origin, as are the `bounds` in which all of them are
    /// publicly known to lie (an image's). All chance comes from `key`, by [`Stage::Scheme`]: what is drawn
    /// is released. Every original ends up in exactly one slot
    /// or among the dropped ones, with a reason; no record is empty.
    ///
    /// # Errors
    /// When the points cannot be hidden by this rule at all, or a parameter is out of range.
    fn lift(
        &self,
        points: &[[f64; D]],
        bounds: Option<&Bounds<D>>,
        key: &Key,
    ) -> Result<Lifted<D>, Error>;
}

/// What a scheme makes of the originals, before anything is shuffled.
#[derive(Clone, Debug)]
pub struct Lifted<const D: usize> {
    /// The records.
    pub obfuscation: Obfuscation<D>,
    /// Hidden points per record: 2 for paired lines, else 1.
    pub slots_per_record: usize,
    /// The original of each slot, record by record.
    pub hidden: Vec<OriginalId>,
    /// Per slot the exchanged axis (`cp`).
    pub swapped_axis: Option<Vec<u8>>,
    /// Originals in no record.
    pub dropped: Vec<Dropped>,
}

impl<const D: usize> Lifted<D> {
    /// Of a scheme that gives every original a record of its own, in order.
    pub fn one_each(obfuscation: Obfuscation<D>) -> Self {
        let hidden = (0..obfuscation.len()).map(OriginalId::from_index).collect();
        let (swapped_axis, dropped) = (None, Vec::new());
        Self { obfuscation, slots_per_record: 1, hidden, swapped_axis, dropped }
    }
}
