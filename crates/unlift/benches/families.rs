//! Benchmark on small and unusual maps: compares `joint` with `consensus`, and checks confidence.
//!
//! `cargo bench -p unlift --bench families -- [NAME=LIST ..]` prints for each map the worst
//! difference in percentage points between `joint` and `consensus` (at each threshold), and the
//! smallest correct share of points that are reported as 90 % sure, over all schemes, noise models,
//! inlier ratios and sources. At the end it prints the number of cells with a problem.
//!
//! Names: `maps` (`room`, `line`, ... or `redkitchen`, `castle`, each `:POINTS`;
//! `image:KEYPOINTS`), `schemes`, `ratios`, `noise`, `sources`, `seeds`, `k`. `cells=1` prints
//! every cell; `solver=NAME` compares another solver with consensus. Real maps must be beside the
//! repository; missing ones are skipped with a message.

use std::path::PathBuf;

use unlift::audit::{self, NeighborsBy, Plan, Row, Silent, Threshold};
use unlift::geometry::frame::Bounds;
use unlift::geometry::knn::Knn;
use unlift::geometry::vector::median;
use unlift::neighbors::Needs;
use unlift::neighbors::oracle::Noise;
use unlift::neighbors::sources::Named;
use unlift::recover::Builtin;
use unlift::seed::{Draws, Stage};
use unlift::synthetic::{self, Shape};
use unlift::truth::Original;
use unlift::{Descriptors, Error, PointSet, Unit, descriptors::Values};

const IMAGE: [f64; 2] = [640.0, 480.0];
/// Minimum percentage of sure points in a cell for a verdict on "sure".
const LEAST_SURE: f64 = 1.0;

/// Minimum percentage of correct points among the sure ones.
const LEAST_RIGHT: f64 = 85.0;
/// Differences in percentage points from which on `consensus` counts as ahead.
const AHEAD: [f64; 3] = [1.0, 3.0, 10.0];

#[derive(Default)]
struct Totals {
    /// Number of pairs of `joint` and `consensus`.
    n: usize,
    /// Number of pairs in which `consensus` is [`AHEAD`] at any threshold.
    behind: [usize; AHEAD.len()],
    /// Number of rows with enough sure points.
    n_sure: usize,
    /// Number of these rows with too few correct points.
    wrong: usize,
}

impl Totals {
    fn print(&self) {
        let [a, b, c] = self.behind;
        println!(
            "of {} cells consensus is ahead by more than 1, 3, 10 points in {a}, {b}, {c}",
            self.n
        );
        println!(
            "of {} rows with at least {LEAST_SURE} % of points called 90 % sure, {} have fewer than {LEAST_RIGHT} % of those right",
            self.n_sure, self.wrong
        );
    }
}

struct Suite {
    maps: Vec<String>,
    schemes: Option<Vec<String>>,
    ratios: Vec<f64>,
    noise: Vec<Noise>,
    sources: Vec<String>,
    seeds: u32,
    k: usize,
    cells: bool,
    solver: Builtin,
}

impl Suite {
    fn read() -> Self {
        // `cargo test --benches` requests a quick check that the benchmark runs.
        let quick = std::env::args().any(|a| a == "--test");
        let mut maps = Vec::new();
        for name in ["redkitchen", "castle", "room"] {
            maps.extend([500, 1_000, 2_000, 4_000].map(|n| format!("{name}:{n}")));
        }
        let shapes = Shape::ALL.iter().filter(|shape| **shape != Shape::Room);
        maps.extend(shapes.map(|shape| format!("{}:2000", shape.name())));
        maps.extend([50, 200, 1_000].map(|n| format!("image:{n}")));
        let mut suite = Self {
            maps: if quick { vec!["cube:300".to_owned(), "image:60".to_owned()] } else { maps },
            schemes: None,
            ratios: vec![1.0, 0.5, 0.3, 0.2, 0.1],
            noise: Noise::ALL.to_vec(),
            sources: ["oracle", "similarity", "overlap", "geometric"].map(str::to_owned).to_vec(),
            seeds: if quick { 1 } else { 2 },
            k: 50,
            cells: false,
            solver: Builtin::Joint,
        };
        for argument in std::env::args().skip(1) {
            let Some((name, list)) = argument.split_once('=') else { continue };
            let fields = list.split(',');
            match name {
                "maps" => suite.maps = fields.map(str::to_owned).collect(),
                "schemes" => suite.schemes = Some(fields.map(str::to_owned).collect()),
                "ratios" => suite.ratios = fields.map(number).collect(),
                "noise" => {
                    suite.noise =
                        Noise::ALL.into_iter().filter(|x| list.contains(x.name())).collect();
                }
                "sources" => suite.sources = fields.map(str::to_owned).collect(),
                "seeds" => suite.seeds = number(list),
                "k" => suite.k = number(list),
                "cells" => suite.cells = list == "1",
                "solver" => {
                    suite.solver = Builtin::from_name(list).unwrap_or_else(|e| panic!("{e}"));
                }
                _ => panic!(
                    "expected maps, schemes, ratios, noise, sources, seeds, k, cells or solver, found {name}"
                ),
            }
        }
        suite
    }

    /// Returns the plan for maps or images of `unit` with one source.
    fn plan<const D: usize>(&self, unit: Unit, by: NeighborsBy<D>) -> Plan<D> {
        let mut usual = Plan::new(unit);
        let of_images = unit == Unit::Pixel;
        if let Some(names) = &self.schemes {
            usual.schemes.retain(|scheme| names.iter().any(|name| name == scheme.name()));
        }
        let threshold =
            |label: &str| Threshold::parse(label).unwrap_or_else(|e| panic!("{label}: {e}"));
        let thresholds = if of_images {
            usual.thresholds.clone()
        } else {
            ["1.0", "2.5"].map(threshold).to_vec()
        };
        Plan {
            neighbors: vec![by],
            oracle_noise: self.noise.clone(),
            inlier_ratios: self.ratios.clone(),
            k: if of_images { 20 } else { self.k },
            solvers: Builtin::list(&[self.solver, Builtin::Consensus]),
            thresholds,
            repeats: self.seeds,
            records_alone: false,
            ..usual
        }
    }
}

fn number<T: std::str::FromStr>(text: &str) -> T {
    text.parse().unwrap_or_else(|_| panic!("expected a number, found {text}"))
}

fn main() {
    let suite = Suite::read();
    println!(
        "{:<22} {:<10} {:>6} {:<44} {:>6} {:<44} {:>6} {:>6} {:<44} {:>6}",
        "map",
        "source",
        "worst",
        format!("{} less consensus, in", suite.solver.name()),
        "mean",
        "least right of sure",
        "right",
        "sure",
        "",
        "cells"
    );
    let mut totals = Totals::default();
    for map in &suite.maps {
        for source in &suite.sources {
            match rows(&suite, map, source) {
                Ok(Some(rows)) => table(&suite, map, source, &rows, &mut totals),
                Ok(None) => {}
                Err(error) => println!("{map:<22} {source:<10} {error}"),
            }
        }
    }
    totals.print();
}

/// Prints the comparison of a solver, by default `joint`, with consensus for each cell.
fn table(suite: &Suite, map: &str, source: &str, rows: &[Row], totals: &mut Totals) {
    let cell = |row: &Row| {
        let noise = row.oracle_noise.unwrap_or("");
        format!("{} {:.2} {noise}", row.scheme, row.inlier_ratio)
    };
    let (mut worst, mut least) =
        ((f64::INFINITY, String::new()), (f64::INFINITY, 0.0, String::new()));
    let (mut sum, mut n) = (0.0, 0);
    for pair in rows.chunks(2) {
        let [joint, consensus] = pair else { continue };
        let mut ahead = f64::NEG_INFINITY;
        for at in 0..joint.recovered_percent.len() {
            let (a, b) = (joint.recovered_percent[at], consensus.recovered_percent[at]);
            ahead = ahead.max(b - a);
            if a - b < worst.0 {
                worst = (a - b, format!("{} {a:.1} / {b:.1} ({at})", cell(joint)));
            }
        }
        sum += joint.recovered_percent[0] - consensus.recovered_percent[0];
        n += 1;
        totals.n += 1;
        for (count, least) in totals.behind.iter_mut().zip(AHEAD) {
            *count += usize::from(ahead > least);
        }
        for row in pair {
            let Some(reliability) = &row.reliability else { continue };
            let (sure, right) = (reliability.sure_percent(), reliability.sure_correct_percent());
            let Some(right) = right.filter(|_| sure >= LEAST_SURE) else { continue };
            totals.n_sure += 1;
            totals.wrong += usize::from(right < LEAST_RIGHT);
            if right < least.0 {
                least = (right, sure, format!("{} {}", cell(row), row.solver));
            }
        }
        if suite.cells {
            let sure = |row: &Row| match &row.reliability {
                Some(r) => format!(
                    "{:5.1}/{:5.1}",
                    r.sure_percent(),
                    r.sure_correct_percent().unwrap_or(f64::NAN)
                ),
                None => "-".to_owned(),
            };
            let percent = |row: &Row| {
                let of: Vec<String> =
                    row.recovered_percent.iter().map(|p| format!("{p:5.1}")).collect();
                of.join("/")
            };
            println!(
                "    {map:<20} {source:<10} {:<24} {} {} delta {:.3} sure {} | consensus {} delta {:.3} sure {}",
                cell(joint),
                joint.solver,
                percent(joint),
                joint.delta,
                sure(joint),
                percent(consensus),
                consensus.delta,
                sure(consensus)
            );
        }
    }
    let mean = sum / f64::from(n.max(1));
    println!(
        "{map:<22} {source:<10} {:>6.1} {:<44} {mean:>6.1} {:>6.1} {:>6.1} {:<44} {n:>6}",
        worst.0, worst.1, least.0, least.1, least.2
    );
}

/// Returns the rows of one map and source; `None` if they do not fit or the map is missing.
fn rows(suite: &Suite, map: &str, source: &str) -> Result<Option<Vec<Row>>, Error> {
    let (name, n) = map.split_once(':').unwrap_or((map, "2000"));
    let n: usize = number(n);
    if name == "image" {
        let plan = suite.plan(Unit::Pixel, NeighborsBy::<2>::Oracle);
        if plan.schemes.is_empty() || source != "oracle" {
            return Ok(None);
        }
        let image = |at: u32| {
            let points = synthetic::keypoints(u64::from(at), n, IMAGE);
            let points = PointSet::try_new(points, Unit::Pixel)?;
            let original = Original::within(points, Bounds { low: [0.0; 2], high: IMAGE })?;
            Ok(audit::Item { name: format!("{at}"), original, descriptors: None })
        };
        let images: Vec<Result<_, Error>> = (0..8).map(image).collect();
        return Ok(Some(audit::run_many(images, &plan, &mut Silent)?.rows));
    }
    let Some((points, descriptors)) = points(name, n) else {
        if source == "oracle" {
            println!("{map:<22} not here");
        }
        return Ok(None);
    };
    let by = match source {
        "oracle" => NeighborsBy::<3>::Oracle,
        name => NeighborsBy::Source(Named::parse(name)?.of_dimension()?),
    };
    let needs = by.source().is_some_and(|source| source.needs() == Needs::Descriptors);
    let plan = suite.plan(Unit::KthNeighbor, by);
    if plan.schemes.is_empty() || (needs && descriptors.is_none()) {
        return Ok(None);
    }
    let typical = median(&mut Knn::new(&points)?.kth_distances(suite.k));
    let points = points.iter().map(|p| p.map(|x| x / typical)).collect();
    let original = Original::new(PointSet::try_new(points, Unit::KthNeighbor)?);
    Ok(Some(audit::run(&original, descriptors.as_ref(), &plan, &mut Silent)?.rows))
}

/// Returns `n` points of a map, with descriptors if it has some.
fn points(name: &str, n: usize) -> Option<(Vec<[f64; 3]>, Option<Descriptors>)> {
    if let Some(shape) = Shape::ALL.into_iter().find(|shape| shape.name() == name) {
        return Some((synthetic::shape(shape, 1, n), None));
    }
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(name);
    let all = colmap_points(&std::fs::read(folder.join("model/points3D.bin")).ok()?);
    let rows = std::fs::read(folder.join("descriptors.bin")).ok();
    let mut order = Draws::new(0, Stage::Subset, 0).permutation(all.len());
    order.truncate(n);
    let points = order.iter().map(|&i| all[i as usize].1).collect();
    let descriptors = rows.and_then(|rows| {
        let n_all = u64_at(&rows, 8) as usize;
        let id = |row: usize| u64_at(&rows, 24 + 8 * row);
        let row_of = |id_wanted: u64| {
            let ids: Vec<u64> = (0..n_all).map(id).collect();
            ids.binary_search(&id_wanted).expect("a descriptor for every point")
        };
        let start = 24 + 8 * n_all;
        let values = order.iter().flat_map(|&i| {
            let row = row_of(all[i as usize].0);
            rows[start + 128 * row..start + 128 * (row + 1)].to_vec()
        });
        Descriptors::try_new(Values::U8(values.collect()), 128).ok()
    });
    Some((points, descriptors))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("8 bytes"))
}

/// Returns ids and points of a COLMAP `points3D.bin`.
fn colmap_points(bytes: &[u8]) -> Vec<(u64, [f64; 3])> {
    let mut points = Vec::new();
    let mut at = 8;
    for _ in 0..u64_at(bytes, 0) {
        let place = [8, 16, 24].map(|field| f64::from_bits(u64_at(bytes, at + field)));
        points.push((u64_at(bytes, at), place));
        // Id, position, color, error, then a track of two 32-bit ids per entry.
        at += 51 + 8 * u64_at(bytes, at + 43) as usize;
    }
    points
}
