//! Audit of a custom source of neighborhoods: `cargo run --release -p unlift-testkit --example
//! own_source`.
//!
//! The source sorts records by the mean of their descriptors and lists the next ones in this order.
//! This is a weak attack. Your source may contain trained weights as fields.

use std::sync::Arc;

use unlift::audit::{NeighborsBy, Plan, Silent, run};
use unlift::neighbors::{Needs, Neighborhoods, Similarity, Source};
use unlift::obfuscate::olc::Olc;
use unlift::released::Released;
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

    fn supports(&self, released: &Released<3>) -> Result<(), Error> {
        if released.slots_per_record() != 1 {
            return Err(Error::new("records", "one hidden point each", "paired lines"));
        }
        released.descriptors().map(|_| ()).ok_or_else(lacking)
    }

    fn lists(&self, released: &Released<3>, k: usize, _: u64) -> Result<Neighborhoods, Error> {
        self.supports(released)?;
        let descriptors = released.descriptors().ok_or_else(lacking)?;
        let n = released.n_records();
        let mut row = vec![0.0; descriptors.dim()];
        let mut brightness = |at: usize| {
            descriptors.read_row(at, &mut row);
            row.iter().sum::<f32>()
        };
        let bright: Vec<f32> = (0..n).map(&mut brightness).collect();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| bright[a].total_cmp(&bright[b]));
        let mut place = vec![0; n];
        order.iter().enumerate().for_each(|(at, &record)| place[record] = at);
        let (mut offsets, mut records) = (vec![0], Vec::new());
        for &at in &place {
            let first = at.saturating_sub(k / 2).min(n.saturating_sub(k + 1));
            let near = (first..n).filter(|&other| other != at).take(k);
            records.extend(near.map(|other| RecordId::from_index(order[other])));
            offsets.push(records.len() as u64);
        }
        // Rows are descriptor rows. With one point per record these are the slots.
        let about = About {
            map: Some(released.fingerprint()),
            order: RowOrder::DescriptorRows,
            ..About::default()
        };
        Ok(Neighborhoods::try_new(offsets, records, None, n, 1)?.with_about(about))
    }
}

fn lacking() -> Error {
    Error::new("descriptors", "some", "none")
}

fn main() -> Result<(), Error> {
    // Call this in a test of your crate. It checks for one list per slot that states its map and
    // does not depend on the number of threads.
    let (original, released, secret) = unlift_testkit::described_map(&Olc, 1_500);
    unlift_testkit::source_laws(&Brightness, &released);

    // An audit needs one descriptor per original, because it hides the map itself.
    let mut row_of = vec![0; original.len()];
    for (slot, id) in secret.hidden().iter().enumerate() {
        row_of[id.index()] = slot as u32;
    }
    let descriptors = released.descriptors().map(|descriptors| descriptors.select(&row_of));
    let plan = Plan {
        schemes: vec![Arc::new(Olc)],
        neighbors: vec![
            NeighborsBy::Source(Arc::new(Brightness)),
            NeighborsBy::Source(Arc::new(Similarity)),
        ],
        ..Plan::new(Unit::Meter)
    };
    for row in run(&original, descriptors.as_ref(), &plan, &mut Silent)?.rows {
        let (right, near) = (100.0 * row.inlier_ratio, row.recovered_percent[1]);
        println!(
            "{:10} {:11} {right:4.1} % right, {near:4.1} % within 0.25 m",
            row.neighbors, row.solver
        );
    }
    Ok(())
}
