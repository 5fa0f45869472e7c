//! `unlift models`, and missing models.

use crate::common::{Place, texts};

/// Runs a line with this folder of models and without those of the user; returns stdout and stderr.
fn with_models(place: &Place, folder: &str, line: &str, code: i32) -> (String, String) {
    let mut program = place.program(line.split_whitespace());
    let output =
        program.env("UNLIFT_MODELS", folder).env("XDG_DATA_HOME", "data").output().unwrap();
    assert_eq!(output.status.code(), Some(code), "{line}: {output:?}");
    texts(&output)
}

#[test]
fn models_are_listed_and_a_missing_or_another_one_is_one_line() {
    let place = Place::with_photos(&["a.png"]);
    let (stdout, _) = with_models(&place, "", "models", 0);
    assert!(stdout.contains("aliked-n16rot\n") && stdout.contains("  here     in the program\n"));
    let missing = "  here     no: superpoint.onnx: expected in data/unlift/models \
                   (https://github.com/magicleap/SuperPointPretrainedNetwork), found nothing\n";
    assert!(stdout.contains(missing), "{stdout}");
    place.write("aliked-n16rot.onnx", "another");
    for (folder, kind, expected) in [
        ("", "superpoint", "superpoint.onnx: expected in data/unlift/models (https://github.com/"),
        (".", "aliked", "./aliked-n16rot.onnx: expected SHA-256 "),
        ("nowhere", "aliked", "UNLIFT_MODELS: expected a folder, found nowhere\n"),
    ] {
        let line = format!("features photos --features {kind}");
        let (_, stderr) = with_models(&place, folder, &line, 3);
        let is_one = stderr.lines().count() == 1;
        assert!(stderr.starts_with(&format!("unlift: {expected}")) && is_one, "{stderr}");
    }
    assert_eq!(place.names(""), ["aliked-n16rot.onnx", "photos"]);
}
