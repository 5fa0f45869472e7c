//! The first use of the network of `learned`, in its own process, where it is not loaded yet.

use rayon::prelude::*;
use unlift::neighbors::Source;
use unlift::obfuscate::olc::Olc;
use unlift_nn::Learned;
use unlift_testkit::described_map;

/// Several tasks of one pool request the network at the same time. If a thread waited for rten's
/// pool, it could start the next task, which needs the network that the thread is loading: a
/// deadlock.
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
