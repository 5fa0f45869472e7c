//! Every embedded model gives the output of PyTorch at its export, and its card states its hash.

use std::fs;
use std::path::{Path, PathBuf};

use safetensors::SafeTensors;
use unlift_vision::network::{MODELS, Network, Port, Tensor};

/// Outputs with more numbers than this are stored as every 37th number, see `training/export/common.py`.
const LONG: usize = 4096;
const STRIDE: usize = 37;
/// Other kernels sum in another order; values are about 1.
const TOLERANCE: f32 = 1e-4;

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("models").join(name)
}

fn tensor(file: &SafeTensors, name: &str) -> Tensor {
    let view = file.tensor(name).unwrap();
    let floats = view.data().as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
    Tensor::try_new(view.shape(), floats.collect()).unwrap()
}

/// Computes an input that a golden file omits because it is large: waves, times 255, as in
/// `training/export/yolox.py`. Such ports have fixed sides.
fn waves(port: &Port) -> Tensor {
    let shape: Vec<usize> = port.shape.iter().map(|side| side.unwrap()).collect();
    let [_, channels, height, width] = shape[..] else { panic!("{shape:?}") };
    let mut values = Vec::new();
    for (c, y, x) in (0..channels * height * width)
        .map(|at| (at / (height * width), at / width % height, at % width))
    {
        let (few, some) = ((c % 7) as f64, (c % 5) as f64);
        let (c, y, x) = (c as f64, y as f64, x as f64);
        let first = libm::sin(x * (0.31 + 0.07 * few) + y * 0.11 + c);
        let second = libm::sin(y * (0.43 - 0.05 * some) - x * 0.17 + c.sqrt());
        values.push(255.0 * (0.5 + 0.25 * first + 0.25 * second) as f32);
    }
    Tensor::try_new(&shape, values).unwrap()
}

#[test]
fn every_carried_model_gives_its_golden_output() {
    let mut seen = 0;
    for entry in MODELS.iter().filter(|entry| entry.carried.is_some()) {
        let bytes = fs::read(folder(entry.name).join("golden.safetensors")).unwrap();
        let golden = SafeTensors::deserialize(&bytes).unwrap();
        let network = Network::load(entry.name).unwrap();
        let input = |port: &Port| match golden.tensor(port.name) {
            Ok(_) => tensor(&golden, port.name),
            Err(_) => waves(port),
        };
        let inputs = entry.inputs.iter().map(|port| (port.name, input(port)));
        let names: Vec<&str> = entry.outputs.iter().map(|port| port.name).collect();
        let outputs = network.run_all(inputs.collect(), &names).unwrap();
        for (name, output) in names.iter().zip(outputs) {
            let expected = tensor(&golden, name);
            let step = if output.values().len() > LONG { STRIDE } else { 1 };
            let found: Vec<f32> = output.values().iter().step_by(step).copied().collect();
            assert_eq!(found.len(), expected.values().len(), "{name}");
            for (found, expected) in found.iter().zip(expected.values()) {
                assert!((found - expected).abs() < TOLERANCE, "{name}: {found} and {expected}");
                seen += 1;
            }
        }
    }
    assert!(seen > 1000, "{seen} numbers were compared");
}

#[test]
fn every_carried_model_has_a_card_with_its_hash_and_a_licence() {
    for entry in MODELS.iter().filter(|entry| entry.carried.is_some()) {
        let card = fs::read_to_string(folder(entry.name).join("README.md")).unwrap();
        let hash = entry.sha256.expect("a file that is carried has a hash");
        for text in [hash, entry.licence, entry.owner] {
            assert!(card.contains(text), "{}: {text}", entry.name);
        }
        assert!(folder(entry.name).join("LICENSE").is_file());
    }
}
