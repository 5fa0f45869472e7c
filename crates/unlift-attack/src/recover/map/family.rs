//! A released map prepared for solving: one row per record, whatever its family.

use super::chance_field::{self, CandidateField, ChanceField, n_fields, tube};
use super::extent::{interquartile_range, line_extent, ray_extent};
use super::line_rows::{LineRow, from_lines, from_rays};
use super::plane_windows::SortedPlanes;
use crate::Error;
use crate::neighbors::Neighborhoods;
use crate::released::{AxisPlanes, Obfuscation, Released};

/// Records in the form the solvers read.
#[derive(Debug)]
pub(crate) enum Family<'a, const D: usize> {
    /// Lines, one or two slots each; rays, told apart by their group.
    Lines { rows: Vec<LineRow<D>>, slots_per_record: usize, chance: Vec<ChanceField<D>> },
    /// Axis planes, with the order of their offsets.
    Planes { planes: &'a AxisPlanes<D>, sorted: SortedPlanes },
    /// Axis candidates.
    Candidates { rows: &'a [[f32; D]], chance: CandidateField<D> },
}

/// How likely a random listed record agrees with a place: what is learned of a map before anything is solved.
#[derive(Clone, Debug)]
pub(crate) enum Chance<const D: usize> {
    /// Of lines one field, of rays one per center.
    Lines(Vec<ChanceField<D>>),
    /// Counted exactly from the planes themselves.
    Planes,
    /// A field per axis.
    Candidates(CandidateField<D>),
}

impl<'a, const D: usize> Family<'a, D> {
    /// The records of `released`, with the chance that goes with `lists`.
    pub(crate) fn learn(released: &'a Released<D>, lists: &Neighborhoods) -> Self {
        let slots_per_record = released.slots_per_record();
        match released.obfuscation() {
            Obfuscation::Lines(_) | Obfuscation::Rays(_) => {
                let rows = line_rows(released);
                let chance = chance_field::of_lines(&rows, lists, slots_per_record);
                Self::Lines { rows, slots_per_record, chance }
            }
            Obfuscation::AxisPlanes(planes) => {
                Self::Planes { planes, sorted: SortedPlanes::new(planes) }
            }
            Obfuscation::AxisCandidates(candidates) => {
                let rows = candidates.position();
                Self::Candidates { rows, chance: chance_field::of_candidates(rows, lists) }
            }
        }
    }

    /// The records of `released`, with a chance that was learned before.
    ///
    /// # Errors
    /// When it is that of other records.
    pub(crate) fn with_chance(released: &'a Released<D>, chance: Chance<D>) -> Result<Self, Error> {
        let slots_per_record = released.slots_per_record();
        match (released.obfuscation(), chance) {
            (Obfuscation::Lines(_) | Obfuscation::Rays(_), Chance::Lines(chance)) => {
                let rows = line_rows(released);
                let expected = n_fields(&rows);
                if chance.len() != expected {
                    let expected = format!("{expected} fields of chance");
                    return Err(Error::new("model", expected, chance.len().to_string()));
                }
                Ok(Self::Lines { rows, slots_per_record, chance })
            }
            (Obfuscation::AxisPlanes(planes), Chance::Planes) => {
                Ok(Self::Planes { planes, sorted: SortedPlanes::new(planes) })
            }
            (Obfuscation::AxisCandidates(candidates), Chance::Candidates(chance)) => {
                Ok(Self::Candidates { rows: candidates.position(), chance })
            }
            _ => Err(Error::new("model", "one of these records", "one of another family")),
        }
    }

    /// What was learned of the map.
    pub(crate) fn chance(&self) -> Chance<D> {
        match self {
            Self::Lines { chance, .. } => Chance::Lines(chance.clone()),
            Self::Planes { .. } => Chance::Planes,
            Self::Candidates { chance, .. } => Chance::Candidates(chance.clone()),
        }
    }

    /// Slots per record.
    pub(crate) fn slots_per_record(&self) -> usize {
        match self {
            Self::Lines { slots_per_record, .. } => *slots_per_record,
            Self::Planes { .. } | Self::Candidates { .. } => 1,
        }
    }

    /// Whether these are rays.
    pub(crate) fn is_of_rays(&self) -> bool {
        match self {
            Self::Lines { rows, .. } => rows.first().is_some_and(LineRow::is_ray),
            Self::Planes { .. } | Self::Candidates { .. } => false,
        }
    }

    /// Whether these are rays of which it is known where each center's points lie: one ray says nothing
    /// about another of its center, and rays of two centers do not meet.
    pub(crate) fn has_regions(&self) -> bool {
        match self {
            Self::Lines { rows, .. } => rows.iter().any(|row| row.is_ray() && row.to.is_finite()),
            Self::Planes { .. } | Self::Candidates { .. } => false,
        }
    }

    /// Of candidates in a flat map: the radius about a place within which a `share` of the points are.
    pub(crate) fn radius_if_flat(&self, share: f64) -> Option<f64> {
        match self {
            Self::Candidates { chance, .. } => chance.radius_if_flat(share),
            Self::Lines { .. } | Self::Planes { .. } => None,
        }
    }

    /// How likely a random record agrees with a place where records are, at `delta`.
    pub(crate) fn typical_chance(&self, delta: f32) -> f32 {
        match self {
            Self::Lines { chance, .. } => {
                chance.iter().map(ChanceField::typical).fold(0.0, f32::max) * tube(D, delta)
            }
            Self::Planes { sorted, .. } => sorted.typical_chance(delta),
            Self::Candidates { chance, .. } => chance.typical_chance(delta),
        }
    }

    /// A length of the order of the map's size, from the records alone; 0 for an empty map.
    ///
    /// Lines: their median distance from the place they pass nearest. Rays: the largest distance between
    /// centers. Planes and candidates: the largest interquartile range over the axes.
    pub(crate) fn extent(&self) -> f64 {
        match self {
            Self::Lines { rows, .. } => {
                let Some(first) = rows.first() else {
                    return 0.0;
                };
                if first.is_ray() { ray_extent(rows) } else { line_extent(rows) }
            }
            Self::Planes { sorted, .. } => sorted.extent(),
            Self::Candidates { rows, .. } => (0..D)
                .map(|axis| {
                    let mut column: Vec<f32> = rows.iter().map(|row| row[axis]).collect();
                    column.sort_unstable_by(f32::total_cmp);
                    interquartile_range(&column)
                })
                .fold(0.0, f64::max),
        }
    }
}

/// Lines and rays as rows, within the bounds where these are known; none of other families.
fn line_rows<const D: usize>(released: &Released<D>) -> Vec<LineRow<D>> {
    let bounds = released.bounds().map(|bounds| bounds.about(&released.origin()));
    match released.obfuscation() {
        Obfuscation::Lines(records) => from_lines(records, bounds.as_ref()),
        Obfuscation::Rays(records) => from_rays(records, bounds.as_ref()),
        Obfuscation::AxisPlanes(_) | Obfuscation::AxisCandidates(_) => Vec::new(),
    }
}
