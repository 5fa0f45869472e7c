//! What one record says of a possible exchange.

/// A record on the axis it is believed to have exchanged.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    /// The axis; out of range where nothing was recovered.
    pub(super) axis: usize,
    pub(super) published: f32,
    pub(super) estimate: f32,
}

impl Side {
    pub(super) fn is_known(&self) -> bool {
        self.axis != LOST
    }
}

/// The axis of a record that was not recovered.
pub(super) const LOST: usize = usize::MAX;
