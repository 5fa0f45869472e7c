//! Audit with a custom source of neighborhoods and a custom solver: `cargo run --release -p unlift-testkit --example own_attack`.
//!
//! The source lists the records whose descriptors have the most similar mean. Your source may contain
//! trained weights as fields. The solver returns, on each line, the median of the nearest points to the
//! listed lines. Most of these must belong to true neighbors, so it fails where `joint` does not.

use std::sync::Arc;

use unlift::audit::{NeighborsBy, Plan, Silent, run};
use unlift::neighbors::{Needs, Neighborhoods, Similarity, Source};
use unlift::obfuscate::olc;
use unlift::recover::{Builtin, RecoverOptions, Recovered, Solver};
use unlift::released::{Obfuscation, Released};
use unlift::{About, Error, RecordId, RowOrder, Unit};

/// Lists records with similar brightness.
#[derive(Debug)]
struct Brightness;

impl Source<3> for Brightness {
    fn name(&self) -> &str {
        "brightness"
    }

    fn needs(&self) -> Needs {
        Needs::Descriptors
    }

    fn k(&self, _: &Released<3>) -> usize {
        20
    }

    fn lists(&self, released: &Released<3>, k: usize, _: u64) -> Result<Neighborhoods, Error> {
        self.supports(released)?;
        let (n, Some(descriptors)) = (released.n_records(), released.descriptors()) else {
            return Err(Error::new("descriptors", "some", "none"));
        };
        if released.slots_per_record() != 1 {
            return Err(Error::new("records", "one hidden point each", "paired lines"));
        }
        let bright: Vec<f32> = descriptors.rows().map(|row| row.iter().sum()).collect();
        let near = |own: usize| {
            let unlike = |other: &usize| (bright[*other] - bright[own]).abs();
            let mut others: Vec<usize> = (0..n).filter(|&other| other != own).collect();
            others.sort_by(|a, b| unlike(a).total_cmp(&unlike(b)));
            others.into_iter().take(k).map(RecordId::from_index)
        };
        let records: Vec<RecordId> = (0..n).flat_map(near).collect();
        let k = k.min(n.saturating_sub(1));
        let offsets = (0..=n).map(|record| (record * k) as u64).collect();
        // Rows are descriptor rows. With one point per record these are the slots.
        let (map, order) = (Some(released.fingerprint()), RowOrder::DescriptorRows);
        let lists = Neighborhoods::try_new(offsets, records, None, n, 1)?;
        Ok(lists.with_about(About { map, order, ..About::default() }))
    }
}

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
            return Err(Error::new("records", "lines", released.obfuscation().family()));
        };
        // Feet, directions and positions are relative to `released.origin()`.
        let line = |record: usize| (lines.foot()[record], lines.direction()[record]);
        let position = |slot: usize| {
            let own @ (foot, direction) = line(slot / released.slots_per_record());
            let places = lists.of(slot).iter().map(|record| nearest(own, line(record.index())));
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

/// Returns where the line through `a` is nearest to that through `b`, by unit directions.
fn nearest((a, u): ([f32; 3], [f32; 3]), (b, v): ([f32; 3], [f32; 3])) -> f32 {
    let dot = |x: [f32; 3], y: [f32; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    let between: [f32; 3] = std::array::from_fn(|c| b[c] - a[c]);
    let cosine = dot(u, v);
    (dot(between, u) - cosine * dot(between, v)) / (1.0 - cosine * cosine)
}

fn main() -> Result<(), Error> {
    // Call these in tests of your crate. They check for one list and one result per slot, which do not depend on the number of threads.
    let (original, released, secret) = unlift_testkit::described_map(&olc::ENTRY, 1_500);
    unlift_testkit::source_laws(&Brightness, &released);
    let lists = Brightness.lists(&released, 20, 0)?;
    unlift_testkit::solver_laws(&Median, &released, &lists);

    // An audit needs one descriptor per original, because it hides the map itself.
    let mut row_of = vec![0; original.len()];
    for (slot, id) in secret.hidden().iter().enumerate() {
        row_of[id.index()] = slot as u32;
    }
    let descriptors = released.descriptors().map(|descriptors| descriptors.select(&row_of));
    let by = |source: Arc<dyn Source<3>>| NeighborsBy::Source(source);
    let plan = Plan {
        schemes: vec![Arc::new(olc::ENTRY)],
        neighbors: vec![by(Arc::new(Brightness)), by(Arc::new(Similarity)), NeighborsBy::Oracle],
        solvers: vec![Arc::new(Median), Arc::new(Builtin::Joint)],
        ..Plan::new(Unit::Meter)
    };
    println!("source      solver  right    within 0.10 and 0.25 m, percent");
    for row in run(&original, descriptors.as_ref(), &plan, &mut Silent)?.rows {
        let (right, share) = (100.0 * row.inlier_ratio, row.recovered_percent);
        println!("{:11} {:7} {right:4.1} %  {share:.1?}", row.neighbors, row.solver);
    }
    Ok(())
}
