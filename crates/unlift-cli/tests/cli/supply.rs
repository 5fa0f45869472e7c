//! Licenses, registry and duplicates of the dependencies. This is a test, so that it needs no other
//! program. Advisories change while code does not: check them by `cargo audit` or `cargo deny check advisories`, where there is a network.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

const ALLOWED: &str = "0BSD, Apache-2.0, Apache-2.0 WITH LLVM-exception, BSD-2-Clause, BSD-3-Clause, CC0-1.0, MIT, \
    Unicode-3.0, Unlicense, Zlib";

/// Crates with two versions, because dependencies require different ones. Check a new one before you add it.
const TWICE: &str = "base64 block-buffer cpufeatures crypto-common digest getrandom glam hashbrown miniz_oxide num-bigint \
    rand rand_core syn";

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
    let tree = ["tree", "--locked", "--workspace", "--prefix", "none", "--format", "{l};{p}"];
    let output = Command::new(env!("CARGO")).args(tree).output().expect("cargo runs");
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    // A mark stands for the dependencies of a crate that were listed before.
    let lines = text.lines().map(|line| line.trim_end_matches(" (*)"));
    let lines: BTreeSet<&str> = lines.filter(|line| !line.is_empty()).collect();
    let mut versions: BTreeMap<&str, usize> = BTreeMap::new();
    for line in lines {
        let (licence, package) = line.split_once(';').expect("a license and a package");
        assert!(may_be_carried(licence), "{package}: {licence:?}");
        let (name, version) = package.split_once(' ').expect("a name and a version");
        // Only a source that is not crates.io stands after the version.
        let has_source = version.trim_end_matches(" (proc-macro)").contains(' ');
        assert!(!has_source || name.starts_with("unlift"), "{package}");
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
    for network in unlift_vision::network::MODELS.iter().filter_map(|entry| entry.carried) {
        let sample = &network[network.len() / 2..][..64];
        let copies = memchr::memmem::find_iter(&program, sample).count();
        assert_eq!(copies, 1, "a network of {} bytes", network.len());
    }
    // Line numbers for backtraces are most of a debug build.
    let most = if cfg!(debug_assertions) { 200 } else { 70 };
    assert!(program.len() < most * 1_000_000, "{} bytes", program.len());
}
