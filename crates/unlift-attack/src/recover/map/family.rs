//! A released map prepared for solving, with one row per record.

use crate::neighbors::Neighborhoods;
use crate::recover::map::chance::{
    self, CandidateField, ChanceField, interquartile_range, line_extent, ray_extent, tube,
};
use crate::recover::map::lines::{LineRow, from_lines, from_rays};
use crate::recover::map::planes::SortedPlanes;
use crate::released::{AxisPlanes, Obfuscation, Released};

/// Records of one family in the form that solvers read.
#[derive(Debug)]
pub(crate) enum Family<'a, const D: usize> {
    /// Lines with one or two slots each, or rays, which have a group; `has_regions` if the centers of rays have regions.
    Lines {
        rows: Vec<LineRow<D>>,
        slots_per_record: usize,
        chance: Vec<ChanceField<D>>,
        has_regions: bool,
    },
    /// Axis planes, sorted by their offsets.
    Planes { planes: &'a AxisPlanes<D>, sorted: SortedPlanes },
    /// Axis candidates.
    Candidates { rows: &'a [[f32; D]], chance: CandidateField<D> },
}

impl<'a, const D: usize> Family<'a, D> {
    /// Prepares the records of `released`, and learns their chance from `lists`.
    pub(crate) fn new(released: &'a Released<D>, lists: &Neighborhoods) -> Self {
        let slots_per_record = released.slots_per_record();
        match released.obfuscation() {
            Obfuscation::Lines(_) | Obfuscation::Rays(_) => {
                let rows = line_rows(released);
                let chance = chance::of_lines(&rows, lists, slots_per_record);
                let has_regions = matches!(released.obfuscation(), Obfuscation::Rays(rays) if rays.regions().is_some());
                Self::Lines { rows, slots_per_record, chance, has_regions }
            }
            Obfuscation::AxisPlanes(planes) => {
                Self::Planes { planes, sorted: SortedPlanes::new(planes) }
            }
            Obfuscation::AxisCandidates(candidates) => {
                let rows = candidates.position();
                Self::Candidates { rows, chance: chance::of_candidates(rows, lists) }
            }
        }
    }

    pub(crate) fn slots_per_record(&self) -> usize {
        match self {
            Self::Lines { slots_per_record, .. } => *slots_per_record,
            Self::Planes { .. } | Self::Candidates { .. } => 1,
        }
    }

    pub(crate) fn is_of_rays(&self) -> bool {
        match self {
            Self::Lines { rows, .. } => rows.first().is_some_and(LineRow::is_ray),
            Self::Planes { .. } | Self::Candidates { .. } => false,
        }
    }

    /// Whether these are rays whose centers have regions. Such rays of one center meet only there, and rays of two centers do not meet.
    pub(crate) fn has_regions(&self) -> bool {
        match self {
            Self::Lines { has_regions, .. } => *has_regions,
            Self::Planes { .. } | Self::Candidates { .. } => false,
        }
    }

    /// For axis candidates in a flat map, returns the radius about a place that holds the fraction `share` of the points.
    pub(crate) fn radius_if_flat(&self, share: f64) -> Option<f64> {
        match self {
            Self::Candidates { chance, .. } => chance.radius_if_flat(share),
            Self::Lines { .. } | Self::Planes { .. } => None,
        }
    }

    /// Returns the chance that a random record passes within `delta` of a typical place.
    pub(crate) fn typical_chance(&self, delta: f32) -> f32 {
        match self {
            Self::Lines { chance, .. } => {
                chance.iter().map(ChanceField::typical).fold(0.0, f32::max) * tube(D, delta)
            }
            Self::Planes { sorted, .. } => sorted.typical_chance(delta),
            Self::Candidates { chance, .. } => chance.typical_chance(delta),
        }
    }

    /// Returns a length of the order of the map's size, from the records alone; 0 for an empty map.
    ///
    /// Lines: their median distance from their middle. Rays: the largest distance between centers. Planes and candidates: the largest
    /// interquartile range over the axes.
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

/// Returns lines and rays as rows, cut at the bounds where these are known; no rows for other families.
fn line_rows<const D: usize>(released: &Released<D>) -> Vec<LineRow<D>> {
    let bounds = released.bounds().map(|bounds| bounds.about(&released.origin()));
    match released.obfuscation() {
        Obfuscation::Lines(records) => from_lines(records, bounds.as_ref()),
        Obfuscation::Rays(records) => from_rays(records, bounds.as_ref()),
        Obfuscation::AxisPlanes(_) | Obfuscation::AxisCandidates(_) => Vec::new(),
    }
}

/// Constants that differ between maps (3D) and images (2D). No other code of recovery depends on the dimension, except geometry
/// (volumes and directions).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    /// Chunks of slots that are solved per delta to choose it. Fewer in images, where this takes most of the time.
    pub(crate) delta_chunks: usize,
    /// Such chunks for planes: more, because their evidence hardly depends on delta, so that noise widens the plateau.
    pub(crate) delta_chunks_of_planes: usize,
    /// A delta is too wide if a random candidate passes a typical place with this probability. In an image, both lines of a record cross
    /// the whole plane, so random records agree more often.
    pub(crate) too_wide_of_candidates: f32,
    /// Whether that limit also holds for the fine ladder.
    pub(crate) candidates_keep_to_limit: bool,
    /// Whether the fraction of all records in one list limits delta. In images, the known bounds limit it.
    pub(crate) limits_by_share: bool,
    /// Whether a narrow delta stays near the lower edge of the plateau. In an image, lines cross everywhere, so that this edge is
    /// noise.
    pub(crate) keeps_near_edge: bool,
    /// Largest radius of the distribution of neighbors of candidates, in deltas. Delta is narrower in images.
    pub(crate) most_radius_of_candidates: f32,
    /// Whether edges in the outer bins measure the background. In images, true neighbors reach those bins.
    pub(crate) measures_background: bool,
    /// Distance within which partners of exchanged coordinates are searched, in deltas. In images, delta is narrow and values are
    /// few.
    pub(crate) exact_reach: f64,
    /// Least probability of accepted exchanges. In an image, even a wrong partner is close.
    pub(crate) least_exchange: f32,
    /// How often joint recovery of candidates runs again from exact coordinates. This improves images. On maps it gains
    /// 0.2 points and takes half as long again.
    pub(crate) joint_reruns: usize,
    /// Whether confidence is computed. Its probabilities were never tested on images.
    pub(crate) confidence: bool,
}

/// Settings of maps, chosen on RedKitchen and Castle.
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

/// Settings of images, chosen on six photos of RedKitchen.
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
    /// Returns the settings of images for `D == 2`, else those of maps.
    pub(crate) const fn of_dimension<const D: usize>() -> Self {
        if D == 2 { OF_IMAGES } else { OF_MAPS }
    }
}
