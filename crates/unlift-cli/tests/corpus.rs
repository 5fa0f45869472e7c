//! What fuzzers start from and what they found, through the functions that they call: no panic, no hang.

use std::path::Path;

use unlift::seed::{Draws, Stage};

#[path = "../../../fuzz/src/lib.rs"]
mod targets;

#[test]
fn every_input_of_the_corpus_is_accepted_or_refused() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    for (name, run) in targets::TARGETS {
        let folder = std::fs::read_dir(corpus.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let mut files: Vec<_> = folder.map(|entry| entry.unwrap().path()).collect();
        files.sort();
        assert!(!files.is_empty(), "{name}: no input");
        for file in files {
            let bytes = std::fs::read(&file).unwrap();
            run(&bytes);
        }
    }
}

/// What parts of joint recovery send each other is made by the target itself, so that random changes of it are as good a start as any.
/// `UNLIFT_CHANGES` says how many.
#[test]
fn changes_of_what_rounds_send_are_read_or_refused() {
    let asked = std::env::var("UNLIFT_CHANGES").ok().and_then(|n| n.parse().ok());
    for at in 0..asked.unwrap_or(1500) {
        let mut draws = Draws::new(31, Stage::Synthetic, at);
        let mut bytes = vec![draws.below(6) as u8, draws.below(5) as u8];
        for _ in 0..=draws.below(3) {
            // A kind of change, from the front or the end; where; and what it takes.
            let end = 0x80 * draws.below(2) as u8;
            bytes.push(end | draws.below(8) as u8);
            let most = [16, 200, 1 << 16][draws.below(3) as usize];
            bytes.extend((draws.below(most) as u16).to_le_bytes());
            bytes.extend((0..draws.below(6)).map(|_| draws.below(256) as u8));
        }
        targets::rounds(&bytes);
    }
}
