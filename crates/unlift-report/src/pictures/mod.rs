//! Chosen images on the page: the photo, its keypoints, what is released and what comes back.
//!
//! Positions are in pixels; the middle of the first pixel is `(0, 0)`, so an image of width `w` reaches
//! from `-0.5` to `w - 0.5`.

mod encode;

pub use crate::attack::Given;

pub(crate) use encode::{EncodedPicture, encode, first_choice};

/// Images on a page at most: a page is for looking at, and stays below 10 MB.
pub const MOST_PICTURES: usize = 12;
/// Neighbors per keypoint that a graph shows.
pub const GRAPH_NEIGHBORS: usize = 5;

/// One image to be drawn.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// The image's name.
    pub name: String,
    /// Why it was chosen, for example `worst`; may be empty.
    pub note: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The photo as a small JPEG; `None` draws a gray frame.
    pub photo: Option<Vec<u8>>,
    /// True keypoints, `n` places.
    pub keypoints: Vec<[f32; 2]>,
    /// What each scheme publishes.
    pub released: Vec<ReleasedView>,
    /// What came back, one per scheme and neighborhoods.
    pub views: Vec<RecoveredView>,
    /// Who is said to be near whom, one per neighborhoods.
    pub graphs: Vec<Graph>,
}

/// What one scheme publishes.
#[derive(Debug, Clone, PartialEq)]
pub struct ReleasedView {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// Its records, one per keypoint of [`Picture::keypoints`] in the same order.
    pub marks: Marks,
}

/// Records as drawn; `None` where a keypoint was not released.
#[derive(Debug, Clone, PartialEq)]
pub enum Marks {
    /// Lines clipped to the image.
    Lines(Vec<Option<[[f32; 2]; 2]>>),
    /// Half-lines from an anchor (the first end) to where they leave their part of the image.
    Rays(Vec<Option<[[f32; 2]; 2]>>),
    /// Published points of which one coordinate belongs to another keypoint.
    Points(Vec<Option<[f32; 2]>>),
}

/// What came back under one scheme, from one kind of neighborhoods.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoveredView {
    /// The scheme's user-facing name.
    pub scheme: String,
    /// The neighborhoods.
    pub given: Given,
    /// The solver's name.
    pub solver: String,
    /// One per keypoint of [`Picture::keypoints`]; `None` where it is lost or was not released.
    pub recovered: Vec<Option<[f32; 2]>>,
}

/// A graph of neighborhoods: per keypoint up to [`GRAPH_NEIGHBORS`] neighbors.
#[derive(Debug, Clone, PartialEq)]
pub struct Graph {
    /// The neighborhoods.
    pub given: Given,
    /// Per keypoint of [`Picture::keypoints`] the true places of its neighbors.
    pub neighbors: Vec<Vec<[f32; 2]>>,
}
