//! Benchmark of recovery: a plain gather of the listed records, then every solver.
//!
//! Prints microseconds of one core per hidden point, multiples of the gather (these vary less on
//! noisy machines), and points per second on one and two threads.
//!
//! `cargo bench -p unlift --bench recover -- [NAME=LIST ..]` with the names of [`Sizes`], for
//! example `points=10000 schemes=olc ratios=0.5,0.1 solvers=consensus`. Delta is fixed, K = 50. The
//! map is RedKitchen if it is beside the repository (`map=FILE` for another `points3D.bin`),
//! otherwise the synthetic room, thinned out or tiled to the number of points.

use std::hint::black_box;
use std::time::Instant;

use rayon::ThreadPool;
use rayon::prelude::*;
use unlift::neighbors::Neighborhoods;
use unlift::neighbors::oracle::{TrueNeighbors, search};
use unlift::obfuscate::{Entry, SchemeOptions, obfuscate, scheme};
use unlift::recover::{Builtin, Delta, RecoverOptions, recover};
use unlift::released::{Obfuscation, Released};
use unlift::seed::Key;
use unlift::truth::Original;
use unlift::{PointSet, Unit, synthetic};

const K: usize = 50;
const DELTA: f64 = 0.08;
const MAP: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/redkitchen/model/points3D.bin");
/// Maximum number of points for `ransac`, which takes minutes per cell on larger maps.
const MOST_SAMPLED: usize = 100_000;

struct Sizes {
    points: Vec<usize>,
    schemes: Vec<&'static Entry>,
    ratios: Vec<f64>,
    solvers: Vec<Builtin>,
    threads: Vec<usize>,
    map: String,
    /// Number of runs per cell, of which the fastest counts.
    runs: usize,
}

impl Sizes {
    fn read() -> Self {
        // `cargo test --benches` requests a quick check that the benchmark runs.
        let quick = std::env::args().any(|a| a == "--test");
        let mut sizes = Self {
            points: if quick { vec![1_000] } else { vec![10_000, 100_000, 700_000, 5_000_000] },
            schemes: ["olc", "ppl", "plane"].iter().filter_map(|n| scheme(n).ok()).collect(),
            ratios: if quick { vec![0.5] } else { vec![1.0, 0.75, 0.5, 0.3, 0.2, 0.1] },
            solvers: Builtin::ALL.to_vec(),
            threads: vec![1, 2],
            map: MAP.to_owned(),
            runs: if quick { 1 } else { 3 },
        };
        for argument in std::env::args().skip(1) {
            let Some((name, list)) = argument.split_once('=') else { continue };
            let fields = list.split(',');
            match name {
                "points" => sizes.points = fields.map(number).collect(),
                "schemes" => sizes.schemes = fields.map(|n| scheme(n).expect(n)).collect(),
                "ratios" => sizes.ratios = fields.map(number).collect(),
                "solvers" => {
                    sizes.solvers = fields.map(|n| Builtin::from_name(n).expect(n)).collect();
                }
                "threads" => sizes.threads = fields.map(number).collect(),
                "map" => sizes.map = list.to_owned(),
                "runs" => sizes.runs = number(list),
                _ => panic!(
                    "expected points, schemes, ratios, solvers, threads, map or runs, found {name}"
                ),
            }
        }
        sizes
    }
}

fn number<T: std::str::FromStr>(text: &str) -> T {
    text.parse().unwrap_or_else(|_| panic!("expected a number, found {text}"))
}

fn main() {
    let sizes = Sizes::read();
    let base = match std::fs::read(&sizes.map) {
        Ok(bytes) => colmap_points(&bytes),
        Err(_) => synthetic::room(0, synthetic::DEFAULT_N_POINTS).points,
    };
    let pool = |&n: &usize| rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("a pool");
    let pools: Vec<ThreadPool> = sizes.threads.iter().map(pool).collect();
    println!("{} points tiled, K = {K}, delta {DELTA}, best of {}", base.len(), sizes.runs);
    print!(
        "{:>9} {:>9} {:>5} {:>10} {:>9} {:>9}",
        "points", "scheme", "right", "work", "us/point", "x gather"
    );
    for threads in &sizes.threads {
        print!(" {:>12}", format!("points/s, {threads}"));
    }
    println!();
    for &n in &sizes.points {
        forget_peak();
        let points = PointSet::try_new(synthetic::tiled(&base, n, 0), Unit::Meter);
        let original = Original::new(points.expect("finite points"));
        for entry in &sizes.schemes {
            table(&sizes, &pools, &original, entry);
        }
        if let Some(peak) = peak_memory_mib() {
            println!(
                "{n:>9} peak memory {peak:.0} MiB, {:.0} bytes per point",
                peak * 1048576.0 / n as f64
            );
        }
    }
}

fn table(sizes: &Sizes, pools: &[ThreadPool], original: &Original<3>, entry: &Entry) {
    let Some(scheme) = entry.of_dimension::<3>(&SchemeOptions { voxel: 0.5 }) else { return };
    let (released, near) = {
        let hidden = obfuscate(&*scheme, original, None, &Key::from_seed(0));
        let (released, secret) = hidden.expect("a map can be hidden");
        let started = Instant::now();
        let knn = search(original).expect("points");
        let near = TrueNeighbors::new(&knn, &secret, released.slots_per_record(), K);
        let seconds = started.elapsed().as_secs_f64();
        println!(
            "{:>9} {:>9}       {:>10} {seconds:>9.2} s, all threads",
            original.len(),
            entry.name,
            "true lists"
        );
        (released, near.expect("enough points"))
    };
    for &ratio in &sizes.ratios {
        let lists = near.at_inlier_ratio(ratio, 0).expect("enough non-neighbors");
        let rows = Rows::new(&released);
        let gather = seconds(sizes, pools, &|| rows.gather(&lists));
        row(sizes, &lists, (entry.name, ratio, "gather"), &gather, gather[0]);
        drop(rows);
        for &solver in &sizes.solvers {
            if solver == Builtin::Ransac && original.len() > MOST_SAMPLED {
                continue;
            }
            let options = RecoverOptions {
                delta: Delta::Fixed(DELTA),
                confidence: false,
                ..RecoverOptions::default()
            };
            let work = || recover(&released, &lists, &solver, &options).expect("valid input");
            let took = seconds(sizes, pools, &work);
            row(sizes, &lists, (entry.name, ratio, solver.name()), &took, gather[0]);
        }
    }
}

fn row(
    sizes: &Sizes,
    lists: &Neighborhoods,
    (scheme, ratio, work): (&str, f64, &str),
    seconds: &[f64],
    gather: f64,
) {
    let n = lists.n_slots() as f64;
    let cost = seconds[0] * sizes.threads[0] as f64 * 1e6 / n;
    let times = seconds[0] / gather;
    print!("{n:>9} {scheme:>9} {ratio:>5} {work:>10} {cost:>9.3} {times:>9.1}");
    for seconds in seconds {
        print!(" {:>12.0}", n / seconds);
    }
    println!();
}

/// Returns the shortest time of `work` in seconds on each pool.
fn seconds<T: Send>(
    sizes: &Sizes,
    pools: &[ThreadPool],
    work: &(dyn Fn() -> T + Sync),
) -> Vec<f64> {
    let run = |pool: &ThreadPool| {
        let started = Instant::now();
        black_box(pool.install(work));
        started.elapsed().as_secs_f64()
    };
    let least = |pool| (0..sizes.runs).map(|_| run(pool)).fold(f64::INFINITY, f64::min);
    pools.iter().map(least).collect()
}

/// Records as rows of at most one cache line, as a solver reads them.
enum Rows {
    Wide(Vec<[f32; 8]>),
    Narrow(Vec<[f32; 4]>),
}

impl Rows {
    fn new(released: &Released<3>) -> Self {
        let wide = |[a, b, c]: [f32; 3], [d, e, f]: [f32; 3]| [a, b, c, d, e, f, 0.0, 0.0];
        match released.obfuscation() {
            Obfuscation::Lines(lines) => {
                let both = lines.foot().iter().zip(lines.direction());
                Self::Wide(both.map(|(&foot, &direction)| wide(foot, direction)).collect())
            }
            Obfuscation::Rays(rays) => {
                let center = |&at: &u8| rays.centers()[usize::from(at)];
                let both = rays.center().iter().map(center).zip(rays.direction());
                Self::Wide(both.map(|(center, &direction)| wide(center, direction)).collect())
            }
            Obfuscation::AxisPlanes(planes) => {
                let both = planes.axis().iter().zip(planes.offset());
                Self::Narrow(both.map(|(&a, &offset)| [f32::from(a), offset, 0.0, 0.0]).collect())
            }
            Obfuscation::AxisCandidates(candidates) => Self::Narrow(
                candidates.position().iter().map(|&[a, b, c]| [a, b, c, 0.0]).collect(),
            ),
        }
    }

    /// Reads every listed record of every slot, in order, with almost no computation.
    fn gather(&self, lists: &Neighborhoods) -> f32 {
        match self {
            Self::Wide(rows) => gathered(rows, lists),
            Self::Narrow(rows) => gathered(rows, lists),
        }
    }
}

fn gathered<const W: usize>(rows: &[[f32; W]], lists: &Neighborhoods) -> f32 {
    let slot = |slot: usize| {
        let mut sum = [0.0f32; W];
        for record in lists.of(slot) {
            for (sum, x) in sum.iter_mut().zip(&rows[record.index()]) {
                *sum += x;
            }
        }
        sum.iter().sum::<f32>()
    };
    (0..lists.n_slots()).into_par_iter().with_min_len(64).map(slot).sum()
}

/// Reads the points of a COLMAP `points3D.bin`. The core must not depend on the readers in
/// `unlift-io`.
fn colmap_points(bytes: &[u8]) -> Vec<[f64; 3]> {
    let u64_at = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("8 bytes"));
    let mut points = Vec::new();
    let mut at = 8;
    for _ in 0..u64_at(0) {
        points.push([8, 16, 24].map(|field| f64::from_bits(u64_at(at + field))));
        // Id, position, color, error, then a track of two 32-bit ids per entry.
        at += 51 + 8 * u64_at(at + 43) as usize;
    }
    points
}

/// Resets the peak memory, where the system supports it (Linux).
fn forget_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Returns the largest resident set of this process since the reset, where the system reports it.
fn peak_memory_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}
