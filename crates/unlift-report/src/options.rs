//! Options of the page.

#[cfg(doc)]
use crate::document::Document;
use crate::inversions::Inversion;
use crate::opening::Opening;
use crate::pictures::Picture;

/// Options of the page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RenderOptions {
    /// Leaves out everything but figures: no points, paths, names, command line.
    pub share_safe: bool,
    /// Error curves finer than the percentiles of the document; may be empty.
    pub error_cdf: Vec<ErrorCdf>,
    /// Images to draw, at most [`MOST_PICTURES`](crate::pictures::MOST_PICTURES); empty for maps.
    pub pictures: Vec<Picture>,
    /// Pictures that a network painted from recovered points.
    pub inversions: Vec<Inversion>,
    /// The verdict on another audit, at the top of the page.
    pub opening: Option<Opening>,
}

/// The error curve of one row of the results.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorCdf {
    /// Index into [`Document::results`].
    pub row: usize,
    /// (error in the row's unit, percent of the released points within it), ascending; a hundred
    /// points suffice.
    pub points: Vec<(f64, f64)>,
}
