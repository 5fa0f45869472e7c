//! Errors of loading and running a network are one line.

use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;
use unlift_vision::network::{Entry, Folders, MODELS, Network, Port, Tensor, entry};

fn aliked() -> &'static Entry {
    entry("aliked-n16rot").unwrap()
}

fn with_file(entry: &Entry, bytes: &[u8]) -> (TempDir, Folders) {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join(entry.file()), bytes).unwrap();
    let given = Some(PathBuf::from(place.path()));
    (place, Folders { given, user: None })
}

fn refused(entry: &Entry, bytes: &[u8]) -> String {
    let (place, folders) = with_file(entry, bytes);
    let error = Network::load_from(&folders, entry).expect_err("it is refused").to_string();
    assert!(!error.contains('\n'), "{error}");
    error.replace(&place.path().display().to_string(), "DIR")
}

#[test]
fn another_file_of_that_name_is_refused() {
    let hash = aliked().sha256.unwrap();
    // The hash of the empty string.
    let empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
    assert_eq!(
        refused(aliked(), b""),
        format!("DIR/aliked-n16rot.onnx: expected SHA-256 {hash}, found {empty}")
    );
}

#[test]
fn what_is_no_onnx_or_has_other_ports_is_refused() {
    let unknown = Entry { sha256: None, inputs: &[], outputs: &[], ..*aliked() };
    for bytes in [&b""[..], b"text", &aliked().carried.unwrap()[..1000]] {
        let error = refused(&unknown, bytes);
        assert!(error.starts_with("DIR/aliked-n16rot.onnx: expected "), "{error}");
    }
    let port = |name, shape| Port { name, shape };
    let bytes = aliked().carried.unwrap();
    let other = Entry {
        inputs: Box::leak(Box::new([port("picture", &[Some(1), Some(3), None, None])])),
        ..unknown
    };
    assert_eq!(
        refused(&other, bytes),
        "DIR/aliked-n16rot.onnx: expected an input picture of shape (1, 3, any, any), found inputs \
         image, patch, samples"
    );
    let other = Entry {
        outputs: Box::leak(Box::new([port("descriptors", &[None, Some(256)])])),
        ..unknown
    };
    let error = refused(&other, bytes);
    assert!(error.contains("an output descriptors of shape (any, 256), found"), "{error}");
}

#[test]
fn a_model_that_is_nowhere_is_told_and_an_unknown_name_too() {
    let entry = Entry { carried: None, ..*aliked() };
    let error = Network::load_from(&Folders::default(), &entry).err().unwrap().to_string();
    assert_eq!(
        error,
        "aliked-n16rot.onnx: expected in the folder that UNLIFT_MODELS names \
         (https://github.com/Shiaoming/ALIKED), found nothing"
    );
    let error = Network::load("no such model").err().unwrap().to_string();
    let known: Vec<&str> = MODELS.iter().map(|entry| entry.name).collect();
    let known = known.join(", ");
    assert_eq!(error, format!("model: expected one of {known}, found no such model"));
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
}

#[test]
fn many_threads_give_the_same_bytes() {
    let network = Network::load("aliked-n16rot").unwrap();
    let run = |_| {
        let values = (0..3 * 64 * 96).map(|at| (at % 251) as f32 / 251.0).collect();
        let image = Tensor::try_new(&[1, 3, 64, 96], values).unwrap();
        network.run(vec![("image", image)], ["score", "level4"]).unwrap()
    };
    let alone = run(0);
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|at| scope.spawn(move || run(at))).collect();
        for thread in threads {
            assert_eq!(thread.join().unwrap(), alone);
        }
    });
}

/// Encodes a length-delimited field of an ONNX message.
fn field(number: u8, inside: &[u8]) -> Vec<u8> {
    let mut bytes = vec![number << 3 | 2];
    let mut length = inside.len();
    while length >= 0x80 {
        bytes.push(length as u8 | 0x80);
        length >>= 7;
    }
    bytes.push(length as u8);
    bytes.extend(inside);
    bytes
}

/// Encodes a network from `features` to `picture` that applies the operators in turn.
fn network(operators: &[&str]) -> Vec<u8> {
    let name = |at: usize| match at {
        0 => "features".to_owned(),
        at if at == operators.len() => "picture".to_owned(),
        at => format!("v{at}"),
    };
    let node = |(at, operator): (usize, &&str)| {
        let parts = [(1, name(at)), (2, name(at + 1)), (4, (*operator).to_owned())];
        field(1, &parts.map(|(number, text)| field(number, text.as_bytes())).concat())
    };
    // Floats of four sides.
    let sides = [0; 4].map(|_| field(1, &field(2, b"n"))).concat();
    let tensor = [&[8, 1][..], &field(2, &sides)].concat();
    let value = |name: &str| [field(1, name.as_bytes()), field(2, &field(1, &tensor))].concat();
    let mut graph = operators.iter().enumerate().map(node).collect::<Vec<_>>().concat();
    graph.extend(
        [field(2, b"g"), field(11, &value("features")), field(12, &value("picture"))].concat(),
    );
    // IR version 8, operators of version 13.
    [vec![8, 8], field(7, &graph), field(8, &[16, 13])].concat()
}

/// The entry of a user's inverter, without a hash.
fn stranger() -> Entry {
    let any = &[None; 4];
    let port = |name| Port { name, shape: any };
    Entry {
        sha256: None,
        inputs: Box::leak(Box::new([port("features")])),
        outputs: Box::leak(Box::new([port("picture")])),
        ..*aliked()
    }
}

fn read(operators: &[&str], entry: &Entry) -> Result<Network, String> {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("x.onnx");
    fs::write(&path, network(operators)).unwrap();
    let told = |error: unlift::Error| error.to_string();
    Network::read_plain(&path, entry).map_err(told)
}

#[test]
fn what_could_be_huge_or_endless_is_not_loaded() {
    let entry = stranger();
    let ones = || Tensor::try_new(&[1, 1, 2, 2], vec![1.0; 4]).unwrap();
    let picture = |operators: &[&str]| {
        let network = read(operators, &entry).unwrap();
        let [picture] = network.run(vec![("features", ones())], ["picture"]).unwrap();
        picture
    };
    assert_eq!(picture(&["Relu", "Sigmoid"]).shape(), [1, 1, 2, 2]);
    for operator in
        ["ConstantOfShape", "Range", "OneHot", "Loop", "If", "Expand", "Tile", "NonZero"]
    {
        let error = read(&[operator], &entry).unwrap_err();
        assert!(error.contains("x.onnx: expected a model in ONNX, found "), "{error}");
        assert!(error.contains(operator) && !error.contains('\n'), "{error}");
    }
    let error = read(&["Relu"; 4097], &entry).unwrap_err();
    assert!(error.ends_with("found more than 4096 nodes"), "{error}");
    assert_eq!(picture(&["Relu"; 4096]).values(), [1.0; 4]);
}

/// The file declares any number of planes for its output.
#[test]
fn an_output_of_another_shape_is_one_line() {
    let three = Port { name: "picture", shape: &[Some(1), Some(3), None, None] };
    let entry = Entry { outputs: Box::leak(Box::new([three])), ..stranger() };
    let network = read(&["Relu"], &entry).unwrap();
    let ones = Tensor::try_new(&[1, 1, 2, 2], vec![1.0; 4]).unwrap();
    let error = network.run(vec![("features", ones)], ["picture"]).unwrap_err().to_string();
    let end = "expected an output picture of shape (1, 3, any, any), found [1, 1, 2, 2]";
    assert!(error.ends_with(end), "{error}");
}
