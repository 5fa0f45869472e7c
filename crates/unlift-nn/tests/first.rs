//! The network of `learned` is loaded by whoever comes first: a process of its own, where nobody came before.

use rayon::prelude::*;
use unlift::neighbors::Source;
use unlift::obfuscate::olc::Olc;
use unlift_nn::Learned;
use unlift_testkit::described_map;

/// Tasks of one pool ask for it at the same time: a thread that waited for
/// rten's pool would take up the next task, which needs what the thread is loading, and both would wait for ever.
#[test]
fn many_maps_may_ask_at_once() {
    let maps: Vec<_> = (0..6).map(|at| described_map(&Olc, 60 + at)).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let lists = |map: &(_, _, _)| Learned::default().lists(&map.1, 5, 0);
    let found: Vec<_> = pool.install(|| maps.par_iter().map(lists).collect());
    for (lists, map) in found.iter().zip(&maps) {
        assert_eq!(lists.as_ref(), Learned::default().lists(&map.1, 5, 0).as_ref());
    }
}
