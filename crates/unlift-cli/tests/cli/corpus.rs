//! Runs the seeds and findings of the fuzzers through the fuzzed functions: no panic, no hang.

use std::path::Path;

#[path = "../../../../fuzz/src/lib.rs"]
mod targets;

#[test]
fn every_input_of_the_corpus_is_accepted_or_refused() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    for (name, run) in targets::TARGETS {
        let folder = std::fs::read_dir(corpus.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let files: Vec<_> = folder.map(|entry| entry.unwrap().path()).collect();
        assert!(!files.is_empty(), "{name}: no input");
        files.iter().for_each(|file| run(&std::fs::read(file).unwrap()));
    }
}
