//! Chosen images on the page: photo, keypoints, released records and recovered keypoints.
//!
//! Positions are in pixels. The center of the first pixel is `(0, 0)`, so an image of width `w` spans
//! `-0.5` to `w - 0.5`.

mod encode;

pub use crate::attack::Given;

pub(crate) use encode::{EncodedPicture, encode, first_choice};

/// Maximal number of images on a page, which stays below 10 MB.
pub const MOST_PICTURES: usize = 12;
/// Number of neighbors per keypoint in a graph.
pub const GRAPH_NEIGHBORS: usize = 5;

/// An image of the page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// The image's name.
    pub name: String,
    /// The reason for its choice, for example `worst`; may be empty.
    pub note: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The photo as a small JPEG; `None` draws a gray frame.
    pub photo: Option<Vec<u8>>,
    /// True positions of the `n` keypoints.
    pub keypoints: Vec<[f32; 2]>,
    /// Released records, one entry per scheme.
    pub released: Vec<ReleasedView>,
    /// Recovered keypoints, one entry per attack.
    pub views: Vec<RecoveredView>,
    /// Graphs of neighbors, one per kind of neighborhoods.
    pub graphs: Vec<Graph>,
}

/// The released records of one scheme.
#[derive(Debug, Clone, PartialEq)]
pub struct ReleasedView {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The records, one per keypoint of [`Picture::keypoints`] in the same order.
    pub marks: Marks,
}

/// Records as drawn; `None` if a keypoint was not released.
#[derive(Debug, Clone, PartialEq)]
pub enum Marks {
    /// Lines clipped to the image.
    Lines(Vec<Option<[[f32; 2]; 2]>>),
    /// Half-lines from an anchor (the first end) to the border of their part of the image.
    Rays(Vec<Option<[[f32; 2]; 2]>>),
    /// Published points with one coordinate of another keypoint.
    Points(Vec<Option<[f32; 2]>>),
}

/// The keypoints recovered under one scheme, from one kind of neighborhoods.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoveredView {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The neighborhoods.
    pub given: Given,
    /// The solver's name.
    pub solver: String,
    /// Recovered positions, one per keypoint of [`Picture::keypoints`]; `None` if it is lost or was not
    /// released.
    pub recovered: Vec<Option<[f32; 2]>>,
}

/// A graph of neighborhoods: per keypoint up to [`GRAPH_NEIGHBORS`] neighbors.
#[derive(Debug, Clone, PartialEq)]
pub struct Graph {
    /// The neighborhoods.
    pub given: Given,
    /// True positions of the neighbors, per keypoint of [`Picture::keypoints`].
    pub neighbors: Vec<Vec<[f32; 2]>>,
}
