//! Released maps: the records, which are all that an attacker sees.
//!
//! Records are `f32` columns relative to a published origin. Moving an original along its own record changes no stored byte.

mod records;

use sha2::{Digest, Sha256};

pub use records::{AxisCandidates, AxisPlanes, Lines, Obfuscation, Rays};

use crate::descriptors::Values;
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
            return Err(Error::new("slots per record", expected, slots_per_record));
        }
        if !origin.iter().all(|x| x.is_finite()) {
            return Err(Error::new("origin", "finite coordinates", format!("{origin:?}")));
        }
        let n_slots = obfuscation.len() * slots_per_record;
        let rows = descriptors.as_ref().map_or(n_slots, Descriptors::len);
        Error::check_len("descriptors", rows, n_slots, " rows, one per slot")?;
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

    /// Returns the first 16 bytes of the SHA-256 of all that an attacker has, in normal form and relative to its origin.
    fn hashed(&self) -> Fingerprint {
        let Self { obfuscation, slots_per_record, origin, unit, bounds, .. } = self;
        let rows = self.protected.as_ref().map(ProtectedDescriptors::rows);
        let descriptors = rows.or(self.descriptors.as_ref());
        let mut hasher = Sha256::new();
        hasher.update(format!(
            "unlift released 1, {D}D, {} {} of {}, {}\n",
            obfuscation.len(),
            obfuscation.family(),
            slots_per_record,
            unit.name()
        ));
        f64s(&mut hasher, origin);
        match obfuscation {
            Obfuscation::Lines(lines) => {
                f32s(&mut hasher, lines.foot().as_flattened());
                f32s(&mut hasher, lines.direction().as_flattened());
            }
            Obfuscation::Rays(rays) => {
                hasher.update([rays.centers().len() as u8]);
                f32s(&mut hasher, rays.centers().as_flattened());
                hasher.update(rays.center());
                f32s(&mut hasher, rays.direction().as_flattened());
                for region in rays.regions().into_iter().flatten() {
                    corners(&mut hasher, region);
                }
            }
            Obfuscation::AxisPlanes(planes) => {
                hasher.update(planes.axis());
                f32s(&mut hasher, planes.offset());
            }
            Obfuscation::AxisCandidates(candidates) => {
                f32s(&mut hasher, candidates.position().as_flattened());
            }
        }
        if let Some(bounds) = bounds {
            hasher.update("bounds");
            corners(&mut hasher, bounds);
        }
        // A file of a map without records has no descriptors.
        if let Some(descriptors) = descriptors.filter(|_| !obfuscation.is_empty()) {
            hasher.update(format!("descriptors of {}", descriptors.dim()));
            match descriptors.values() {
                Values::U8(values) => hasher.update(values),
                Values::F32(values) => f32s(&mut hasher, values),
            }
        }
        let hash = hasher.finalize();
        Fingerprint(std::array::from_fn(|at| hash[at]))
    }

    /// Releases protected descriptors in place of plain ones, one row per slot.
    ///
    /// # Errors
    /// When there is not one row per slot.
    pub fn with_protected(self, protected: ProtectedDescriptors) -> Result<Self, Error> {
        Error::check_len("descriptors", protected.len(), self.n_slots(), " rows, one per slot")?;
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
        if known { Self { fingerprint: bounded.hashed(), ..bounded } } else { bounded }
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

    /// Descriptors, one row per slot, in random order within a record; of protected ones, the [guess](ProtectedDescriptors::guess).
    pub fn descriptors(&self) -> Option<&Descriptors> {
        self.descriptors.as_ref().or_else(|| Some(self.protected.as_ref()?.guess()))
    }
}

fn corners<const D: usize>(hasher: &mut Sha256, bounds: &Bounds<D>) {
    f64s(hasher, &bounds.low);
    f64s(hasher, &bounds.high);
}

fn f32s(hasher: &mut Sha256, values: &[f32]) {
    // In pieces, because descriptors of a large map take hundreds of megabytes.
    for piece in values.chunks(1 << 10) {
        let bytes: Vec<u8> = piece.iter().flat_map(|x| x.to_le_bytes()).collect();
        hasher.update(&bytes);
    }
}

fn f64s(hasher: &mut Sha256, values: &[f64]) {
    values.iter().for_each(|x| hasher.update(x.to_le_bytes()));
}
