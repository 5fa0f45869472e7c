//! SuperPoint with seeded random weights, compared with `training/export/superpoint.py`.
//!
//! `python export/superpoint.py --random FOLDER` makes `tests/data/superpoint-random`.

use std::path::{Path, PathBuf};

use safetensors::SafeTensors;
use unlift_vision::features::{ColorImage, SuperPoint, SuperPointOptions};
use unlift_vision::network::{Entry, Network, Port, entry};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/superpoint-random").join(name)
}

/// Creates an extractor with the narrow network, whose descriptors have 16 values.
fn superpoint(options: SuperPointOptions) -> SuperPoint {
    const OUTPUTS: &[Port] = &[
        Port { name: "score", shape: &[Some(1), None, None] },
        Port { name: "coarse", shape: &[Some(1), None, None, Some(16)] },
    ];
    let narrow = Entry { outputs: OUTPUTS, ..*entry("superpoint").unwrap() };
    let network = Network::read(&data("superpoint.onnx"), &narrow).unwrap();
    SuperPoint::of_network(network, options).unwrap()
}

#[test]
fn features_are_those_of_the_script() {
    let bytes = std::fs::read(data("golden.safetensors")).unwrap();
    let golden = SafeTensors::deserialize(&bytes).unwrap();
    let floats = |name: &str| -> Vec<f32> {
        let values = golden.tensor(name).unwrap().data().as_chunks::<4>().0;
        values.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
    };
    let image = golden.tensor("image").unwrap();
    let (height, width) = (image.shape()[0], image.shape()[1]);
    let colors = image.data().iter().flat_map(|&gray| [gray; 3]).collect();
    let image = ColorImage::try_new(width, height, colors).unwrap();
    let found = superpoint(SuperPointOptions::default()).extract(&image).unwrap();
    let keypoints = floats("keypoints");
    assert!(keypoints.len() > 100, "{}", keypoints.len());
    assert_eq!(found.keypoints.as_flattened(), keypoints, "pixels, so the very same");
    for (found, expected) in found.scores.iter().zip(floats("scores")) {
        assert!((found - expected).abs() < 1e-5, "{found} and {expected}");
    }
    assert_eq!(found.descriptors.len(), keypoints.len() / 2 * 16);
    for (found, expected) in found.descriptors.iter().zip(floats("descriptors")) {
        assert!((found - expected).abs() < 1e-4, "{found} and {expected}");
    }
}

#[test]
fn images_without_an_inside_have_no_features() {
    let superpoint = superpoint(SuperPointOptions::default());
    for (width, height) in [(1, 1), (7, 100), (8, 8), (8, 90)] {
        let flat = ColorImage::try_new(width, height, vec![0; 3 * width * height]).unwrap();
        assert_eq!(superpoint.extract(&flat).unwrap().keypoints.len(), 0, "{width} x {height}");
    }
}
