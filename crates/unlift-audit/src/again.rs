//! Audits of a map that is released twice: each release is hidden under its own key, and the
//! attacker, who has both, intersects their records.
//!
//! ```text
//! two maps ──obfuscate──> two releases ──again──> recovered points of the first
//! ```

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use serde_json::{Map, Value, json};
use unlift::Unit;
use unlift::again::{Solved, by_descriptors, by_geometry};
use unlift::audit::{NotAudited, Plan, Row, Seconds};
use unlift::audit::{measure, records_alone, scheme_called};
use unlift::evaluate::{blind, joined};
use unlift::geometry::knn::Knn;
use unlift::geometry::vector::distance;
use unlift::obfuscate::{Scheme, obfuscate};
use unlift::released::Released;
use unlift::seed::Key;
use unlift::truth::{Original, Secret};
use unlift_io::hash::hash_input;
use unlift_io::outputs::OutputSet;
use unlift_io::read;
use unlift_report::RenderOptions;
use unlift_report::document::Input;

use crate::Progress;
use crate::document::{self, Found, Provenance, names, only_named, ordered};
use crate::doubts::{sides_m, with_extent};
use crate::gate::{Gate, check_gates, check_lengths_of_gates, gate_results};
use crate::outputs::{Audited, Finished};
use crate::prepare::{Preparation, Prepared};
use crate::{Error, check_stop, frames, maps};

/// The solver of all rows.
const SOLVER: &str = "intersection";
/// Links that the attacker makes from descriptors.
const AGAIN: &str = "again";
/// Links that the attacker makes from records alone.
const GEOMETRY: &str = "again-geometry";

/// The two maps of an audit, in one unit.
pub struct Maps {
    /// The first map, whose points are to be recovered.
    pub first: (read::Input, Prepared),
    /// The second map; `None` if it is the first one again.
    pub second: Option<(read::Input, Prepared)>,
}

/// Reads two maps, each with its file of descriptors. Lengths of both are in the unit of the first.
pub fn open([a, b]: [(&Path, Option<&Path>); 2], preparation: &Preparation) -> Result<Maps, Error> {
    let first = maps::open(a.0, a.1, preparation)?;
    if a == b {
        return Ok(Maps { first, second: None });
    }
    let (input, mut prepared) = maps::open(b.0, b.1, preparation)?;
    let points = prepared.original.reveal();
    if points.unit() == Unit::KthNeighbor {
        let factor = prepared.unit_in_map_units / first.1.unit_in_map_units;
        let points = points.scaled(factor, Unit::KthNeighbor);
        let points = points.map_err(|error| unlift_io::Error::core(b.0, error))?;
        prepared.original = Original::new(points);
    }
    Ok(Maps { first, second: Some((input, prepared)) })
}

/// The inputs of an audit of a map that is released twice.
pub struct AgainJob<'a> {
    /// The maps.
    pub maps: &'a Maps,
    /// Their paths as typed.
    pub paths: [&'a Path; 2],
    /// Schemes of the first and of the second release.
    pub pairs: Vec<[Arc<dyn Scheme<3>>; 2]>,
    /// The plan: thresholds, seed, and whether records alone are attacked. [`perform`] fills in the
    /// rest.
    pub plan: Plan<3>,
    /// Recorded options, in addition to those of the plan.
    pub options: Map<String, Value>,
    /// Notes for readers of the figures.
    pub notes: Vec<String>,
    /// Doubts about all figures. No gate holds with one.
    pub doubts: Vec<String>,
    /// The gates.
    pub gates: Vec<Gate>,
    /// The output folder.
    pub out: PathBuf,
    /// Writes figures only.
    pub share_safe: bool,
    /// Receives the progress.
    pub progress: &'a dyn Progress,
    /// The command line, for the record.
    pub command: Option<String>,
    /// The start of the command.
    pub started: Instant,
}

/// Runs the job and writes its folder, completely or not at all.
///
/// # Errors
/// If a scheme cannot hide a map, a gate has no row, `progress` stops the audit, or the folder
/// cannot be written.
pub fn perform(mut job: AgainJob<'_>, out: OutputSet) -> Result<Finished, Error> {
    let (first, second) = (&job.maps.first, job.maps.second.as_ref().unwrap_or(&job.maps.first));
    let described = first.1.descriptors.is_some() && second.1.descriptors.is_some();
    job.plan.schemes = job.pairs.iter().map(|pair| scheme_called(&name(pair))).collect();
    let sources = if described { &[AGAIN, GEOMETRY][..] } else { &[GEOMETRY] };
    job.plan.neighbors = sources.iter().map(|by| only_named((*by).to_owned())).collect();
    check_gates(&job.gates, &job.plan, false)?;
    check_lengths_of_gates(first.1.original.reveal(), &job.gates)?;
    if !described {
        job.notes.push("links by geometry only: both maps need descriptors for others".to_owned());
    }
    if job.maps.second.is_some() {
        job.doubts.extend(frames::doubt(&first.1, &second.1)?);
    }
    for note in job.doubts.iter().chain(&job.notes) {
        job.progress.say(&format!("note: {note}"));
    }
    let (rows, not_audited, seconds) = rows(&job, [&first.1, &second.1], sources)?;
    let doubts = vec![job.doubts.first().cloned(); rows.len()];
    let gates =
        gate_results(&job.gates, (&job.plan, described), &rows, &not_audited, &doubts, &[])?;
    let mut options = job.options.clone();
    options.extend(names(&job.plan));
    options.insert("records_alone".into(), json!(job.plan.records_alone));
    let points = first.1.original.reveal();
    let scale = 1.0 / first.1.unit_in_map_units;
    let mut provenance = Provenance {
        input: Input {
            path: Some(job.paths[0].display().to_string()),
            sha256: Some(hash_input(&first.0)?),
            n_points: points.len() as u64,
            scale_m_per_unit: (points.unit() == Unit::Meter).then_some(scale),
            unit_in_map_units: Some(first.1.unit_in_map_units),
            extent_m: sides_m(points),
            other_sha256: ordered([("second".to_owned(), hash_input(&second.0)?)]),
            ..Input::default()
        },
        options,
        notes: job.doubts.iter().chain(&job.notes).cloned().collect(),
        gates,
        command: job.command,
        started: job.started,
    };
    provenance.gates = with_extent(provenance.gates, &provenance.input);
    let found =
        Found { rows: &rows, not_audited: &not_audited, break_even: &[], seconds: &seconds };
    let document = document::document(&job.plan, &found, provenance);
    let audited = Audited { document, scene: None, drawn: RenderOptions::default() };
    audited.write(out, &job.out, job.share_safe)
}

/// Returns the name of a pair of schemes: `olc`, or `olc/cp` for two different ones.
fn name([a, b]: &[Arc<dyn Scheme<3>>; 2]) -> String {
    if a.name() == b.name() { a.name().to_owned() } else { format!("{}/{}", a.name(), b.name()) }
}

type Rows = (Vec<Row>, Vec<NotAudited>, Seconds);

/// Hides both maps under each pair of schemes and attacks them.
fn rows(
    job: &AgainJob<'_>,
    [first, second]: [&Prepared; 2],
    sources: &[&str],
) -> Result<Rows, Error> {
    let (mut rows, mut not_audited) = (Vec::new(), Vec::new());
    let mut seconds = Seconds::default();
    let (total, seed) = (job.pairs.len() * sources.len(), job.plan.seed);
    let knn = Knn::new(second.original.reveal().positions())?;
    for (at, pair) in job.pairs.iter().enumerate() {
        let scheme = name(pair);
        let show = |what: &str| {
            job.progress.show(at * sources.len(), total, &format!("{scheme}, {what}"));
            check_stop(job.progress)
        };
        show("two releases")?;
        let started = Instant::now();
        let hide = |scheme: &dyn Scheme<3>, map: &Prepared, seed: u64| {
            let key = Key::from_seed(seed);
            obfuscate(scheme, &map.original, map.descriptors.as_ref(), &key)
        };
        let a = hide(&*pair[0], first, seed)?;
        let b = hide(&*pair[1], second, seed.wrapping_add(1))?;
        seconds.obfuscate += started.elapsed().as_secs_f64();
        let alone = match job.plan.records_alone {
            true => {
                show("records alone")?;
                let started = Instant::now();
                let alone = records_alone(&a, &first.original, &job.plan, seed)?;
                seconds.records_alone += started.elapsed().as_secs_f64();
                alone
            }
            false => Vec::new(),
        };
        for &source in sources {
            show(source)?;
            let started = Instant::now();
            let by = if source == AGAIN { by_descriptors } else { by_geometry };
            let solved = match by(&a.0, &b.0) {
                Ok(solved) => solved,
                Err(error) => {
                    not_audited.push(NotAudited {
                        scheme: scheme.clone(),
                        neighbors: Some(source.to_owned()),
                        oracle_noise: None,
                        inlier_ratio: None,
                        reason: error.to_string(),
                    });
                    continue;
                }
            };
            seconds.recover += started.elapsed().as_secs_f64();
            let row =
                row(&solved, &job.plan, (&first.original, &a), (&second.original, &b.1), &knn)?;
            let (neighbors, solver) = (source.to_owned(), SOLVER.to_owned());
            let records_alone = alone.clone();
            let (scheme, k) = (scheme.clone(), 2);
            rows.push(Row { scheme, neighbors, solver, k, records_alone, ..row });
        }
    }
    if rows.is_empty() {
        let reason = not_audited.first().map_or("no schemes", |one| one.reason.as_str());
        return Err(Error::request(format!("audit again: expected a row, found none: {reason}")));
    }
    seconds.rows = vec![Default::default(); rows.len()];
    Ok((rows, not_audited, seconds))
}

/// Measures what came back of the first map. A link is right if no point of the second map is nearer
/// to the first one's.
fn row(
    solved: &Solved,
    plan: &Plan<3>,
    (original, (released, secret)): (&Original<3>, &(Released<3>, Secret)),
    (other, other_secret): (&Original<3>, &Secret),
    knn: &Knn<'_, 3>,
) -> Result<Row, unlift::Error> {
    let baseline = blind(released, original, secret);
    let (mut row, accuracy) =
        measure(&solved.recovered, original, secret, Some(&baseline), &plan.thresholds)?;
    let own = joined(&solved.recovered, original, secret);
    let (points, others) = (original.reveal().positions(), other.reveal().positions());
    let per_record = other_secret.slots_per_record();
    let headline = &plan.thresholds[plan.headline];
    let (mut n_linked, mut n_right, mut n_within) = (0, 0, 0);
    let mut found = Vec::new();
    for (slot, link) in solved.links.iter().enumerate() {
        let Some(record) = link else { continue };
        let point = &points[own.hidden()[slot].index()];
        knn.nearest_to(*point, 1, &mut found);
        let nearest = found.first().map_or(f64::INFINITY, |nearest| nearest.0.sqrt());
        let slots = *record as usize * per_record..(*record as usize + 1) * per_record;
        let away = |hidden: &unlift::OriginalId| distance(&others[hidden.index()], point);
        n_right += usize::from(other_secret.hidden()[slots].iter().any(|at| away(at) <= nearest));
        n_linked += 1;
        n_within += usize::from(accuracy.errors()[slot] <= headline.value);
    }
    let percent = |n: usize, of: usize| 100.0 * n as f64 / of.max(1) as f64;
    row.inlier_ratio = percent(n_right, n_linked) / 100.0;
    row.metrics.extend([
        ("linked_percent".to_owned(), percent(n_linked, row.n_points)),
        (format!("linked_within_{}_percent", headline.label), percent(n_within, n_linked)),
        ("open_percent".to_owned(), percent(solved.n_open, row.n_points)),
    ]);
    Ok(row)
}
