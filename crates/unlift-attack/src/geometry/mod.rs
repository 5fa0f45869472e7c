//! Geometry on `[f64; D]` and `[f32; D]`, independent of the pipeline.

pub mod camera;
#[doc(hidden)]
pub mod curve;
pub mod flatness;
pub mod frame;
pub mod knn;
pub mod normal;
pub mod vector;
