//! Released maps: the records, which are all that an attacker sees.
//!
//! One file per record family. Every family stores `f32` columns relative to a published origin in a normal form, so that moving an
//! original along its own record changes no stored byte.

mod axis_candidates;
mod axis_planes;
mod fingerprint;
mod lines;
mod normal_form;
mod obfuscation;
mod rays;

pub use axis_candidates::AxisCandidates;
pub use axis_planes::AxisPlanes;
pub use lines::Lines;
pub use obfuscation::Obfuscation;
pub use rays::Rays;

use crate::geometry::frame::Bounds;
use crate::{Descriptors, Error, Fingerprint, ProtectedDescriptors, Unit};

/// A released map: all that an attacker sees.
#[derive(Clone, Debug, PartialEq)]
pub struct Released<const D: usize> {
    obfuscation: Obfuscation<D>,
    slots_per_record: usize,
    origin: [f64; D],
    unit: Unit,
    descriptors: Option<Descriptors>,
    protected: Option<ProtectedDescriptors>,
    bounds: Option<Bounds<D>>,
    fingerprint: Fingerprint,
}

impl<const D: usize> Released<D> {
    /// Creates a map from records relative to `origin`, in `unit`. Record `r` hides the points of slots `r * slots_per_record ..`.
    /// Descriptor rows are in the same order, but which of a paired line's two rows belongs to which slot is unknown.
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
            protected: None,
            bounds: None,
            fingerprint,
        };
        Ok(Self { fingerprint: bare.hashed(), ..bare })
    }

    fn hashed(&self) -> Fingerprint {
        let Self { obfuscation, slots_per_record, origin, unit, bounds, .. } = self;
        let frame = (*origin, *unit, *bounds);
        let rows = self.protected.as_ref().map(ProtectedDescriptors::rows);
        fingerprint::of(obfuscation, *slots_per_record, frame, rows.or(self.descriptors.as_ref()))
    }

    /// Releases protected descriptors in place of plain ones, one row per slot.
    ///
    /// # Errors
    /// When there is not one row per slot.
    pub fn with_protected(self, protected: ProtectedDescriptors) -> Result<Self, Error> {
        if protected.len() != self.n_slots() {
            let expected = format!("{} rows, one per slot", self.n_slots());
            return Err(Error::new("descriptors", expected, protected.len().to_string()));
        }
        let bare = Self { descriptors: None, protected: Some(protected), ..self };
        Ok(Self { fingerprint: bare.hashed(), ..bare })
    }

    /// Protected descriptors, one row per slot, if the map has them.
    pub fn protected(&self) -> Option<&ProtectedDescriptors> {
        self.protected.as_ref()
    }

    /// Sets the box that contains all hidden points, in the map's frame; for an image it is the image itself.
    #[must_use]
    pub fn with_bounds(self, bounds: Option<Bounds<D>>) -> Self {
        let known = self.bounds.is_some() || bounds.is_some();
        let bounded = Self { bounds, ..self };
        match known {
            true => Self { fingerprint: bounded.hashed(), ..bounded },
            false => bounded,
        }
    }

    /// The box that contains all hidden points, in the map's frame, if it is known.
    pub fn bounds(&self) -> Option<Bounds<D>> {
        self.bounds
    }

    /// The hash of everything released, which identifies the map. Lists and positions made from the map carry it.
    pub fn fingerprint(&self) -> Fingerprint {
        self.fingerprint
    }

    /// The records, relative to [`origin`](Self::origin).
    pub fn obfuscation(&self) -> &Obfuscation<D> {
        &self.obfuscation
    }

    /// Number of hidden points per record: 2 for paired lines, else 1.
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

    /// The point of the map's frame that is the origin of all records.
    pub fn origin(&self) -> [f64; D] {
        self.origin
    }

    /// Unit of every length.
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// Descriptors, one row per slot, in random order within a record. Of a map with protected ones, these are the attacker's
    /// [guess](ProtectedDescriptors::guess).
    pub fn descriptors(&self) -> Option<&Descriptors> {
        self.descriptors.as_ref().or_else(|| Some(self.protected.as_ref()?.guess()))
    }
}
