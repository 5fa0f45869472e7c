//! The model of a map: what consensus learns before it solves any slot.

use crate::recover::map::bytes::Reader;
use crate::recover::map::chance::{CandidateField, ChanceField, tube};
use crate::recover::map::family::Chance;
use crate::recover::options::{Delta, RecoverOptions};
use crate::{About, Error, Fingerprint, ListsBy, RowOrder};

/// What consensus learns of a released map and all of its lists: delta, and the chance that a random listed record passes
/// near a place.
///
/// With the model, the same map and the lists of some slots, [`solve_part`](Self::solve_part) solves these slots. The model is small
/// for every map: one grid of at most 32,768 cells for lines, or one per center of rays or per axis of candidates.
#[derive(Clone, Debug)]
pub struct Model<const D: usize> {
    pub(super) options: RecoverOptions,
    pub(super) map: Fingerprint,
    /// The row order of the lists, and thus of the result.
    pub(super) about: About,
    pub(super) delta: f64,
    pub(super) chance: Chance<D>,
}

/// The first bytes of a stored model.
const MAGIC: [u8; 8] = *b"unliftM4";
/// Code of an unstated row order.
const UNSTATED: u8 = u8::MAX;
/// Largest number of centers of rays, whose index is one byte.
const MOST_FIELDS: usize = 256;

impl<const D: usize> Model<D> {
    /// Options that the model was made with.
    pub fn options(&self) -> &RecoverOptions {
        &self.options
    }

    /// The released map of the model.
    pub fn map(&self) -> Fingerprint {
        self.map
    }

    /// The distance up to which a record supports a position, in the unit of the map.
    pub fn delta(&self) -> f64 {
        self.delta
    }

    /// Chance that a random listed record passes within delta of `x` (relative to the released origin). For rays, the slot belongs to
    /// the center `group`; for other records `group` is ignored. `None` for planes, whose offsets are counted exactly.
    pub fn chance(&self, group: usize, x: &[f32; D]) -> Option<f32> {
        let delta = self.delta as f32;
        let tube = tube(D, delta);
        match &self.chance {
            Chance::Lines(fields) => {
                fields.get(group).or(fields.first()).map(|field| field.at(x, tube))
            }
            Chance::Planes => None,
            Chance::Candidates(field) => Some(field.at(x, &field.tubes(delta))),
        }
    }

    /// Encodes the model: a few hundred kilobytes at most, the same bytes on every machine.
    pub fn to_bytes(&self) -> Vec<u8> {
        let RecoverOptions { delta, seed, exact_constraints, .. } = self.options;
        let mut to = MAGIC.to_vec();
        to.extend([D as u8, u8::from(exact_constraints)]);
        to.extend(seed.to_le_bytes());
        // 0 stands for an automatic delta.
        let given = if let Delta::Fixed(delta) = delta { delta } else { 0.0 };
        to.extend(given.to_le_bytes());
        to.extend(self.map.0);
        let order = RowOrder::STATED.iter().position(|&order| order == self.about.order);
        let by_oracle = self.about.lists_by == ListsBy::Oracle;
        to.extend([order.map_or(UNSTATED, |at| at as u8), u8::from(by_oracle)]);
        to.extend(self.delta.to_le_bytes());
        match &self.chance {
            Chance::Lines(fields) => {
                to.push(1);
                to.extend((fields.len() as u64).to_le_bytes());
                fields.iter().for_each(|field| field.write(&mut to));
            }
            Chance::Planes => to.push(2),
            Chance::Candidates(field) => {
                to.push(3);
                field.write(&mut to);
            }
        }
        to
    }

    /// Decodes a model from the bytes of [`to_bytes`](Self::to_bytes).
    ///
    /// # Errors
    /// When `bytes` are not a model of this version and dimension.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let wrong = |expected: &str, found: String| Error::new("model", expected, found);
        let mut from = Reader(bytes);
        let magic: [u8; 8] = from.array()?;
        if magic != MAGIC {
            return Err(wrong("a model of this version", "other bytes".into()));
        }
        let [dimensions, exact_constraints] = from.array()?;
        if usize::from(dimensions) != D {
            return Err(wrong(&format!("a model in {D} dimensions"), dimensions.to_string()));
        }
        let seed = u64::from_le_bytes(from.array()?);
        let given = f64::from_le_bytes(from.array()?);
        let delta = if given == 0.0 { Delta::Auto } else { Delta::Fixed(given) };
        let exact_constraints = exact_constraints != 0;
        let options = RecoverOptions { delta, seed, exact_constraints, confidence: false };
        options.check().map_err(|error| error.within("model"))?;
        let map = Fingerprint(from.array()?);
        let [order, by_oracle] = from.array()?;
        let order = match order {
            UNSTATED => RowOrder::Unstated,
            at => *RowOrder::STATED
                .get(usize::from(at))
                .ok_or_else(|| wrong("an order of rows", at.to_string()))?,
        };
        let lists_by = if by_oracle == 0 { ListsBy::Unstated } else { ListsBy::Oracle };
        let about = About { map: Some(map), order, lists_by };
        let delta = f64::from_le_bytes(from.array()?);
        if !(delta >= 0.0 && (delta as f32).is_finite()) {
            return Err(wrong("a delta that is a length", delta.to_string()));
        }
        let [kind] = from.array()?;
        let chance = match kind {
            1 => {
                let n = from.count(MOST_FIELDS)?;
                let fields = (0..n).map(|_| ChanceField::read(&mut from));
                Chance::Lines(fields.collect::<Result<_, _>>()?)
            }
            2 => Chance::Planes,
            3 => Chance::Candidates(CandidateField::read(&mut from)?),
            other => return Err(wrong("a kind of chance from 1 to 3", other.to_string())),
        };
        match from.0.len() {
            0 => Ok(Self { options, map, about, delta, chance }),
            n => Err(wrong("its end", format!("{n} more bytes"))),
        }
    }
}
