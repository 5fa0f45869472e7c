//! The data of the page's 3D view: originals, obfuscations and recovered points.
//!
//! All positions are in the document's unit (meters, or usual distances to the K-th neighbor), relative to an origin
//! near the map: large coordinates (10^6) must be centered before they become `f32`.

mod encode;
mod geometry;

use crate::attack::Given;

pub(crate) use encode::{Encoded, encode};
pub use encode::{SCENE_BUDGET_BYTES, points_within_budget};
pub use geometry::{SceneBox, subsample};

/// The whole 3D view.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene3d {
    /// Originals `(n, 3)` after thinning, see [`subsample`] and [`points_within_budget`].
    pub originals: Vec<[f32; 3]>,
    /// Number of originals before thinning.
    pub n_points: u64,
    /// Centers of the cameras `(m, 3)`; may be empty.
    pub cameras: Vec<[f32; 3]>,
    /// The up direction; `None` is +z.
    pub up: Option<[f32; 3]>,
    /// Released records, at most one entry per scheme.
    pub obfuscations: Vec<ObfuscationView>,
    /// Recovered points, at most one entry per row of the results.
    pub views: Vec<View>,
}

/// The points recovered under one scheme, from one kind of neighborhoods, by one solver.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The neighborhoods, as in the row of the results.
    pub given: Given,
    /// The solver's name.
    pub solver: String,
    /// Recovered positions `(n, 3)`, aligned with [`Scene3d::originals`]; NaN if a point is lost or was
    /// not released.
    pub recovered: Vec<[f32; 3]>,
}

/// Released records of one scheme; a sample is enough for the drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct ObfuscationView {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The records as drawn.
    pub shapes: Shapes,
    /// Number of records, drawn or not.
    pub n_records: u64,
    /// Indices in [`Scene3d::originals`] of points that the scheme did not release.
    pub withheld: Vec<usize>,
}

/// Records as drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Shapes {
    /// Lines and rays clipped to the scene, see [`SceneBox::clip_line`] and [`SceneBox::clip_ray`].
    Segments(Vec<[[f32; 3]; 2]>),
    /// Planes as outlined rectangles, see [`SceneBox::axis_patch`].
    Patches(Vec<[[f32; 3]; 4]>),
    /// Published points (with one swapped coordinate, for `cp`).
    Points(Vec<[f32; 3]>),
}

impl Shapes {
    /// Returns the number of shapes.
    pub fn len(&self) -> usize {
        match self {
            Shapes::Segments(shapes) => shapes.len(),
            Shapes::Patches(shapes) => shapes.len(),
            Shapes::Points(shapes) => shapes.len(),
        }
    }

    /// Returns whether there are no shapes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
