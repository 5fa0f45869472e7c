//! `unlift demo`: the whole audit on a made-up room, no data needed.

use std::time::Instant;

use serde_json::{Map, json};
use unlift::audit::Plan;
use unlift::truth::Original;
use unlift::{PointSet, Unit, synthetic};
use unlift_audit::maps::perform;
use unlift_audit::{Job, Shown, open_audit};
use unlift_io::atomic::Rules;
use unlift_io::hash::hash_positions;
use unlift_report::document::Input;

use super::common::with_threads;
use crate::args::DemoArgs;
use crate::exit::Outcome;
use crate::output::{command_line, print};
use crate::progress::{Progress, Stderr};

/// Points of the room.
const N_POINTS: usize = 20_000;

/// Audits a furnished room.
pub fn run(args: &DemoArgs) -> anyhow::Result<Outcome> {
    let started = Instant::now();
    let out = open_audit(&args.out, Rules::new([], args.force), Shown::Points, &Stderr)?;
    let room = synthetic::room(0, N_POINTS);
    let sha256 = hash_positions(&room.points);
    let original = Original::new(PointSet::try_new(room.points, Unit::Meter)?);
    let mut options = Map::new();
    options.insert("room".into(), json!({ "seed": 0, "points": N_POINTS }));
    let finished = with_threads(args.threads, || {
        let progress = Progress::new(args.quiet);
        let job = Job {
            original: &original,
            descriptors: None,
            hidden: None,
            cameras: room.cameras.iter().map(|camera| camera.center).collect(),
            up: None,
            plan: Plan::new(Unit::Meter),
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
            gates: Vec::new(),
            out: args.out.clone(),
            unit_in_map_units: 1.0,
            write_clouds: false,
            inversion: None,
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
