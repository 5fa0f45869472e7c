//! Licenses, registry and duplicates of the dependencies. This is a test, so that it needs no other
//! program. Advisories change while code does not: check them by `cargo audit` or `cargo deny check
//! advisories`, where there is a network.

use std::collections::BTreeMap;
use std::process::Command;

use serde_json::Value;

const ALLOWED: &str = "0BSD, Apache-2.0, Apache-2.0 WITH LLVM-exception, BSD-2-Clause, BSD-3-Clause, CC0-1.0, MIT, \
    Unicode-3.0, Unlicense, Zlib";

const REGISTRY: &str = "registry+https://github.com/rust-lang/crates.io-index";

/// Crates with two versions, because dependencies require different ones. Check a new one before
/// you add it.
const TWICE: &str = "base64 block-buffer cpufeatures crypto-common digest getrandom glam hashbrown miniz_oxide num-bigint \
    rand rand_core syn";

/// Returns all crates for this platform, from the lock file.
fn packages() -> Vec<Value> {
    let cargo = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO")).args(arguments).output().expect("cargo runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    let version = cargo(&["-vV"]);
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).expect("a host");
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
    let metadata = ["metadata", "--locked", "--format-version", "1", "--filter-platform", host];
    let text = cargo(&[&metadata[..], &["--manifest-path", manifest]].concat());
    let mut metadata: Value = serde_json::from_str(&text).expect("JSON");
    serde_json::from_value(metadata["packages"].take()).expect("a list")
}

/// Returns true if an SPDX expression allows a choice of accepted licenses.
fn may_be_carried(expression: &str) -> bool {
    let choices = |part: &str| {
        let part = part.trim_matches(['(', ')']).replace('/', " OR ");
        part.split(" OR ").any(|licence| ALLOWED.split(", ").any(|allowed| allowed == licence))
    };
    expression.split(" AND ").all(choices)
}

#[test]
fn licences_go_with_ours_all_code_is_from_one_registry_and_none_is_compiled_twice() {
    let packages = packages();
    let mut versions: BTreeMap<&str, usize> = BTreeMap::new();
    for package in &packages {
        let name = package["name"].as_str().expect("a name");
        let licence = package["license"].as_str();
        assert!(licence.is_some_and(may_be_carried), "{name}: {licence:?}");
        let source = package["source"].as_str();
        assert!(source.is_none_or(|source| source == REGISTRY), "{name}: {source:?}");
        *versions.entry(name).or_default() += 1;
    }
    assert!(!may_be_carried("GPL-3.0") && !may_be_carried("MIT AND GPL-3.0"));
    versions.retain(|name, n| *n > 1 && TWICE.split(' ').all(|known| known != *name));
    assert!(versions.is_empty(), "compiled twice: {versions:?}");
}

/// A constant with a file is copied wherever it is used; a static is stored once.
#[test]
fn the_program_holds_every_network_once() {
    let program = std::fs::read(env!("CARGO_BIN_EXE_unlift")).expect("the program");
    for entry in unlift_vision::network::MODELS.iter() {
        let Some(network) = entry.carried else { continue };
        let middle = network.len() / 2;
        let sample = &network[middle..middle + 64];
        let copies = program.windows(sample.len()).filter(|window| *window == sample).count();
        assert_eq!(copies, 1, "{}", entry.name);
    }
    // Line numbers for backtraces are most of a debug build.
    let most = if cfg!(debug_assertions) { 200 } else { 70 };
    assert!(program.len() < most * 1_000_000, "{} bytes", program.len());
}
