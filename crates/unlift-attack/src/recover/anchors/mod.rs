//! Rays from anchors (`dcl2d`): centers with a region of the image each, between which crossings give no position.

pub(super) mod layout;
pub(super) mod start;
