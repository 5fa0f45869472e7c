//! Recovery in one run: every scheme, inlier ratio and solver, as microseconds of one core per
//! hidden point and as ratios within this run (machines are noisy, ratios less so).
//!
//! `cargo bench -p unlift --bench recover [-- POINTS]`. Fixed delta, K = 50, one thread, the
//! procedural room; each cell is the least of three runs.

use std::time::Instant;

use unlift::neighbors::oracle::{TrueNeighbors, search};
use unlift::obfuscate::{SCHEMES, SchemeOptions, obfuscate};
use unlift::recover::{Delta, RecoverOptions, Solver, recover};
use unlift::truth::Original;
use unlift::{PointSet, Unit, synthetic};

const K: usize = 50;
const RATIOS: [f64; 6] = [1.0, 0.75, 0.5, 0.3, 0.2, 0.1];
const DELTA: f64 = 0.08;

fn main() {
    // `cargo test --benches` asks for a quick check that the bench still runs.
    let quick = std::env::args().any(|a| a == "--test");
    let n = std::env::args().skip(1).find_map(|a| a.parse().ok());
    let n = n.unwrap_or(if quick { 1_000 } else { 20_000 });
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    one_thread.expect("a pool of one thread").install(|| table(n, if quick { 1 } else { 3 }));
    if let Some(peak) = peak_memory_mib() {
        println!("\npeak memory {peak:.0} MiB");
    }
}

fn table(n: usize, runs: usize) {
    let points = synthetic::room(0, n).points;
    let points = PointSet::try_new(points, Unit::Meter).expect("finite points");
    let original = Original::new(points);
    let knn = search(&original).expect("points");
    println!("{n} points, K = {K}, delta {DELTA}, one thread, us per hidden point");
    println!("{:>10} {:>6} {:>10} {:>10} {:>8}", "scheme", "ratio", "consensus", "ransac", "r / c");
    for entry in SCHEMES {
        let Some(scheme) = entry.in_3d else { continue };
        let options = SchemeOptions { voxel: 0.5 };
        let (released, secret) =
            obfuscate(scheme, &original, None, &options, 0).expect("a room can be hidden");
        let near = TrueNeighbors::new(&knn, &secret, released.slots_per_record(), K);
        let near = near.expect("enough points");
        for ratio in RATIOS {
            let lists = near.at_inlier_ratio(ratio, 0).expect("enough non-neighbors");
            let cost = |solver| {
                let options = RecoverOptions { solver, delta: Delta::Fixed(DELTA), seed: 0 };
                let run = || {
                    let started = Instant::now();
                    let recovered = recover(&released, &lists, &options).expect("valid input");
                    started.elapsed().as_secs_f64() * 1e6 / recovered.n_slots() as f64
                };
                (0..runs).map(|_| run()).fold(f64::INFINITY, f64::min)
            };
            let (consensus, ransac) = (cost(Solver::Consensus), cost(Solver::Ransac));
            let name = entry.name;
            let times = ransac / consensus;
            println!("{name:>10} {ratio:>6} {consensus:>10.2} {ransac:>10.2} {times:>8.1}");
        }
    }
}

/// The largest resident set of this process so far, where the system tells.
fn peak_memory_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}
