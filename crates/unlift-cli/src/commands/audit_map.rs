//! `unlift audit map`: a map in, one honest answer out.

use std::path::Path;
use std::time::Instant;

use serde_json::{Map, Value, json};
use unlift::audit::{Plan, PointNeighbors, Source};
use unlift::geometry::vector::distance;
use unlift::neighbors::sources::Joined;
use unlift_io::atomic::Rules;
use unlift_io::hash::{hash_file, hash_files};
use unlift_io::read;
use unlift_io::stage::read_point_neighborhoods;
use unlift_report::document::Input;

use super::plan::{attack, check_about, check_fit, own, solvers, summary, thresholds};
use super::{open_map, with_threads};
use crate::args::AuditMapArgs;
use crate::document::ordered;
use crate::exit::{Outcome, advise, usage};
use crate::job::{Job, perform};
use crate::lengths::check_thresholds;
use crate::output::print;
use crate::outputs::{Shown, open_audit};
use crate::prepare::Prepared;
use crate::values::{NeighborSource, all_schemes, distinct};

/// Audits a map.
pub fn run(args: AuditMapArgs) -> anyhow::Result<Outcome> {
    let started = Instant::now();
    let shown = match (args.result.share_safe, args.write_clouds) {
        (true, _) => Shown::Figures,
        (false, true) => Shown::Clouds,
        (false, false) => Shown::Points,
    };
    let out = open_audit(&args.result.out, rules(&args), shown)?;
    let finished = with_threads(args.run.threads, || {
        let (input, prepared) = open_map(&args.path, &args.map, args.run.quiet)?;
        if let Some(note) = thinned(&args, &prepared, input.positions.len()) {
            eprintln!("unlift: note: {note}");
        }
        let scale = 1.0 / prepared.unit_in_map_units;
        let job = Job {
            original: &prepared.original,
            descriptors: prepared.descriptors.as_ref(),
            hidden: None,
            cameras: input.cameras.iter().map(|c| c.map(|x| x * scale)).collect(),
            up: input.up,
            plan: plan(&args, &prepared, &input)?,
            input: provenance(&args, &input, &prepared)?,
            options: more_options(&args),
            gates: args.result.gate.clone(),
            out: args.result.out.clone(),
            unit_in_map_units: prepared.unit_in_map_units,
            write_clouds: args.write_clouds,
            share_safe: args.result.share_safe,
            quiet: args.run.quiet,
            started,
        };
        perform(job, out)
    })?;
    print(&if args.result.json { summary(&finished)? } else { finished.text() })?;
    Ok(if finished.passed() { Outcome::Done } else { Outcome::GateFailed })
}

/// What a user should know who audits a part of a map: its figures are too small for the whole.
fn thinned(args: &AuditMapArgs, prepared: &Prepared, n_read: usize) -> Option<String> {
    let (most, n) = (args.map.max_points?.get(), prepared.rows.len());
    (n == most && n < n_read).then(|| {
        format!(
            "--max-points: {n} of {n_read} points are audited, and neighbors are farther apart: of the whole map \
             more comes back"
        )
    })
}

/// What must not be written over.
fn rules(args: &AuditMapArgs) -> Rules {
    let lists = args.neighbors.iter().filter_map(|source| match source {
        NeighborSource::File(path) => Some(path.as_path()),
        NeighborSource::Oracle | NeighborSource::Own(_) => None,
    });
    let inputs = [args.path.as_path()].into_iter().chain(args.map.descriptors.as_deref());
    Rules::new(inputs.chain(lists), args.result.force)
}

fn plan(args: &AuditMapArgs, prepared: &Prepared, input: &read::Input) -> anyhow::Result<Plan> {
    let k = usize::from(args.map.k);
    let usual = Plan::new(prepared.original.reveal().unit()).for_map(prepared.original.len(), k);
    let schemes = if args.schemes.is_empty() { all_schemes() } else { args.schemes.clone() };
    let thresholds = thresholds(&args.thresholds, &usual)?;
    let points = prepared.original.reveal();
    let typed = !args.thresholds.is_empty();
    if let Some(note) = check_thresholds(points.positions(), points.unit(), &thresholds, typed)? {
        eprintln!("unlift: note: {note}");
    }
    Ok(Plan {
        sources: sources(args, prepared, input)?,
        schemes: distinct(schemes, |a, b| a.name == b.name),
        k,
        solvers: solvers(&args.solver, &usual),
        records_alone: !args.no_records_alone,
        thresholds,
        seed: args.map.seed.unwrap_or(0),
        ..attack(&args.attack, usual)
    })
}

/// Every source once, and no option that would be about none of them.
fn sources(
    args: &AuditMapArgs,
    prepared: &Prepared,
    input: &read::Input,
) -> anyhow::Result<Vec<Source>> {
    let mut sources = Vec::new();
    for source in distinct(args.neighbors.clone(), |a, b| a == b) {
        sources.push(match source {
            NeighborSource::Oracle => Source::Oracle,
            NeighborSource::Own(joined) => {
                check_own(&joined, prepared, input)?;
                if let Some(note) = joined.note(prepared.original.len()) {
                    eprintln!("unlift: note: {note}");
                }
                own(joined, &args.attack)
            }
            NeighborSource::File(path) => {
                Source::Given(by_point(&path, prepared, input.positions.len())?)
            }
        });
    }
    let files = sources.iter().filter(|s| matches!(s, Source::Given(_))).count();
    if files > 1 {
        return Err(usage(format!("--neighbors: expected at most one file, found {files}")));
    }
    check_about(&args.attack, &sources)?;
    Ok(sources)
}

/// Refuses a source that lacks what it needs, before anything is computed.
fn check_own(joined: &Joined, prepared: &Prepared, input: &read::Input) -> anyhow::Result<()> {
    let name = joined.name();
    match &prepared.descriptors {
        None if joined.needs_descriptors() => {
            let text = "expected descriptors (--descriptors FILE), found none";
            let error = usage(format!("--neighbors {name}: {text}"));
            return Err(match &input.database {
                Some(database) => advise(error, format!("--descriptors {}", database.display())),
                None => error,
            });
        }
        None => {}
        Some(descriptors) => check_fit(joined, descriptors)?,
    }
    Ok(())
}

/// Lists by row of the file, for the rows that were kept.
pub(super) fn by_point(
    path: &Path,
    prepared: &Prepared,
    n_read: usize,
) -> anyhow::Result<PointNeighbors> {
    let lists = read_point_neighborhoods(path, n_read)?;
    let mut kept_as = vec![None; n_read];
    for (kept, &row) in prepared.rows.iter().enumerate() {
        kept_as[row as usize] = Some(kept as u32);
    }
    let (mut offsets, mut neighbors) = (vec![0u64], Vec::new());
    let mut scores = lists.scores().map(|_| Vec::new());
    for &row in &prepared.rows {
        let start = lists.offsets()[row as usize] as usize;
        for (at, &neighbor) in lists.of(row as usize).iter().enumerate() {
            if let Some(kept) = kept_as[neighbor as usize] {
                neighbors.push(kept);
                if let (Some(scores), Some(all)) = (&mut scores, lists.scores()) {
                    scores.push(all[start + at]);
                }
            }
        }
        offsets.push(neighbors.len() as u64);
    }
    for note in doubts(&offsets, &neighbors, prepared) {
        eprintln!("unlift: note: {}: {note}", path.display());
    }
    // Which file it was stands in the hashes; a file called oracle must not pass for one.
    let name = "file".to_owned();
    Ok(PointNeighbors { name, offsets, neighbors, scores })
}

/// What speaks against given lists: with lists of another map little comes back, and that is no protection.
fn doubts(offsets: &[u64], neighbors: &[u32], prepared: &Prepared) -> Vec<String> {
    let points = prepared.original.reveal().positions();
    let mut doubts = Vec::new();
    let empty = offsets.windows(2).filter(|w| w[0] == w[1]).count();
    if empty > 0 {
        let n = points.len();
        doubts.push(format!("{empty} of {n} points have no neighbors in it: they count as lost"));
    }
    let (mut nearer, mut n) = (0usize, 0usize);
    for (point, w) in offsets.windows(2).enumerate() {
        for &neighbor in &neighbors[w[0] as usize..w[1] as usize] {
            // A stranger of each, spread over the map by a large odd factor.
            let stranger = (n * 7919 + 3) % points.len();
            let to = |other: usize| distance(&points[point], &points[other]);
            nearer += usize::from(to(neighbor as usize) < to(stranger));
            n += 1;
        }
    }
    // Of strangers half are nearer; two standard deviations on top.
    if n > 0 && nearer as f64 <= 0.5 * n as f64 + (n as f64).sqrt() {
        doubts.push(format!(
            "the neighbors in it are no nearer than any points ({nearer} of {n}): of another map, or in another order \
             of rows?"
        ));
    }
    doubts
}

fn provenance(
    args: &AuditMapArgs,
    input: &read::Input,
    prepared: &Prepared,
) -> anyhow::Result<Input> {
    let mut others = Vec::new();
    if let Some(path) = &args.map.descriptors {
        others.push(("descriptors".to_owned(), hash_file(path)?));
    }
    for source in &args.neighbors {
        if let NeighborSource::File(path) = source {
            others.push(("neighbors".to_owned(), hash_file(path)?));
        }
    }
    Ok(Input {
        path: Some(args.path.display().to_string()),
        sha256: Some(hash_files(&input.files)?),
        n_points: prepared.original.len() as u64,
        scale_m_per_unit: args.map.scale,
        unit_in_map_units: Some(prepared.unit_in_map_units),
        other_sha256: ordered(others),
        images: None,
    })
}

/// Options that change the points, not the plan.
fn more_options(args: &AuditMapArgs) -> Map<String, Value> {
    let mut options = Map::new();
    if let Some(most) = args.map.max_points {
        options.insert("max_points".into(), json!(most.get()));
    }
    if let Some(filter) = args.map.outlier_filter {
        let value = json!({ "neighbors": filter.neighbors, "std_ratio": filter.std_ratio });
        options.insert("outlier_filter".into(), value);
    }
    options
}

#[cfg(test)]
mod tests {
    use super::*;
    use unlift::truth::Original;
    use unlift::{PointSet, Unit};

    /// Lists of the next few of 200 points on a line; with a factor other than 1, of other points.
    fn doubts_about(factor: usize, length: usize) -> Vec<String> {
        let n = 200;
        let points = (0..n).map(|i| [0.1 * i as f64, 0.0, 0.0]).collect();
        let points = PointSet::try_new(points, Unit::Meter).unwrap();
        let prepared = Prepared {
            original: Original::new(points),
            descriptors: None,
            unit_in_map_units: 1.0,
            rows: (0..n as u32).collect(),
        };
        let offsets: Vec<u64> = (0..=n).map(|point| (point * length) as u64).collect();
        let row = |point: usize| (1..=length).map(move |step| (point * factor + step) % n);
        let neighbors: Vec<u32> = (0..n).flat_map(row).map(|other| other as u32).collect();
        doubts(&offsets, &neighbors, &prepared)
    }

    #[test]
    fn lists_that_cannot_be_of_the_map_are_doubted() {
        assert!(doubts_about(1, 5).is_empty());
        let of_another = doubts_about(77, 5);
        assert_eq!(of_another.len(), 1);
        assert!(of_another[0].starts_with("the neighbors in it are no nearer than any points"));
        let empty = doubts_about(1, 0);
        assert_eq!(empty, ["200 of 200 points have no neighbors in it: they count as lost"]);
    }
}
