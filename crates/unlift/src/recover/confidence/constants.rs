//! Placeholder.

use super::model::{Model, N_KINDS, N_TERMS};

pub(super) const CENTER: [f32; N_TERMS] = [0.0; N_TERMS];
pub(super) const SPREAD: [f32; N_TERMS] = [1.0; N_TERMS];
pub(super) const MODELS: [[Model; N_KINDS]; 3] =
    [const { [const { Model { found: [0.0; N_TERMS], scale: [0.0; N_TERMS] } }; N_KINDS] }; 3];
