//! Audit of a custom solver: `cargo run --release -p unlift-testkit --example own_solver`.
//!
//! Each listed line has a nearest point on the slot's own line. The solver returns the median of
//! these points. Most listed lines must belong to true neighbors, so it fails at low inlier ratios,
//! where `joint` does not.

use std::sync::Arc;

use unlift::audit::{Plan, Silent, run};
use unlift::neighbors::Neighborhoods;
use unlift::neighbors::oracle::{TrueNeighbors, search};
use unlift::obfuscate::olc::Olc;
use unlift::recover::{Builtin, RecoverOptions, Recovered, Solver};
use unlift::released::{Obfuscation, Released};
use unlift::truth::Original;
use unlift::{Error, PointSet, Unit, synthetic};

/// The median of the nearest points to the listed lines.
#[derive(Debug)]
struct Median;

impl Solver<3> for Median {
    fn name(&self) -> &str {
        "median"
    }

    fn recover(
        &self,
        released: &Released<3>,
        lists: &Neighborhoods,
        _: &RecoverOptions,
    ) -> Result<Recovered<3>, Error> {
        let Obfuscation::Lines(lines) = released.obfuscation() else {
            // An error states the place, what was expected and what was found.
            return Err(Error::new("records", "lines", released.obfuscation().family()));
        };
        // Feet, directions and positions are relative to `released.origin()`.
        let position = |slot: usize| {
            let own = slot / released.slots_per_record();
            let (foot, direction) = (lines.foot()[own], lines.direction()[own]);
            let places = lists.of(slot).iter().map(|record| {
                let other = record.index();
                nearest(foot, direction, lines.foot()[other], lines.direction()[other])
            });
            let mut places: Vec<f32> = places.filter(|t| t.is_finite()).collect();
            places.sort_unstable_by(f32::total_cmp);
            // A position that is not finite means that the point was not recovered.
            let t = places.get(places.len() / 2).copied().unwrap_or(f32::NAN);
            std::array::from_fn(|c| foot[c] + t * direction[c])
        };
        let positions: Vec<[f32; 3]> = (0..released.n_slots()).map(position).collect();
        Recovered::from_positions(released, lists, &positions)
    }
}

/// Returns the parameter on the line through `a` of the point nearest to the line through `b`. The
/// directions `u` and `v` have length 1.
fn nearest(a: [f32; 3], u: [f32; 3], b: [f32; 3], v: [f32; 3]) -> f32 {
    let dot = |x: [f32; 3], y: [f32; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    let between: [f32; 3] = std::array::from_fn(|c| b[c] - a[c]);
    let cosine = dot(u, v);
    (dot(between, u) - cosine * dot(between, v)) / (1.0 - cosine * cosine)
}

fn main() -> Result<(), Error> {
    // Call this in a test of your crate. It checks for a result for every slot that does not depend
    // on the number of threads.
    let (original, released, secret) = unlift_testkit::described_map(&Olc, 1_000);
    let lists = TrueNeighbors::new(&search(&original)?, &secret, 1, 20)?.at_inlier_ratio(0.5, 1)?;
    unlift_testkit::solver_laws(&Median, &released, &lists);

    // The map is large enough for K = 50. On smaller maps `joint` is not the strongest attack.
    let room = Original::new(PointSet::try_new(synthetic::room(1, 10_000).points, Unit::Meter)?);
    let plan = Plan {
        schemes: vec![Arc::new(Olc)],
        solvers: vec![Arc::new(Median), Arc::new(Builtin::Joint)],
        inlier_ratios: vec![1.0, 0.5, 0.1],
        ..Plan::new(Unit::Meter)
    };
    println!("inlier ratio  solver  percent recovered within 0.10 and 0.25 m");
    for row in run(&room, None, &plan, &mut Silent)?.rows {
        println!("{:>12}  {:6}  {:.1?}", row.inlier_ratio, row.solver, row.recovered_percent);
    }
    Ok(())
}
