//! Prints the matches of held-out images and our errors as JSON, for docs/compare_poses.py.
//!
//! ```text
//! cargo run --release -p unlift-audit --example held_out_matches -- MODEL FEATURES N
//! ```

use std::path::PathBuf;

use serde_json::{Value, json};
use unlift::Unit;
use unlift::geometry::camera::Camera;
use unlift::localization::{Match, OnLine, Problem};
use unlift::obfuscate::{SchemeOptions, scheme};
use unlift::seed::Key;
use unlift_audit::{Error, Preparation, Quiet, localization, maps};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut next = || arguments.next().ok_or_else(|| Error::request("expected MODEL FEATURES N"));
    let (model, features, nth): (PathBuf, PathBuf, usize) =
        (next()?.into(), next()?.into(), next()?.parse()?);
    let preparation = Preparation { scale: Some(1.0), ..Preparation::default() };
    let prepared = maps::open(&model, None, &preparation)?;
    let cameras = &prepared.cameras;
    let mut held = localization::open(&features, nth, cameras, &prepared.original, &Quiet)?;
    let lines = scheme("lines2d")?.of_dimension::<2>(&SchemeOptions::usual(Unit::Pixel));
    let lines = lines.ok_or_else(|| Error::failed("expected lines2d in 2D"))?;
    let queries = held.with_queries(&*lines, &Key::from_seed(0))?;
    let points = held.unprotected();
    println!("{}", json!({ "point": of(&points), "lines2d": of(&queries) }));
    Ok(())
}

fn of(problems: &[Problem]) -> Vec<Value> {
    let one = |(seed, problem): (usize, &Problem)| {
        let (Camera { intrinsics, pose }, error) = (&problem.truth, problem.solve(seed as u64));
        let matches: Vec<Value> = problem.matches.iter().filter_map(flat).collect();
        json!({
            "rotation": pose.rotation, "center": pose.center, "focal": intrinsics.focal,
            "principal": intrinsics.principal, "size": problem.size, "matches": matches,
            "center_error": error.map(|error| error.center),
            "rotation_error_degrees": error.map(|error| error.rotation_degrees),
        })
    };
    problems.iter().enumerate().map(one).collect()
}

/// Returns place, direction (zero for a point) and point.
fn flat(one: &Match) -> Option<Value> {
    let Match { place, point, line } = one;
    match line {
        None => Some(json!([place, [0.0, 0.0], point])),
        Some(OnLine::OfImage(direction)) => Some(json!([place, direction, point])),
        Some(OnLine::OfMap(_)) => None,
    }
}
