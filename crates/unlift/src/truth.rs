//! Ground truth: originals and secrets, for the owner only. The attacker's crate, `unlift-attack`, does not depend on this one.

use crate::geometry::frame::Bounds;
use crate::{Error, Fingerprint, PointSet};

/// A row of the original points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[repr(transparent)]
pub struct OriginalId(pub u32);

unlift_attack::index! { OriginalId }

/// The true points of a map. Only [`reveal`](Self::reveal) returns them, and recovery takes no argument that contains them:
///
/// ```compile_fail
/// use unlift::{recover, truth::Original};
/// fn attack(original: &Original<3>, neighborhoods: &unlift::neighbors::Neighborhoods) {
///     let _ = recover::recover(original, neighborhoods, &recover::RecoverOptions::default());
/// }
/// ```
#[derive(Clone, Debug)]
pub struct Original<const D: usize> {
    points: PointSet<D>,
    bounds: Option<Bounds<D>>,
}

impl<const D: usize> Original<D> {
    /// Creates ground truth from `points`.
    pub fn new(points: PointSet<D>) -> Self {
        Self { points, bounds: None }
    }

    /// Creates ground truth from keypoints within the `bounds` of an image, which are not secret.
    ///
    /// # Errors
    /// When a point lies outside `bounds`.
    pub fn within(points: PointSet<D>, bounds: Bounds<D>) -> Result<Self, Error> {
        if let Some(row) = points.positions().iter().position(|point| !bounds.contains(point)) {
            let expected = format!("between {:?} and {:?}", bounds.low, bounds.high);
            let found = format!("{:?}", points.positions()[row]);
            return Err(Error::new(format!("point {row}"), expected, found));
        }
        Ok(Self { points, bounds: Some(bounds) })
    }

    /// Returns the public bounds of the points (of an image), if known.
    pub fn bounds(&self) -> Option<Bounds<D>> {
        self.bounds
    }

    /// Returns the points. Only obfuscation, oracle and evaluation call this.
    pub fn reveal(&self) -> &PointSet<D> {
        &self.points
    }

    /// Returns the number of points. It is not secret, because the released map reveals it.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Returns true if there are no points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}

unlift_attack::named! {
    /// Reason why a scheme left a point out of the released map.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum DropReason {
        /// One point remains in a pairing of an odd number.
        OddPoint = "odd_point",
        /// All possible partners lie at the same place, so no line is defined.
        CoincidentPair = "coincident_pair",
        /// Its line stayed within the local surface in all re-pairings (`ppl+`).
        RejectedPair = "rejected_pair",
        /// It lies on the center of a ray cloud or the anchor of an image, so its ray has no direction.
        OnCenter = "on_center",
        /// A mitigation kept only a part of the points.
        Thinned = "thinned",
        /// A custom scheme left it out.
        Other = "other",
    }
}

/// A point that is in no record, and the reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dropped {
    /// The point.
    pub original: OriginalId,
    /// Reason why it was left out.
    pub reason: DropReason,
}

/// The secret of one obfuscation: the original in each slot and the choices for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Secret {
    hidden: Vec<OriginalId>,
    swapped_axis: Option<Vec<u8>>,
    descriptor_row: Vec<u32>,
    dropped: Vec<Dropped>,
    n_originals: usize,
    slots_per_record: usize,
    map: Option<Fingerprint>,
}

impl Secret {
    /// Creates a secret from columns over slots: `hidden` (the original in each slot),
    /// `swapped_axis` (`cp` only) and `descriptor_row` (the released descriptor row of each slot),
    /// the dropped points, and the numbers of originals and of slots per record.
    ///
    /// # Errors
    /// When columns differ in length, an original is neither in exactly one slot nor dropped
    /// exactly once, slots do not fill the records, or a record's descriptor rows belong to another record.
    pub fn try_new(
        hidden: Vec<OriginalId>,
        swapped_axis: Option<Vec<u8>>,
        descriptor_row: Vec<u32>,
        dropped: Vec<Dropped>,
        n_originals: usize,
        slots_per_record: usize,
    ) -> Result<Self, Error> {
        let n = hidden.len();
        Error::check_len("swapped axes", swapped_axis.as_ref().map_or(n, Vec::len), n, " rows")?;
        Error::check_len("descriptor rows", descriptor_row.len(), n, " rows")?;
        let not_once = |id: usize, found: &str| {
            Error::new(format!("original {id}"), "in one slot or dropped once", found)
        };
        let mut is_used = vec![false; n_originals];
        for id in hidden.iter().copied().chain(dropped.iter().map(|d| d.original)) {
            match is_used.get_mut(id.index()) {
                Some(is_used @ false) => *is_used = true,
                Some(_) => return Err(not_once(id.index(), "two entries")),
                None => {
                    let expected = format!("originals below {n_originals}");
                    return Err(Error::new("hidden originals", expected, id.0));
                }
            }
        }
        if let Some(missing) = is_used.iter().position(|is_used| !is_used) {
            return Err(not_once(missing, "neither"));
        }
        if slots_per_record == 0 || !n.is_multiple_of(slots_per_record) {
            let expected = format!("a number that divides {n} slots");
            return Err(Error::new("slots per record", expected, slots_per_record));
        }
        // A wrong or repeated row would join positions with unrelated points.
        for (record, rows) in descriptor_row.chunks(slots_per_record).enumerate() {
            let is_own = |row: u32| row as usize / slots_per_record == record;
            let wrong = |at: &usize| !is_own(rows[*at]) || rows[..*at].contains(&rows[*at]);
            if let Some(at) = (0..rows.len()).find(wrong) {
                let what = format!("descriptor row of slot {}", record * slots_per_record + at);
                let expected = format!("a row of record {record}, each once");
                return Err(Error::new(what, expected, rows[at]));
            }
        }
        Ok(Self {
            hidden,
            swapped_axis,
            descriptor_row,
            dropped,
            n_originals,
            slots_per_record,
            map: None,
        })
    }

    /// Sets the fingerprint of the released map.
    #[must_use]
    pub fn with_map(self, map: Option<Fingerprint>) -> Self {
        Self { map, ..self }
    }

    /// Returns the fingerprint of the released map; `None` if unknown.
    pub fn map(&self) -> Option<Fingerprint> {
        self.map
    }

    /// Returns the number of hidden points per record.
    pub fn slots_per_record(&self) -> usize {
        self.slots_per_record
    }

    /// Returns the number of slots.
    pub fn n_slots(&self) -> usize {
        self.hidden.len()
    }

    /// Returns the number of original points, including dropped ones.
    pub fn n_originals(&self) -> usize {
        self.n_originals
    }

    /// Returns the original in each slot.
    pub fn hidden(&self) -> &[OriginalId] {
        &self.hidden
    }

    /// Returns the axis of each slot whose coordinate was exchanged (`cp` only).
    pub fn swapped_axis(&self) -> Option<&[u8]> {
        self.swapped_axis.as_deref()
    }

    /// Returns the released descriptor row of each slot.
    pub fn descriptor_row(&self) -> &[u32] {
        &self.descriptor_row
    }

    /// Returns the secret with slots in the order of descriptor rows, as of lists from descriptors.
    #[must_use]
    pub fn by_descriptor_row(&self) -> Self {
        let mut by_row = self.clone();
        for (slot, &row) in self.descriptor_row.iter().enumerate() {
            let row = row as usize;
            by_row.hidden[row] = self.hidden[slot];
            if let (Some(to), Some(from)) = (&mut by_row.swapped_axis, &self.swapped_axis) {
                to[row] = from[slot];
            }
            by_row.descriptor_row[row] = row as u32;
        }
        by_row
    }

    /// Returns the secret with the points of records exchanged whose first slot `exchange` accepts.
    #[must_use]
    pub fn exchanged(&self, exchange: impl Fn(usize) -> bool) -> Self {
        let mut exchanged = self.clone();
        for first in (0..self.n_slots() / 2).map(|pair| 2 * pair).filter(|&slot| exchange(slot)) {
            exchanged.hidden.swap(first, first + 1);
            exchanged.descriptor_row.swap(first, first + 1);
        }
        exchanged
    }

    /// Returns the secret of the hidden points alone, in their order among all points, and these points.
    #[must_use]
    pub fn of_hidden(&self) -> (Self, Vec<OriginalId>) {
        let (mut kept, mut number) = (self.hidden.clone(), vec![0; self.n_originals]);
        kept.sort_unstable();
        kept.iter().enumerate().for_each(|(at, id)| number[id.index()] = at);
        let hidden = self.hidden.iter().map(|id| OriginalId::from_index(number[id.index()]));
        let (hidden, n_originals) = (hidden.collect(), kept.len());
        (Self { hidden, dropped: Vec::new(), n_originals, ..self.clone() }, kept)
    }

    /// Returns the points that are in no record.
    pub fn dropped(&self) -> &[Dropped] {
        &self.dropped
    }

    /// Returns the number of points that were left out for `reason`.
    pub(crate) fn n_dropped(&self, reason: DropReason) -> usize {
        self.dropped.iter().filter(|dropped| dropped.reason == reason).count()
    }
}
