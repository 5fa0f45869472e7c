//! `unlift models`, and missing models.

use crate::common::{Place, texts};

#[test]
fn models_are_listed_and_a_missing_one_is_one_line() {
    let place = Place::with_photos(&["a.png"]);
    // A folder of models that is not the user's.
    let run = |line: &str, code: i32| {
        let mut program = place.program(line.split_whitespace());
        program.env("UNLIFT_MODELS", "").env("XDG_DATA_HOME", "data");
        let output = program.output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{line}: {output:?}");
        texts(&output)
    };
    let (stdout, _) = run("models", 0);
    assert!(stdout.contains("aliked-n16rot\n") && stdout.contains("  here     in the program\n"));
    let missing = "superpoint.onnx: expected in data/unlift/models \
                   (https://github.com/magicleap/SuperPointPretrainedNetwork), found nothing";
    assert!(stdout.contains(&format!("  here     no: {missing}\n")), "{stdout}");
    let (_, stderr) = run("features photos --features superpoint", 3);
    assert!(stderr.starts_with(&format!("unlift: {missing}\n")), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert_eq!(place.names(""), ["photos"]);
}
