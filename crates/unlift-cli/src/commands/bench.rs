//! `unlift bench recover`: measures the time of recovery, beside the paper's runtime table.

use std::time::Instant;

use serde_json::{Value, json};
use unlift::neighbors::oracle::{TrueNeighbors, search};
use unlift::obfuscate::{SchemeOptions, obfuscate};
use unlift::recover::{RecoverOptions, recover};
use unlift::seed::Key;
use unlift::truth::Original;
use unlift::{PointSet, synthetic};
use unlift_io::read;
use unlift_report::paper::published_seconds;

use super::common::with_threads;
use crate::args::BenchRecoverArgs;
use crate::exit::{Outcome, usage};
use crate::output::{print, table};
use crate::progress::Spinner;
use unlift_audit::peak_bytes;
use unlift_audit::{Preparation, prepare};

/// Measured times, in seconds of wall clock.
struct Bench {
    n_points: usize,
    threads: usize,
    obfuscate: f64,
    search: f64,
    /// Inlier ratio, solver and seconds.
    rows: Vec<(f64, &'static str, f64)>,
}

/// Hides a map of the requested size and measures its recovery.
pub fn recovery(args: &BenchRecoverArgs) -> anyhow::Result<Outcome> {
    let alive = Spinner::new("measuring");
    let bench = with_threads(args.threads, || measure(args))?;
    drop(alive);
    print(&if args.json { as_json(args, &bench) } else { as_table(args, &bench) })?;
    Ok(Outcome::Done)
}

fn measure(args: &BenchRecoverArgs) -> anyhow::Result<Bench> {
    let name = args.scheme.name;
    let original = map(args)?;
    let options = SchemeOptions::usual(original.reveal().unit());
    let scheme = args.scheme.of_dimension::<3>(&options);
    let scheme = scheme.ok_or_else(|| usage(format!("{name} is not for maps")))?;
    let started = Instant::now();
    let (released, secret) = obfuscate(&*scheme, &original, None, &Key::from_seed(args.seed))?;
    let hidden = started.elapsed().as_secs_f64();
    let started = Instant::now();
    let knn = search(&original)?;
    let k = usize::from(args.k);
    let near = TrueNeighbors::new(&knn, &secret, released.slots_per_record(), k)?;
    let searched = started.elapsed().as_secs_f64();
    drop(knn);
    let mut rows = Vec::new();
    for &ratio in &args.inlier_ratios {
        let lists = near.at_inlier_ratio(ratio, args.seed)?;
        for &solver in &args.solver {
            let options = RecoverOptions {
                delta: args.delta,
                confidence: args.confidence,
                ..RecoverOptions::default()
            };
            let started = Instant::now();
            recover(&released, &lists, &solver, &options)?;
            rows.push((ratio, solver.name(), started.elapsed().as_secs_f64()));
        }
    }
    let (n_points, threads) = (original.len(), rayon::current_num_threads());
    Ok(Bench { n_points, threads, obfuscate: hidden, search: searched, rows })
}

/// Returns the map of `--map` (default: the demo's room), thinned out or tiled to `--points`.
fn map(args: &BenchRecoverArgs) -> anyhow::Result<Original<3>> {
    let preparation = Preparation {
        scale: args.map.is_none().then_some(1.0),
        k: usize::from(args.k),
        ..Preparation::default()
    };
    let prepared = match &args.map {
        Some(path) => prepare(&read::open(path)?.positions, None, &preparation)
            .map_err(|error| unlift_io::Error::core(path, error))?,
        None => {
            let room = synthetic::room(0, synthetic::DEFAULT_N_POINTS);
            prepare(&room.points, None, &preparation)?
        }
    };
    let base = prepared.original.reveal();
    let points = synthetic::tiled(base.positions(), args.points.get(), args.seed);
    Ok(Original::new(PointSet::try_new(points, base.unit())?))
}

fn as_table(args: &BenchRecoverArgs, bench: &Bench) -> String {
    let (n, k) = (bench.n_points, usize::from(args.k));
    let mut rows = vec![
        ["right", "solver", "seconds", "points/s", "paper, 64 cores"].map(str::to_owned).to_vec(),
    ];
    for &(ratio, solver, seconds) in &bench.rows {
        let published = published_seconds(args.scheme.name, n, k, ratio);
        rows.push(vec![
            format!("{} %", 100.0 * ratio),
            solver.to_owned(),
            format!("{seconds:.2}"),
            format!("{:.0}", n as f64 / seconds),
            published.map_or("-".to_owned(), |seconds| format!("{seconds:.0} s")),
        ]);
    }
    let memory = peak_bytes().map_or(String::new(), |bytes| {
        format!(", peak memory {:.0} MiB", bytes as f64 / f64::from(1 << 20))
    });
    format!(
        "{}: {n} points, K = {k}, {} threads; {}\n\n{}\nobfuscation {:.2} s, true neighbors {:.2} s{memory}\n",
        args.scheme.name,
        bench.threads,
        if args.confidence {
            "positions and how sure they are"
        } else {
            "positions alone, without confidence"
        },
        table(&rows, &[1]),
        bench.obfuscate,
        bench.search,
    )
}

fn as_json(args: &BenchRecoverArgs, bench: &Bench) -> String {
    let (n, k) = (bench.n_points, usize::from(args.k));
    let row = |&(ratio, solver, seconds): &(f64, &str, f64)| -> Value {
        json!({
            "inlier_ratio": ratio,
            "solver": solver,
            "seconds": seconds,
            "points_per_second": n as f64 / seconds,
            "published_seconds": published_seconds(args.scheme.name, n, k, ratio),
        })
    };
    let document = json!({
        "unlift": env!("CARGO_PKG_VERSION"),
        "scheme": args.scheme.name,
        "n_points": n,
        "k": k,
        "threads": bench.threads,
        "confidence": args.confidence,
        "seed": args.seed,
        "rows": bench.rows.iter().map(row).collect::<Vec<_>>(),
        "seconds": { "obfuscate": bench.obfuscate, "true_neighbors": bench.search },
        "peak_memory_bytes": peak_bytes(),
    });
    format!("{document:#}\n")
}
