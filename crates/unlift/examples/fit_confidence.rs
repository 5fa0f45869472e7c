//! Fits the constants of confidence on synthetic maps and prints them as Rust.
//!
//! ```text
//! cargo run --release -p unlift --example fit_confidence > constants.rs
//! mv constants.rs crates/unlift-attack/src/recover/confidence/ && cargo fmt
//! ```
//!
//! `joint` and `ranking` recover every scheme, noise model and ratio in rooms and other shapes of several sizes.
//! Some are stretched, so that density falls with distance, as outdoors. Damped Newton steps
//! maximize the likelihood of "the error is within t" for thresholds t around the typical distance
//! of the K-th neighbor. The constants are identical on every machine and for any number of
//! threads.

use std::fmt::Write;

use rayon::prelude::*;
use unlift::geometry::knn::Knn;
use unlift::geometry::vector::{distance, median};
use unlift::neighbors::oracle::{self, Noise, Outliers, TrueNeighbors};
use unlift::obfuscate::{Entry, SCHEMES, SchemeOptions, obfuscate};
use unlift::recover::{
    Builtin, Cues, N_KINDS, N_TERMS, RecoverOptions, centered, recover_and_look, terms,
};
use unlift::seed::Key;
use unlift::synthetic::{Shape, shape};
use unlift::truth::Original;
use unlift::{Error, PointSet, Unit};

#[path = "fit_confidence/likelihood.rs"]
mod likelihood;

use likelihood::{Row, fit};

struct Scene {
    shape: Shape,
    seed: u64,
    n: usize,
    /// Factor of the stretch `1 + stretch r^2` from the origin.
    stretch: f64,
    k: usize,
}

const fn scene(shape: Shape, seed: u64, n: usize, stretch: f64, k: usize) -> Scene {
    Scene { shape, seed, n, stretch, k }
}

/// Maps for the fit. Spheres, lines and two densities are kept for validation, with the real maps.
const SCENES: [Scene; 12] = [
    scene(Shape::Room, 101, 6_000, 0.0, 50),
    scene(Shape::Room, 103, 5_000, 0.3, 50),
    scene(Shape::Room, 104, 5_000, 1.0, 30),
    scene(Shape::Room, 106, 4_000, 0.05, 20),
    scene(Shape::Room, 107, 5_000, 3.0, 50),
    scene(Shape::Room, 112, 12_000, 1.0, 50),
    // On large maps `plane` is recovered even at 0.1.
    scene(Shape::Room, 109, 20_000, 0.1, 50),
    scene(Shape::Cube, 113, 8_000, 0.0, 50),
    scene(Shape::Clusters, 114, 8_000, 0.0, 50),
    scene(Shape::Outdoors, 115, 10_000, 0.0, 50),
    scene(Shape::LongRoom, 116, 8_000, 0.0, 50),
    scene(Shape::RoomWithOutliers, 117, 10_000, 0.0, 50),
];
const RATIOS: [(Noise, &[f64]); 3] = [
    (Noise::Uniform, &[1.0, 0.75, 0.5, 0.3, 0.2, 0.15, 0.1, 0.06]),
    (Noise::Near, &[0.5, 0.2]),
    (Noise::Clustered, &[0.5, 0.2, 0.1]),
];
const SLOTS: usize = 400;

fn main() -> Result<(), Error> {
    let mut text = String::from(
        "//! Constants of confidence, printed by `cargo run --release -p unlift --example fit_confidence`.\n\n\
         // A fitted weight may resemble a mathematical constant.\n\
         #![allow(clippy::approx_constant)]\n\n\
         use crate::recover::confidence::{Constants, Model};\n",
    );
    for solver in [Builtin::Joint, Builtin::Ranking] {
        text += &constants(solver, &rows(solver)?);
    }
    print!("{text}");
    Ok(())
}

/// Recovers all scenes by `solver`. Returns rows per kind of records.
fn rows(solver: Builtin) -> Result<Vec<Vec<Row>>, Error> {
    let mut rows: Vec<Vec<Row>> = (0..N_KINDS).map(|_| Vec::new()).collect();
    for scene in SCENES {
        let original = Original::new(points(&scene)?);
        let typical = {
            let mut kth = Knn::new(original.reveal().positions())?.kth_distances(50);
            median(&mut kth)
        };
        let for_maps = SCHEMES.iter().filter(|entry| entry.in_3d.is_some());
        for entry in for_maps {
            eprintln!("{}: {} {}, {}", solver.name(), scene.shape.name(), scene.seed, entry.name);
            for (kind, row) in of_scheme(solver, &original, entry, scene.k, typical)? {
                rows[kind].push(row);
            }
        }
    }
    Ok(rows)
}

fn points(scene: &Scene) -> Result<PointSet<3>, Error> {
    let mut points = shape(scene.shape, scene.seed, scene.n);
    for point in &mut points {
        let r2: f64 = point.iter().map(|x| x * x).sum();
        *point = point.map(|x| x * (1.0 + scene.stretch * r2));
    }
    PointSet::try_new(points, Unit::Meter)
}

/// Returns the rows of one scheme in one scene, each with the kind of its records.
fn of_scheme(
    solver: Builtin,
    original: &Original<3>,
    entry: &Entry,
    k: usize,
    typical: f64,
) -> Result<Vec<(usize, Row)>, Error> {
    let knn = oracle::search(original)?;
    let options = SchemeOptions { voxel: 5.0 * typical };
    let Some(scheme) = entry.of_dimension::<3>(&options) else { return Ok(Vec::new()) };
    let (released, secret) = obfuscate(&*scheme, original, None, &Key::from_seed(0))?;
    let near = TrueNeighbors::new(&knn, &secret, released.slots_per_record(), k)?;
    let points = original.reveal().positions();
    let mut rows = Vec::new();
    for (noise, ratios) in RATIOS {
        let outliers = Outliers::new(noise, &near, &knn, &secret, 0)?;
        for &ratio in ratios {
            let lists = near.lists(ratio, &outliers, 0)?;
            let options = RecoverOptions { seed: 1, ..RecoverOptions::default() };
            let (recovered, seen) = recover_and_look(solver, &released, &lists, &options)?;
            let every = recovered.n_slots().div_ceil(SLOTS).max(1);
            for slot in (0..recovered.n_slots()).step_by(every) {
                if let Some(position) = recovered.position(slot) {
                    let error = distance(&position, &points[secret.hidden()[slot].index()]);
                    let cues = seen.cues[slot];
                    let (error, typical) = (error / seen.radius, typical / seen.radius);
                    rows.push((seen.kind, Row { cues, error, typical }));
                }
            }
        }
    }
    Ok(rows)
}

fn constants(solver: Builtin, rows: &[Vec<Row>]) -> String {
    let all: Vec<[f32; N_TERMS]> = rows.iter().flatten().map(|row| terms(&row.cues)).collect();
    let n = all.len() as f64;
    let mean: Vec<f64> =
        (0..N_TERMS).map(|t| all.iter().map(|x| f64::from(x[t])).sum::<f64>() / n).collect();
    let spread: Vec<f32> = (0..N_TERMS)
        .map(|t| {
            let square = |x: &[f32; N_TERMS]| (f64::from(x[t]) - mean[t]).powi(2);
            ((all.iter().map(square).sum::<f64>() / n).sqrt() as f32).max(1e-3)
        })
        .collect();
    let center: Vec<f32> = mean.iter().map(|&x| x as f32).collect();
    let models: Vec<_> = rows
        .par_iter()
        .map(|rows| {
            let terms = |cues: &Cues| centered(terms(cues), &center, &spread);
            fit(rows, terms)
        })
        .collect();
    let list =
        |values: &[f32]| values.iter().map(|x| format!("{x:.3e}")).collect::<Vec<_>>().join(", ");
    let mut text = String::new();
    let _ = writeln!(
        text,
        "\npub(super) static {}: Constants = Constants {{",
        solver.name().to_uppercase()
    );
    let _ = writeln!(text, "center: [{}],\nspread: [{}],", list(&center), list(&spread));
    let _ = writeln!(text, "models: [");
    for fitted in &models {
        eprintln!("{} rows, mean negative log-likelihood {:.4}", fitted.n, fitted.loss);
        let (found, scale) = (list(&fitted.found), list(&fitted.scale));
        let _ = writeln!(text, "Model {{ found: [{found}], scale: [{scale}] }},");
    }
    let _ = writeln!(text, "] }};");
    text
}
