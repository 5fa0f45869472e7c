//! The owner's side: originals in, released records and a secret out. One scheme per file.
//!
//! A scheme only states its rule ([`Scheme::lift`]), here or in a crate of somebody else; what every scheme needs to be free of truth
//! (the origin, the normal form, the order of records, slots and descriptors) happens here, once.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

mod pairs;

pub mod cp;
pub mod cp2d;
pub mod dcl2d;
pub mod lines2d;
pub mod olc;
pub mod plane;
pub mod ppl;
pub mod ppl_plus;
pub mod ray;
pub mod ray_voxel;

use crate::geometry::frame::{Bounds, rounded_origin};
use crate::geometry::vector::sub;
use crate::released::{Obfuscation, Released};
use crate::seed::{Key, Stage};
use crate::truth::{Dropped, Original, Secret};
use crate::{Descriptors, Error, OriginalId, Unit};

/// All schemes, in the order of the paper's tables. A file that is missing here fails
/// `tests/architecture.rs`.
pub const SCHEMES: &[Entry] = &[
    olc::ENTRY,
    ppl::ENTRY,
    ppl_plus::ENTRY,
    ray::ENTRY,
    ray_voxel::ENTRY,
    plane::ENTRY,
    cp::ENTRY,
    lines2d::ENTRY,
    cp2d::ENTRY,
    dcl2d::ENTRY,
];

/// The scheme users call `name`.
///
/// # Errors
/// When there is none; the message lists all.
pub fn scheme(name: &str) -> Result<&'static Entry, Error> {
    SCHEMES.iter().find(|entry| entry.name == name).ok_or_else(|| {
        let names: Vec<&str> = SCHEMES.iter().map(|entry| entry.name).collect();
        Error::new("scheme", format!("one of {}", names.join(", ")), name)
    })
}

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

/// Hides `original` by `scheme`: what is released, and the secret beside it. `descriptors` has one
/// row per original. All chance comes from `key`: [`Key::fresh`] for a map that is released.
///
/// # Errors
/// When rows disagree, or the scheme cannot hide these points.
pub fn obfuscate<const D: usize>(
    scheme: &dyn Scheme<D>,
    original: &Original<D>,
    descriptors: Option<&Descriptors>,
    key: &Key,
) -> Result<(Released<D>, Secret), Error> {
    let points = original.reveal();
    if let Some(descriptors) = descriptors
        && descriptors.len() != points.len()
    {
        let expected = format!("{} rows, one per point", points.len());
        return Err(Error::new("descriptors", expected, descriptors.len().to_string()));
    }
    // The middle of known bounds tells nothing about the points.
    let bounds = original.bounds();
    let origin = match &bounds {
        Some(bounds) => bounds.center(),
        None => rounded_origin(points.positions()),
    };
    let local: Vec<[f64; D]> = points.positions().iter().map(|p| sub(p, &origin)).collect();
    let lifted = scheme.lift(&local, bounds.map(|b| b.about(&origin)).as_ref(), key)?;

    let slots = lifted.slots_per_record;
    let n_records = lifted.obfuscation.len();
    let order = key.draws(Stage::Shuffle, 0).permutation(n_records);
    let (slot_key, row_key) = (key.stage(Stage::SlotOrder), key.stage(Stage::DescriptorOrder));
    let mut hidden = Vec::with_capacity(n_records * slots);
    let mut swapped_axis = lifted.swapped_axis.as_ref().map(|_| Vec::with_capacity(n_records));
    let mut descriptor_row = Vec::with_capacity(n_records * slots);
    for (record, &from) in order.iter().enumerate() {
        let mut slot_order: Vec<usize> = (0..slots).collect();
        let mut rows: Vec<u32> = (0..slots).map(|s| (record * slots + s) as u32).collect();
        if slots > 1 {
            slot_key.draws(record as u64).shuffle(&mut slot_order);
            row_key.draws(record as u64).shuffle(&mut rows);
        }
        for slot in slot_order {
            hidden.push(lifted.hidden[from as usize * slots + slot]);
        }
        descriptor_row.extend(rows);
        if let (Some(kept), Some(axes)) = (&mut swapped_axis, &lifted.swapped_axis) {
            kept.push(axes[from as usize]);
        }
    }
    let released_descriptors = descriptors.map(|descriptors| {
        // Released row r holds the descriptor of the original whose slot was given row r.
        let mut source = vec![0; hidden.len()];
        for (slot, &row) in descriptor_row.iter().enumerate() {
            source[row as usize] = hidden[slot].0;
        }
        descriptors.select(&source)
    });
    let released = Released::try_new(
        lifted.obfuscation.select(&order),
        slots,
        origin,
        points.unit(),
        released_descriptors,
    )?
    .with_bounds(bounds);
    let secret =
        Secret::try_new(hidden, swapped_axis, descriptor_row, lifted.dropped, points.len())?;
    let secret = secret.of_map(Some(released.fingerprint()), slots)?;
    Ok((released, secret))
}
