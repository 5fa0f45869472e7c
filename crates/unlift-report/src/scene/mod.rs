//! What the page's 3D view shows: originals, obfuscations and recovered points.
//!
//! All positions are in the document's unit (meters, or usual distances to the K-th neighbor), about any origin near
//! the map: coordinates of 10^6 must be re-centered before they become `f32`.

mod encode;
mod geometry;

use crate::attack::Given;

pub(crate) use encode::{Encoded, encode};
pub use encode::{SCENE_BUDGET_BYTES, points_within_budget};
pub use geometry::{SceneBox, subsample};

/// The whole 3D view.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene3d {
    /// Originals `(n, 3)`, already thinned out, see [`subsample`] and [`points_within_budget`].
    pub originals: Vec<[f32; 3]>,
    /// Originals in the map, before thinning; stated on the page.
    pub n_points: u64,
    /// Centers of the cameras `(m, 3)`; may be empty.
    pub cameras: Vec<[f32; 3]>,
    /// The direction that is up; `None` is +z.
    pub up: Option<[f32; 3]>,
    /// What each scheme publishes, at most one per scheme.
    pub obfuscations: Vec<ObfuscationView>,
    /// What came back, at most one per row of the results.
    pub views: Vec<View>,
}

/// What came back under one scheme, from one kind of neighborhoods, by one solver: of a row of the results.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The neighborhoods, as in the row.
    pub given: Given,
    /// The solver's name.
    pub solver: String,
    /// Recovered positions `(n, 3)`, aligned with [`Scene3d::originals`]; NaN where the point is
    /// lost or was not released.
    pub recovered: Vec<[f32; 3]>,
}

/// What one scheme publishes, to be drawn. A sample is enough: lines soon fill a screen.
#[derive(Debug, Clone, PartialEq)]
pub struct ObfuscationView {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The records as drawn.
    pub shapes: Shapes,
    /// Records there are, drawn or not.
    pub n_records: u64,
    /// Places in [`Scene3d::originals`] of points that the scheme did not release.
    pub withheld: Vec<usize>,
}

/// Records as drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Shapes {
    /// Lines and rays clipped to the scene, see [`SceneBox::clip_line`] and [`SceneBox::clip_ray`].
    Segments(Vec<[[f32; 3]; 2]>),
    /// Planes as outlined rectangles, see [`SceneBox::axis_patch`].
    Patches(Vec<[[f32; 3]; 4]>),
    /// Points that are published as such (with a wrong coordinate, for `cp`).
    Points(Vec<[f32; 3]>),
}

impl Shapes {
    /// How many shapes there are.
    pub fn len(&self) -> usize {
        match self {
            Shapes::Segments(shapes) => shapes.len(),
            Shapes::Patches(shapes) => shapes.len(),
            Shapes::Points(shapes) => shapes.len(),
        }
    }

    /// Whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
