//! `unlift demo`: the whole audit on a made-up room, no data needed.

use std::sync::Arc;
use std::time::Instant;

use serde_json::{Map, json};
use unlift::audit::{Measure, NeighborsBy, Plan};
use unlift::neighbors::Overlap;
use unlift::recover::Solver;
use unlift::truth::Original;
use unlift::{PointSet, Unit};
use unlift_audit::inversion::MapInversion;
use unlift_audit::maps::perform;
use unlift_audit::{Job, Shown, open_audit};
use unlift_io::atomic::Rules;
use unlift_io::hash::hash_positions;
use unlift_nn::DescriptorKind;
use unlift_report::document::Input;

use super::common::with_threads;
use super::painter::painter;
use crate::args::DemoArgs;
use crate::exit::Outcome;
use crate::output::{command_line, print};
use crate::progress::{Progress, Stderr};

/// Which of the made-up rooms.
const SEED: u64 = 0;
/// Photos that are painted.
const N_PAINTED: usize = 3;

/// Audits a furnished room.
pub fn run(args: &DemoArgs) -> anyhow::Result<Outcome> {
    let started = Instant::now();
    let out = open_audit(&args.out, Rules::new([], args.force), Shown::Points, &Stderr)?;
    let finished = with_threads(args.threads, || {
        let progress = Progress::new(args.quiet);
        if !args.quiet {
            progress.say("unlift: a made-up room is photographed and mapped");
        }
        let room = unlift_demo::room(SEED)?;
        let n_photos = room.photos.len();
        let cameras = room.photos.iter().map(|photo| photo.view.center).collect();
        let painted = room.telling(N_PAINTED)?.into_iter();
        let painted =
            painted.map(|photo| (photo.name.clone(), photo.view.clone(), photo.image.clone()));
        let inversion = Arc::new(MapInversion::of(painter(DescriptorKind::Sift, None)?, painted)?);
        let sha256 = hash_positions(&room.points);
        let original = Original::new(PointSet::try_new(room.points, Unit::Meter)?);
        let usual = Plan::new(Unit::Meter).for_map(original.len(), 50);
        let mut options = Map::new();
        options.insert("room".into(), json!({ "seed": SEED, "photos": n_photos }));
        let job = Job {
            original: &original,
            descriptors: Some(&room.descriptors),
            hidden: None,
            cameras,
            up: Some([0.0, 0.0, 1.0]),
            plan: Plan {
                neighbors: vec![NeighborsBy::Oracle, NeighborsBy::Source(Arc::new(Overlap))],
                // What it starts from would be painted, too.
                solvers: vec![Solver::Joint],
                measures: vec![Arc::clone(&inversion) as Arc<dyn Measure<3>>],
                ..usual
            },
            input: Input {
                path: Some("demo room".to_owned()),
                sha256: Some(sha256),
                n_points: original.len() as u64,
                scale_m_per_unit: Some(1.0),
                unit_in_map_units: Some(1.0),
                other_sha256: Default::default(),
                images: None,
            },
            options,
            notes: Vec::new(),
            doubts: Vec::new(),
            gates: Vec::new(),
            out: args.out.clone(),
            unit_in_map_units: 1.0,
            write_clouds: false,
            inversion: Some(inversion),
            journal: None,
            share_safe: false,
            progress: &progress,
            command: Some(command_line()),
            started,
        };
        Ok(perform(job, out)?)
    })?;
    print(&finished.text())?;
    Ok(Outcome::Done)
}
