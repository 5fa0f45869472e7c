//! Binary data of the page's script: blocks in base64, and coordinates of 16 bits.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// Blocks of base64, to which the script's data refer by index.
#[derive(Debug, Default)]
pub(crate) struct Blocks(pub Vec<String>);

impl Blocks {
    /// Adds a block and returns its index.
    pub(crate) fn push(&mut self, bytes: impl AsRef<[u8]>) -> usize {
        self.0.push(STANDARD.encode(bytes));
        self.0.len() - 1
    }
}

/// Returns a JPEG as the source of an image element.
pub(crate) fn image_source(jpeg: &[u8]) -> String {
    format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg))
}

/// The coordinate of a point that is not drawn. Others are 0..=65534.
pub(crate) const NOT_DRAWN: u16 = u16::MAX;

/// Returns the coordinate of a place at `share` of a side; places outside move to the border.
pub(crate) fn coordinate(share: f32) -> u16 {
    (share.clamp(0.0, 1.0) * f32::from(NOT_DRAWN - 1)).round() as u16
}
