//! What differs between maps and images: one table, a reason per row.
//!
//! Nothing else in recovery asks how many dimensions there are, but geometry (volumes and directions).

/// What is set differently for the points of a map (3D) and the keypoints of an image (2D).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    /// Chunks of slots that are solved per delta, to choose it: of lines, rays and candidates. Fewer of an image, where
    /// they are most of the time and few of all.
    pub(crate) delta_chunks: usize,
    /// The same of planes: more, as their evidence hardly depends on delta, so that luck widens the plateau.
    pub(crate) delta_chunks_of_planes: usize,
    /// A delta is too wide if a random candidate agrees with a typical place with this probability: its agreement tells
    /// nothing. In an image both of a record's lines cross all of a small plane, so that at a delta as wide as
    /// neighbors are apart a random record agrees more often.
    pub(crate) too_wide_of_candidates: f32,
    /// Whether that limit holds for the fine ladder, too. In a map it may reach beyond.
    pub(crate) candidates_keep_to_limit: bool,
    /// Whether the share of all records that a list holds says which deltas are out of question. In an image
    /// coordinates are few and bounds known: other limits hold there.
    pub(crate) limits_by_share: bool,
    /// Whether a narrow delta keeps near the lower edge of the plateau. In an image lines cross everywhere: that edge is
    /// one of chance.
    pub(crate) keeps_near_edge: bool,
    /// The radius of the law of candidates is at most this many deltas. In an image records agree by chance at a
    /// delta as wide as neighbors are apart: delta is narrower.
    pub(crate) most_radius_of_candidates: f32,
    /// Whether what lies far out tells how many wrong entries are near all the same. The neighbors of a keypoint, in units
    /// of a small plane, reach as far out as these do.
    pub(crate) tells_background: bool,
    /// Partners of exchanged coordinates are looked for within this many deltas: in an image delta is narrow and values
    /// are few.
    pub(crate) exact_reach: f64,
    /// Exchanges at least this probable are believed. In an image a wrong partner is near all the same.
    pub(crate) least_exchange: f32,
    /// How often joint recovery of candidates goes on from exact coordinates. In an image they place their neighbors
    /// better, whose partners are then found. In a map they hardly do (0.2 points), and it costs half as much time again.
    pub(crate) feeds: usize,
    /// Whether confidence is known: its constants come from maps, and nobody has compared them with what comes true in
    /// images.
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
    tells_background: true,
    exact_reach: 1.0,
    least_exchange: 0.2,
    feeds: 0,
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
    tells_background: false,
    exact_reach: 4.0,
    least_exchange: 0.05,
    feeds: 2,
    confidence: false,
};

impl Settings {
    /// The settings of maps, or of images in two dimensions.
    pub(crate) const fn of_dimension<const D: usize>() -> Self {
        if D == 2 { OF_IMAGES } else { OF_MAPS }
    }
}
