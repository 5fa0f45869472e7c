//! Audit of a custom scheme: `cargo run --release -p unlift-testkit --example own_scheme`.
//!
//! The attacks support four families of records (lines, rays, axis planes, axis candidates). This
//! scheme publishes almost upright lines. Is it safer than lines in all directions?

use std::sync::Arc;

use unlift::audit::{Plan, Silent, run};
use unlift::obfuscate::{Lifted, LocalPoints, Scheme, olc};
use unlift::released::{Lines, Obfuscation};
use unlift::seed::{Key, Stage};
use unlift::truth::Original;
use unlift::{Error, PointSet, Unit, synthetic};

/// A line through every point, tilted from the vertical by a random direction.
#[derive(Debug)]
struct Tilted {
    /// Maximum tangent of the tilt.
    most: f64,
}

impl Scheme<3> for Tilted {
    fn name(&self) -> &str {
        "tilted"
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        vec![("tilt", self.most)]
    }

    fn lift(&self, points: &LocalPoints<'_, 3>, key: &Key) -> Result<Lifted<3>, Error> {
        let (points, key) = (points.positions, key.stage(Stage::Scheme));
        let direction = |row: usize| {
            let mut draws = key.draws(row as u64);
            let [x, y] = draws.direction::<2>();
            let tilt = self.most * draws.between(0.0, 1.0);
            [tilt * x, tilt * y, 1.0]
        };
        let directions: Vec<[f64; 3]> = (0..points.len()).map(direction).collect();
        Ok(Lifted::one_each(Obfuscation::Lines(Lines::through(points, &directions)?)))
    }
}

fn main() -> Result<(), Error> {
    // Call this in a test of your crate. It checks that the scheme hides every point, on its record, and depends only on the key.
    unlift_testkit::scheme_laws(&Tilted { most: 0.5 });

    let room = Original::new(PointSet::try_new(synthetic::room(1, 3_000).points, Unit::Meter)?);
    let plan = Plan {
        schemes: vec![Arc::new(olc::ENTRY), Arc::new(Tilted { most: 0.5 })],
        ..Plan::new(Unit::Meter).for_map(3_000, 50)
    };
    println!("scheme   right  within 0.10 and 0.25 m, by the strongest attack");
    let outcome = run(&room, None, &plan, &mut Silent)?;
    for scheme in &plan.schemes {
        for &ratio in &plan.inlier_ratios {
            let rows = outcome.rows.iter();
            let rows = rows.filter(|row| row.scheme == scheme.name() && row.inlier_ratio == ratio);
            let best =
                rows.max_by(|a, b| a.recovered_percent[0].total_cmp(&b.recovered_percent[0]));
            if let Some(row) = best {
                let (near, far) = (row.recovered_percent[0], row.recovered_percent[1]);
                println!("{:8} {ratio:>5}  {near:5.1} {far:5.1} %, {}", row.scheme, row.solver);
            }
        }
    }
    Ok(())
}
