//! Pure mathematics on `[f64; D]` and `[f32; D]`: knows no stage of the pipeline.

pub(crate) mod curve;
pub mod flatness;
pub mod frame;
pub mod kmeans;
pub mod knn;
pub mod normal;
pub mod vector;
