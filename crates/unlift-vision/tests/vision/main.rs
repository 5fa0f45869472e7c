//! Networks, features of photos, and pictures from keypoints.

mod camera;
mod inverter;
mod learned;
mod learned_features;
mod metrics;
mod network;
mod photo;
mod sift;

use std::path::{Path, PathBuf};

use safetensors::SafeTensors;

/// Returns a file of the evaluation data beside the repository; `None` if it is missing.
fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared").join(name);
    if !path.exists() {
        eprintln!("{} is missing: skipped", path.display());
        return None;
    }
    Some(path)
}

fn floats(file: &SafeTensors, name: &str) -> Vec<f32> {
    let values = file.tensor(name).unwrap().data().as_chunks::<4>().0;
    values.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

/// Checks that each value is within `tolerance` of the expected one.
fn assert_close(name: &str, values: &[f32], expected: &[f32], tolerance: f32) {
    assert_eq!(values.len(), expected.len(), "{name}");
    for (at, (value, expected)) in values.iter().zip(expected).enumerate() {
        assert!((value - expected).abs() < tolerance, "{name}, {at}: {value} and {expected}");
    }
}
