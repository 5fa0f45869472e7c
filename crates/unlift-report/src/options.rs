//! How a page is drawn.

#[cfg(doc)]
use crate::document::Document;
use crate::inversions::Inversion;
use crate::opening::Opening;
use crate::pictures::Picture;

/// How to draw the page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RenderOptions {
    /// Leave out everything but figures: no points, paths, names, command line.
    pub share_safe: bool,
    /// Finer error curves than the percentiles of the document; may be empty.
    pub error_cdf: Vec<ErrorCdf>,
    /// Audits of images: those to be drawn, at most [`MOST_PICTURES`](crate::pictures::MOST_PICTURES).
    pub pictures: Vec<Picture>,
    /// Pictures that a network painted from what came back.
    pub inversions: Vec<Inversion>,
    /// The verdict on another audit, which the page begins with.
    pub opening: Option<Opening>,
}

/// The error curve of one row of the results.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorCdf {
    /// Index into [`Document::results`].
    pub row: usize,
    /// (error in the row's unit, percent of the released points within it), rising; a hundred
    /// points are plenty.
    pub points: Vec<(f64, f64)>,
}
