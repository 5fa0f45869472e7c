//! A released map prepared for solving: one row per record, whatever its family.

use crate::Error;
use crate::neighbors::Neighborhoods;
use crate::recover::map::chance::{
    self, CandidateField, ChanceField, interquartile_range, line_extent, n_fields, ray_extent, tube,
};
use crate::recover::map::lines::{LineRow, from_lines, from_rays};
use crate::recover::map::planes::SortedPlanes;
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
    /// The records of `released`, with a `chance` that was learned before, or else with the one that goes with `lists`.
    /// Fails when the chance is that of other records.
    pub(crate) fn new(
        released: &'a Released<D>,
        lists: &Neighborhoods,
        chance: Option<Chance<D>>,
    ) -> Result<Self, Error> {
        let slots_per_record = released.slots_per_record();
        match (released.obfuscation(), chance) {
            (Obfuscation::Lines(_) | Obfuscation::Rays(_), None) => {
                let rows = line_rows(released);
                let chance = chance::of_lines(&rows, lists, slots_per_record);
                Ok(Self::Lines { rows, slots_per_record, chance })
            }
            (Obfuscation::Lines(_) | Obfuscation::Rays(_), Some(Chance::Lines(chance))) => {
                let rows = line_rows(released);
                let expected = n_fields(&rows);
                if chance.len() != expected {
                    let expected = format!("{expected} fields of chance");
                    return Err(Error::new("model", expected, chance.len().to_string()));
                }
                Ok(Self::Lines { rows, slots_per_record, chance })
            }
            (Obfuscation::AxisPlanes(planes), None | Some(Chance::Planes)) => {
                Ok(Self::Planes { planes, sorted: SortedPlanes::new(planes) })
            }
            (Obfuscation::AxisCandidates(candidates), None) => {
                let rows = candidates.position();
                Ok(Self::Candidates { rows, chance: chance::of_candidates(rows, lists) })
            }
            (Obfuscation::AxisCandidates(candidates), Some(Chance::Candidates(chance))) => {
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
            Self::Candidates { rows, .. } => {
                let range = |axis: usize| {
                    let mut column: Vec<f32> = rows.iter().map(|row| row[axis]).collect();
                    column.sort_unstable_by(f32::total_cmp);
                    interquartile_range(&column)
                };
                (0..D).map(range).fold(0.0, f64::max)
            }
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

/// What is set differently for the points of a map (3D) and the keypoints of an image (2D). Nothing else in recovery asks how
/// many dimensions there are, but geometry (volumes and directions).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    /// Chunks of slots that are solved per delta, to choose it. Fewer of an image, where they take most of the time.
    pub(crate) delta_chunks: usize,
    /// The same of planes: more, as their evidence hardly depends on delta, so that luck widens the plateau.
    pub(crate) delta_chunks_of_planes: usize,
    /// A delta is too wide if a random candidate agrees with a typical place with this probability. In an image both of a
    /// record's lines cross all of a small plane, so that random records agree more often.
    pub(crate) too_wide_of_candidates: f32,
    /// Whether that limit holds for the fine ladder, too. In a map it may reach beyond.
    pub(crate) candidates_keep_to_limit: bool,
    /// Whether the share of all records that a list holds limits delta. In an image bounds are known and limit it.
    pub(crate) limits_by_share: bool,
    /// Whether a narrow delta keeps near the lower edge of the plateau. In an image lines cross everywhere: that edge is
    /// one of chance.
    pub(crate) keeps_near_edge: bool,
    /// The radius of the distribution of neighbors of candidates is at most this many deltas: in an image delta is narrower.
    pub(crate) most_radius_of_candidates: f32,
    /// Whether what lies far out tells how many wrong entries are near all the same. In an image neighbors reach as far out.
    pub(crate) measures_background: bool,
    /// Partners of exchanged coordinates are looked for within this many deltas: in an image delta is narrow and values
    /// are few.
    pub(crate) exact_reach: f64,
    /// Exchanges at least this probable are believed. In an image a wrong partner is near all the same.
    pub(crate) least_exchange: f32,
    /// How often joint recovery of candidates goes on from exact coordinates. In an image their neighbors are then placed
    /// better. In a map they hardly are (0.2 points), and it costs half as much time again.
    pub(crate) joint_reruns: usize,
    /// Whether confidence is known: it was never compared with what comes true in images.
    pub(crate) confidence: bool,
}

/// Chosen on RedKitchen and Castle.
const OF_MAPS: Settings = Settings {
    delta_chunks: 12,
    delta_chunks_of_planes: 24,
    too_wide_of_candidates: 0.04,
    candidates_keep_to_limit: false,
    limits_by_share: true,
    keeps_near_edge: true,
    most_radius_of_candidates: 0.95,
    measures_background: true,
    exact_reach: 1.0,
    least_exchange: 0.2,
    joint_reruns: 0,
    confidence: true,
};

/// Chosen on six photos of RedKitchen.
const OF_IMAGES: Settings = Settings {
    delta_chunks: 4,
    delta_chunks_of_planes: 4,
    too_wide_of_candidates: 0.12,
    candidates_keep_to_limit: true,
    limits_by_share: false,
    keeps_near_edge: false,
    most_radius_of_candidates: 3.0,
    measures_background: false,
    exact_reach: 4.0,
    least_exchange: 0.05,
    joint_reruns: 2,
    confidence: false,
};

impl Settings {
    /// The settings of maps, or of images in two dimensions.
    pub(crate) const fn of_dimension<const D: usize>() -> Self {
        if D == 2 { OF_IMAGES } else { OF_MAPS }
    }
}
