//! Loading and running networks: golden outputs, cards, and errors of one line.

use std::fs;
use std::path::{Path, PathBuf};

use safetensors::SafeTensors;
use unlift_vision::network::{Entry, Folders, MODELS, Network, Port, Tensor, entry};

use crate::{assert_close, floats};

/// Outputs with more numbers than this are stored as every 37th number, see
/// `training/export/common.py`.
const LONG: usize = 4096;
const STRIDE: usize = 37;
/// Other kernels sum in another order; values are about 1.
const TOLERANCE: f32 = 1e-4;

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("models").join(name)
}

fn aliked() -> &'static Entry {
    entry("aliked-n16rot").unwrap()
}

/// Computes a large input that a golden file omits: waves, as in `training/export/yolox.py`.
fn waves(port: &Port) -> Tensor {
    let shape: Vec<usize> = port.shape.iter().map(|side| side.unwrap()).collect();
    let [_, channels, height, width] = shape[..] else { panic!("{shape:?}") };
    let value = |at: usize| {
        let (c, y, x) = (at / (height * width), at / width % height, at % width);
        let (few, some) = ((c % 7) as f64, (c % 5) as f64);
        let (c, y, x) = (c as f64, y as f64, x as f64);
        let first = libm::sin(x * (0.31 + 0.07 * few) + y * 0.11 + c);
        let second = libm::sin(y * (0.43 - 0.05 * some) - x * 0.17 + c.sqrt());
        255.0 * (0.5 + 0.25 * first + 0.25 * second) as f32
    };
    Tensor::try_new(&shape, (0..channels * height * width).map(value).collect()).unwrap()
}

#[test]
fn every_embedded_model_gives_its_golden_output_and_has_a_card() {
    for entry in MODELS.iter().filter(|entry| entry.carried.is_some()) {
        let folder = folder(entry.name);
        let bytes = fs::read(folder.join("golden.safetensors")).unwrap();
        let golden = SafeTensors::deserialize(&bytes).unwrap();
        let network = Network::load(entry.name).unwrap();
        let input = |port: &Port| match golden.tensor(port.name) {
            Ok(view) => Tensor::try_new(view.shape(), floats(&golden, port.name)).unwrap(),
            Err(_) => waves(port),
        };
        let inputs: Vec<_> = entry.inputs.iter().map(|port| (port.name, input(port))).collect();
        for &Port { name, .. } in entry.outputs {
            let [output] = network.run(inputs.clone(), [name]).unwrap();
            let step = if output.values().len() > LONG { STRIDE } else { 1 };
            let values: Vec<f32> = output.values().iter().step_by(step).copied().collect();
            assert_close(name, &values, &floats(&golden, name), TOLERANCE);
        }
        let card = fs::read_to_string(folder.join("README.md")).unwrap();
        let hash = entry.sha256.expect("an embedded file has a hash");
        for text in [hash, entry.licence, entry.owner] {
            assert!(card.contains(text), "{}: {text}", entry.name);
        }
        assert!(folder.join("LICENSE").is_file());
    }
}

/// Returns the error for a file of the entry's name with these bytes.
fn refused(entry: &Entry, bytes: &[u8]) -> String {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join(entry.file()), bytes).unwrap();
    let folders = Folders { given: Some(place.path().into()), user: None };
    let error = Network::load_from(&folders, entry).expect_err("it is refused").to_string();
    assert!(!error.contains('\n'), "{error}");
    error.replace(&place.path().display().to_string(), "DIR")
}

#[test]
fn a_file_with_another_hash_format_or_shape_is_refused() {
    let hash = aliked().sha256.unwrap();
    // The hash of the empty string.
    let empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
    let line = format!("DIR/aliked-n16rot.onnx: expected SHA-256 {hash}, found {empty}");
    assert_eq!(refused(aliked(), b""), line);
    let unknown = Entry { sha256: None, inputs: &[], outputs: &[], ..*aliked() };
    for bytes in [&b""[..], b"text", &aliked().carried.unwrap()[..1000]] {
        let error = refused(&unknown, bytes);
        assert!(error.starts_with("DIR/aliked-n16rot.onnx: expected "), "{error}");
    }
    const PICTURE: &[Port] = &[Port { name: "picture", shape: &[Some(1), Some(3), None, None] }];
    const WIDE: &[Port] = &[Port { name: "descriptors", shape: &[None, Some(256)] }];
    let bytes = aliked().carried.unwrap();
    assert_eq!(
        refused(&Entry { inputs: PICTURE, ..unknown }, bytes),
        "DIR/aliked-n16rot.onnx: expected an input picture of shape (1, 3, any, any), found inputs \
         image, patch, samples"
    );
    let error = refused(&Entry { outputs: WIDE, ..unknown }, bytes);
    assert!(error.contains("an output descriptors of shape (any, 256), found"), "{error}");
}

#[test]
fn a_missing_model_and_an_unknown_name_are_one_line() {
    let entry = Entry { carried: None, ..*aliked() };
    let error = Network::load_from(&Folders::default(), &entry).unwrap_err().to_string();
    assert_eq!(
        error,
        "aliked-n16rot.onnx: expected in the folder that UNLIFT_MODELS names \
         (https://github.com/Shiaoming/ALIKED), found nothing"
    );
    let folders = Folders { given: Some("no such folder".into()), user: None };
    let line = "UNLIFT_MODELS: expected a folder, found no such folder";
    assert_eq!(Network::load_from(&folders, &entry).unwrap_err().to_string(), line);
    let names: Vec<&str> = MODELS.iter().map(|entry| entry.name).collect();
    let line = format!("model: expected one of {}, found no such model", names.join(", "));
    assert_eq!(Network::load("no such model").unwrap_err().to_string(), line);
}

#[test]
fn the_given_folder_comes_first() {
    let place = tempfile::tempdir().unwrap();
    let [given, user] = ["given", "user"].map(|name| place.path().join(name));
    fs::create_dir(&given).unwrap();
    let folders = Folders { given: Some(given.clone()), user: Some(user.clone()) };
    assert_eq!(folders.find(aliked()), Ok(None));
    fs::create_dir(&user).unwrap();
    for folder in [user, given] {
        let file = folder.join(aliked().file());
        fs::write(&file, "a model").unwrap();
        assert_eq!(folders.find(aliked()), Ok(Some(file)));
    }
}

#[test]
fn inputs_that_do_not_fit_are_one_line() {
    let network = Network::load("aliked-n16rot").unwrap();
    let image =
        |channels: usize| Tensor::try_new(&[1, channels, 32, 32], vec![0.0; channels << 10]);
    for (inputs, output) in [
        (vec![("image", image(2).unwrap())], "score"),
        (vec![("picture", image(3).unwrap())], "score"),
        (vec![("image", image(3).unwrap())], "descriptors"),
        (vec![], "score"),
    ] {
        let error = network.run(inputs, [output]).unwrap_err().to_string();
        assert!(error.starts_with("aliked-n16rot: expected ") && !error.contains('\n'), "{error}");
    }
    let error = Tensor::try_new(&[2, usize::MAX], vec![0.0]).unwrap_err().to_string();
    assert!(error.starts_with("tensor: expected values of the shape [2, "), "{error}");
}
