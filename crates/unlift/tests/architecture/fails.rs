//! Each check of the house can fail.

use crate::circles::{back_arrows, circles};
use crate::names::dangling;
use crate::rules::*;
use crate::rust::{Source, code_of};

fn source(path: &str, text: &str) -> Source {
    Source { path: path.to_owned(), code: code_of(text) }
}

fn arrows(path: &str, text: &str) -> Vec<String> {
    forbidden_arrows(&source(path, text))
}

#[test]
fn arrows_against_the_stream_are_found_however_they_are_written() {
    let wrong = [
        ("recover/joint.rs", "use crate::truth::Original;"),
        ("recover/joint.rs", "use crate::{Error, truth::Secret};"),
        ("recover/joint.rs", "use crate::{\n    released::{Lines, Rays},\n    truth::Secret,\n};"),
        ("recover/joint.rs", "use crate::{released as r, truth as t};"),
        ("recover/joint.rs", "use super::super::truth;"),
        ("recover/joint/sweeps.rs", "use super::super::super::truth::Original;"),
        ("recover/mod.rs", "fn f(secret: &crate::truth::Secret) {}"),
        ("recover/mod.rs", "use crate::neighbors::oracle::TrueNeighbors;"),
        ("recover/mod.rs", "use crate::neighbors::{Neighborhoods, oracle};"),
        ("recover/mod.rs", "use crate::neighbors;"),
        ("recover/mod.rs", "use crate::neighbors::*;"),
        ("recover/mod.rs", "use crate::*;"),
        ("recover/mod.rs", "use crate::evaluate::Accuracy;"),
        ("recover/mod.rs", "use crate::obfuscate::SCHEMES;"),
        ("geometry/knn/mod.rs", "use crate::released::Lines;"),
        ("points.rs", "use crate::truth::Original;"),
        ("truth/secret.rs", "use crate::released::Released;"),
        ("released/mod.rs", "use crate::truth::Secret;"),
        ("neighbors/neighborhoods.rs", "use crate::truth::Secret;"),
        ("neighbors/line_distance.rs", "use crate::truth::Secret;"),
        ("neighbors/oracle/mod.rs", "use crate::recover::Recovered;"),
        ("density/mod.rs", "use crate::neighbors::Neighborhoods;"),
        ("density/mod.rs", "use crate::truth::Original;"),
        ("obfuscate/olc.rs", "use crate::neighbors::Neighborhoods;"),
        ("evaluate/mod.rs", "use crate::obfuscate::SCHEMES;"),
        ("evaluate/mod.rs", "use crate::audit::Row;"),
        ("new_stage/mod.rs", ""),
    ];
    for (path, text) in wrong {
        assert!(!arrows(path, text).is_empty(), "{path}: {text}");
    }
}

#[test]
fn arrows_with_the_stream_pass() {
    let right = [
        ("recover/mod.rs", "use crate::neighbors::Neighborhoods;\nuse crate::{Error, RecordId};"),
        (
            "recover/baselines/ransac/loops.rs",
            "use crate::recover::map::sections::{NO_VOTE, Sections};",
        ),
        ("recover/mod.rs", "//! Never imports `crate::truth`.\nconst A: &str = \"crate::truth\";"),
        ("geometry/kmeans.rs", "use super::vector::dot;\nuse crate::seed::{Draws, Stage};"),
        ("neighbors/oracle/mod.rs", "use crate::truth::{Original, Secret};"),
        ("audit/run.rs", "use crate::recover::{RecoverOptions as Options, recover};"),
        ("seed.rs", "mod tests {\n    use super::*;\n}"),
    ];
    for (path, text) in right {
        assert_eq!(arrows(path, text), Vec::<String>::new(), "{path}");
    }
}

fn sources(texts: &[(&str, &str)]) -> Vec<Source> {
    texts.iter().map(|(path, text)| source(path, text)).collect()
}

#[test]
fn circles_are_found_however_long_they_are() {
    let two = sources(&[
        ("a/mod.rs", "mod b;\nmod c;"),
        ("a/b.rs", "use super::c::C;"),
        ("a/c.rs", "use crate::a::b::{self, B};"),
    ]);
    assert_eq!(circles(&two), ["in a circle: a/b.rs, a/c.rs"]);
    let three = sources(&[
        ("a.rs", "use crate::b::B;"),
        ("b.rs", "fn f() -> crate::c::C {}"),
        ("c.rs", "use crate::{a::A, Error};"),
    ]);
    assert_eq!(circles(&three), ["in a circle: a.rs, b.rs, c.rs"]);
    // A folder that uses its child, which uses the folder's own items.
    let nested = sources(&[
        ("a/mod.rs", "mod b;\nuse b::B;\nconst N: usize = 1;"),
        ("a/b.rs", "use super::N;"),
    ]);
    assert_eq!(circles(&nested), ["in a circle: a/b.rs, a/mod.rs"]);
    let by_an_exported_name = sources(&[
        ("a/mod.rs", "mod b;\nmod c;\npub(crate) use b::B;"),
        ("a/b.rs", "use super::c::C;"),
        ("a/c.rs", "use super::B;"),
    ]);
    assert_eq!(circles(&by_an_exported_name), ["in a circle: a/b.rs, a/c.rs"]);
}

#[test]
fn tables_of_contents_and_tests_make_no_circles() {
    let right = sources(&[
        ("lib.rs", "mod a;\nmod error;\npub use error::Error;"),
        ("error.rs", ""),
        ("a/mod.rs", "mod b;\nmod c;\npub use b::B;\npub(crate) use c::{C, D};"),
        ("a/b.rs", "use super::C;\nuse crate::Error;"),
        ("a/c.rs", "#[cfg(test)]\nmod tests {\n    use super::*;\n    use crate::a::B;\n}"),
        ("a/c/tests.rs", "use super::*;"),
    ]);
    assert_eq!(circles(&right), Vec::<String>::new());
}

#[test]
fn arrows_back_up_inside_recover_are_found() {
    let folders = [
        ("recover/mod.rs", "pub use result::estimate::Estimate;"),
        ("recover/result/mod.rs", ""),
        ("recover/result/estimate.rs", ""),
        ("recover/map/mod.rs", ""),
        ("recover/map/graph.rs", ""),
        ("recover/consensus/refit.rs", ""),
        ("recover/consensus/mod.rs", "use crate::recover::map::graph::Graph;"),
    ];
    let found = |path: &str, text: &str| {
        back_arrows(&sources(&[&folders[..], &[(path, text)]].concat())).len()
    };
    let right = "use crate::recover::map::graph::Graph;\nuse super::refit::refit;\n\
                 use crate::recover::result::estimate::Estimate;";
    assert_eq!(found("recover/consensus/on_lines.rs", right), 0);
    for wrong in [
        "use super::Consensus;",
        "use crate::recover::consensus::Consensus;",
        "use crate::recover::Estimate;",
        "use super::super::recover;",
        "use crate::recover::joint::Joint;",
        "use crate::recover::{map::graph::Graph, ransac::Ransac};",
    ] {
        assert_eq!(found("recover/consensus/on_lines.rs", wrong), 1, "{wrong}");
    }
    assert_eq!(found("recover/map/places.rs", "use crate::recover::joint::Joint;"), 1);
    assert_eq!(found("recover/delta.rs", "use super::options::Solver;"), 1);
    assert_eq!(found("recover/new.rs", ""), 1);
}

#[test]
fn reveals_are_found() {
    let reveal = "let points = original.reveal();";
    assert_eq!(forbidden_reveals(&source("audit/run.rs", reveal)), ["audit/run.rs: `reveal`"]);
    assert_eq!(forbidden_reveals(&source("recover/mod.rs", "map(Original::reveal)")).len(), 1);
    assert_eq!(forbidden_reveals(&source("neighbors/neighborhoods.rs", reveal)).len(), 1);
    assert!(forbidden_reveals(&source("neighbors/oracle/mod.rs", reveal)).is_empty());
    assert!(forbidden_reveals(&source("audit/run.rs", "// reveal()")).is_empty());
}

#[test]
fn state_and_files_are_found_in_recovery() {
    let state = |text: &str| forbidden_state(&source("recover/joint.rs", text)).len();
    assert_eq!(state("static CACHE: Mutex<u32> = Mutex::new(0);"), 1);
    assert_eq!(state("use std::fs::File;"), 1);
    assert_eq!(state("use std::{env, io};"), 1);
    assert_eq!(state("let text = std::fs::read_to_string(path);"), 1);
    assert_eq!(state("fn name(&self) -> &'static str { \"static\" }"), 0);
}

#[test]
fn unsafe_code_is_found() {
    let block = "fn f() { unsafe { g() } }";
    assert_eq!(forbidden_unsafe(&source("recover/lists.rs", block)).len(), 1);
    assert!(forbidden_unsafe(&source("simd.rs", block)).is_empty());
    assert!(forbidden_unsafe(&source("lib.rs", "#![deny(unsafe_code)]")).is_empty());
}

#[test]
fn printing_that_panics_is_found() {
    for name in ["print", "println", "eprint", "eprintln"] {
        let code = format!("fn f() {{ {name}!(\"x\") }}");
        assert_eq!(forbidden_prints(&source("commands/demo.rs", &code)).len(), 1, "{name}");
    }
    let ours = "fn f() { print(\"x\")?; progress.print(); write!(f, \"x\") }";
    assert!(forbidden_prints(&source("output.rs", ours)).is_empty());
}

#[test]
fn a_forgotten_scheme_is_found() {
    let module = "pub const SCHEMES: &[Entry] = &[\n    olc::ENTRY,\n    cp::ENTRY,\n];";
    assert!(unregistered(&["mod.rs", "pairs.rs", "cp.rs", "olc.rs"], module).is_empty());
    let found = unregistered(&["mod.rs", "pairs.rs", "cp.rs", "olc.rs", "circles.rs"], module);
    assert_eq!(found, ["obfuscate/circles.rs: not in SCHEMES"]);
    assert_eq!(unregistered(&["ppl.rs"], "mod ppl;").len(), 1);
}

#[test]
fn long_files_and_new_dependencies_are_found() {
    let long = "x\n".repeat(401);
    assert_eq!(counted_lines(&long), 401);
    let tested = format!("{}#[cfg(test)]\nmod tests {{\n{long}}}\n", "x\n".repeat(9));
    assert_eq!(counted_lines(&tested), 9);
    let manifest = "[package]\nname = \"a\"\n\n[dependencies]\n# why\nlibm = \"0.2\"\n\
                    unlift.workspace = true\n\n[dev-dependencies]\nproptest = \"1\"\n";
    assert_eq!(manifest_names(manifest, "dependencies"), ["libm", "unlift"]);
    assert_eq!(manifest_names(manifest, "dev-dependencies"), ["proptest"]);
}

#[test]
fn keys_on_the_attackers_side_are_found() {
    for path in ["recover/delta.rs", "neighbors/similarity.rs", "density/mod.rs"] {
        let found = forbidden_keys(&source(path, "let key = crate::seed::Key::from_seed(seed);"));
        assert_eq!(found.len(), 1, "{path}");
    }
    assert!(forbidden_keys(&source("audit/run.rs", "use crate::seed::Key;")).is_empty());
}

#[test]
fn names_of_files_that_are_not_there_are_found() {
    let files = ["docs/decisions/joint.md", "crates/unlift/src/seed.rs"].map(str::to_owned);
    let found = |path: &str, text: &str| dangling(path, text, &files);
    let wrong = "see [why](docs/joint.md)\n\nand `seeds.rs`, or eed.rs.";
    assert_eq!(
        found("README.md", wrong),
        [
            "README.md:1: there is no file docs/joint.md",
            "README.md:3: there is no file seeds.rs",
            "README.md:3: there is no file eed.rs",
        ]
    );
    assert_eq!(found("src/a.rs", "/// As in `README.md`.\nlet a = \"mod.rs\";").len(), 1);
    let right = "[a](decisions/joint.md#top), ../../unlift/src/seed.rs: https://a.b/no.md, `.rs`";
    assert_eq!(found("docs/formats.md", right), Vec::<String>::new());
}
