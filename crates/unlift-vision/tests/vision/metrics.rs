//! Metrics and detections, compared with scikit-image, the official LPIPS and YOLOX.

use std::fs;
use std::path::PathBuf;

use serde_json::Value;
use unlift_vision::features::photo::{Turn, read_color};
use unlift_vision::pictures::{CLASSES, Detection, Detector, Lpips, Metrics};

use crate::shared;

/// Reads a reference file, and returns the folder of the evaluation data with it.
fn reference(name: &str) -> Option<(PathBuf, Value)> {
    let path = shared(&format!("reference/{name}"))?;
    Some((shared("")?, serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()))
}

#[test]
fn metrics_are_those_of_scikit_image_and_lpips() {
    let Some((shared, reference)) = reference("image_metrics.json") else { return };
    let lpips = Lpips::try_new().unwrap();
    let pairs = reference["pairs"].as_object().unwrap();
    assert!(pairs.len() >= 6);
    for (name, pair) in pairs {
        let read = |side: &str| {
            let path = shared.join("reference").join(pair[side].as_str().unwrap());
            read_color(&path, Turn::Upright).unwrap()
        };
        let found = Metrics::of(&read("a"), &read("b"), &lpips).unwrap();
        let apart = |key: &str, found: f64| (found - pair[key].as_f64().unwrap()).abs();
        assert!(apart("ssim_rgb_uniform7", found.ssim) < 1e-9, "{name}: {found:?}");
        assert!(apart("psnr_db", found.psnr) < 1e-9, "{name}: {found:?}");
        assert!(apart("lpips_squeeze", found.lpips) < 1e-5, "{name}: {found:?}");
    }
}

#[test]
fn detections_are_those_of_yolox() {
    let Some((shared, reference)) = reference("yolox_nano_reference.json") else { return };
    let detector = Detector::try_new().unwrap();
    for result in reference["results"].as_array().unwrap() {
        let path = shared.join(result["image"].as_str().unwrap());
        let picture = read_color(&path, Turn::Upright).unwrap();
        let found = detector.find(&picture, 0.1).unwrap();
        let expected: Vec<Detection> = result["detections"]
            .as_array()
            .unwrap()
            .iter()
            .map(|one| {
                let number = |value: &Value| value.as_f64().unwrap() as f32;
                let sides = one["box_xyxy"].as_array().unwrap();
                let class = one["class_id"].as_u64().unwrap() as usize;
                assert_eq!(CLASSES[class], one["label"].as_str().unwrap());
                let sides = [0, 1, 2, 3].map(|at| number(&sides[at]));
                Detection { class, score: number(&one["score"]), sides }
            })
            .collect();
        // JPEG decoders differ slightly, so only scores clearly above the threshold count.
        for (these, those) in [(&found, &expected), (&expected, &found)] {
            for one in these.iter().filter(|one| one.score > 0.15) {
                let same =
                    |other: &&Detection| other.class == one.class && other.overlap(one) > 0.9;
                let other = those.iter().find(same).unwrap_or_else(|| panic!("{one:?}"));
                assert!((other.score - one.score).abs() < 0.03, "{one:?} and {other:?}");
            }
        }
        assert!(!expected.is_empty());
    }
}
