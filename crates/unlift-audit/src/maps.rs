//! One audit from a prepared map to the files in its folder: what `audit map` and `demo` share.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use unlift::audit::{Cell, Observer, Plan, Row, run, run_released};
use unlift::recover::Solver;
use unlift::released::Released;
use unlift::truth::{Original, Secret};
use unlift::{Descriptors, Unit};
use unlift_io::atomic::OutputSet;
use unlift_io::hash::hash_files;
use unlift_io::read;
use unlift_report::document::Input;
use unlift_report::inversions::Inversion as Sheet;
use unlift_report::{ErrorCdf, RenderOptions};

use crate::Error;
use crate::audited::{Audited, Finished};
use crate::clouds::Clouds;
use crate::document::{self, Provenance, ordered};
use crate::doubts::doubts;
use crate::gate::{Gate, check_gates, gate_results};
use crate::inversion::MapInversion;
use crate::lengths::{check_lengths_of_gates, check_scale};
use crate::prepare::{Preparation, Prepared, prepare};
use crate::progress::{Progress, Quiet};
use crate::scene::Pictures;

/// Everything an audit needs.
pub struct Job<'a> {
    /// The points, in the unit of the audit.
    pub original: &'a Original<3>,
    /// One row per point.
    pub descriptors: Option<&'a Descriptors>,
    /// What is released of them and the secret, where they are hidden already.
    pub hidden: Option<&'a (Released<3>, Secret)>,
    /// Camera centers in the unit of the audit, for the picture.
    pub cameras: Vec<[f64; 3]>,
    /// The direction that is up in the picture, where known.
    pub up: Option<[f64; 3]>,
    /// What is to be done.
    pub plan: Plan<3>,
    /// What was read.
    pub input: Input,
    /// Options for the record, beside those in the plan.
    pub options: serde_json::Map<String, serde_json::Value>,
    /// What whoever reads the figures must know; told to `progress` as well.
    pub notes: Vec<String>,
    /// Bounds to hold.
    pub gates: Vec<Gate>,
    /// Folder to write.
    pub out: PathBuf,
    /// Length of the audit's unit in map units; clouds are written in map units.
    pub unit_in_map_units: f64,
    /// Also write clouds.
    pub write_clouds: bool,
    /// Figures only.
    pub share_safe: bool,
    /// Makes pictures of what comes back; the plan measures with it, too.
    pub inversion: Option<Arc<MapInversion>>,
    /// Hears how it goes.
    pub progress: &'a dyn Progress,
    /// The command line, for the record.
    pub command: Option<String>,
    /// When the command began.
    pub started: Instant,
}

impl<'a> Job<'a> {
    /// The default audit of the map at `path`, as [`open`] read it, into the folder `out`.
    ///
    /// # Errors
    /// When the files of the map cannot be read again, for their hash.
    pub fn new(
        path: &Path,
        input: &read::Input,
        prepared: &'a Prepared,
        out: &Path,
        started: Instant,
    ) -> Result<Self, Error> {
        let points = prepared.original.reveal();
        let scale = 1.0 / prepared.unit_in_map_units;
        Ok(Self {
            original: &prepared.original,
            descriptors: prepared.descriptors.as_ref(),
            hidden: None,
            cameras: input.cameras.iter().map(|c| c.map(|x| x * scale)).collect(),
            up: input.up,
            plan: Plan::new(points.unit()).for_map(points.len(), USUAL_K),
            input: Input {
                path: Some(path.display().to_string()),
                sha256: Some(hash_files(&input.files)?),
                n_points: prepared.original.len() as u64,
                scale_m_per_unit: (points.unit() == Unit::Meter).then_some(scale),
                unit_in_map_units: Some(prepared.unit_in_map_units),
                other_sha256: ordered([]),
                images: None,
            },
            options: serde_json::Map::new(),
            notes: prepared.notes.clone(),
            gates: Vec::new(),
            out: out.to_owned(),
            unit_in_map_units: prepared.unit_in_map_units,
            write_clouds: false,
            share_safe: false,
            inversion: None,
            progress: &Quiet,
            command: None,
            started,
        })
    }
}

/// Photos at most that are shown beside pictures of what came back.
const SHEETS: usize = 3;
/// Neighbors of every point in a default audit of a map.
const USUAL_K: usize = 50;

/// Reads a map and makes it ready for an audit; `descriptors` is a file of them, beside the map. What a user should
/// know is told to `progress`.
///
/// # Errors
/// When a file cannot be read, the scale makes every length meaningless, or too few points are left.
pub fn open(
    path: &Path,
    descriptors: Option<&Path>,
    preparation: &Preparation,
    progress: &dyn Progress,
) -> Result<(read::Input, Prepared), Error> {
    let input = read::open(path).map_err(|error| {
        let way_out = "the folder of a COLMAP model or project; for photos, unlift audit images";
        let is_other = path.is_dir() && !read::is_project(path);
        let error = Error::from(error);
        if is_other { error.advise(way_out) } else { error }
    })?;
    for note in &input.skipped {
        progress.say(&format!("note: {note}"));
    }
    check_scale(&input.positions, preparation.scale)?;
    let rows = descriptors.map(|file| read::descriptors(file, &input)).transpose()?;
    let mut prepared = prepare(&input.positions, rows.as_ref(), preparation).map_err(|error| {
        let few = error.what() == "points" && input.positions.len() > 2;
        let error = Error::from(unlift_io::Error::core(path, error));
        if few { error.advise("a smaller --k, or more points") } else { error }
    })?;
    prepared.notes.extend(prepared.descriptors.as_ref().and_then(zeros));
    Ok((input, prepared))
}

/// What to say of descriptors that are all zero: as some exporters mark points without one.
pub fn zeros(descriptors: &Descriptors) -> Option<String> {
    let mut row = vec![0.0; descriptors.dim()];
    let mut zero = |at: &usize| {
        descriptors.read_row(*at, &mut row);
        row.iter().all(|&value| value == 0.0)
    };
    let (n, of) = ((0..descriptors.len()).filter(|at| zero(at)).count(), descriptors.len());
    (n > 0).then(|| format!("{n} of {of} descriptors are all zero, and tell an attacker nothing"))
}

/// Runs the job and writes its files, all or none.
pub fn perform(job: Job<'_>, mut out: OutputSet) -> Result<Finished, Error> {
    let (folder, share_safe) = (job.out.clone(), job.share_safe);
    find(job, Some(&mut out))?.write(out, &folder, share_safe)
}

/// Runs the job: what it found, of which nothing is written but clouds, if these are asked for and `out` is there.
///
/// # Errors
/// When the plan does not fit the map, a gate or cloud cannot be made, or `progress` says stop.
pub fn find(job: Job<'_>, out: Option<&mut OutputSet>) -> Result<Audited, Error> {
    check_gates(&job.gates, &job.plan)?;
    check_lengths_of_gates(job.original.reveal(), &job.gates)?;
    for note in &job.notes {
        job.progress.say(&format!("note: {note}"));
    }
    let drawn = drawn(&job.plan);
    let n_views = job.plan.schemes.len() * job.plan.variants().len() * drawn.len();
    let mut watcher = Watcher {
        progress: job.progress,
        pictures: (!job.share_safe).then(|| Pictures::new(job.original, &job.plan, n_views)),
        curves: Vec::new(),
        drawn: drawn.iter().map(|solver| solver.name()).collect(),
        clouds: out
            .filter(|_| job.write_clouds)
            .map(|out| (Clouds::new(job.unit_in_map_units), out)),
        thresholds: job.plan.thresholds.iter().map(|t| t.value).collect(),
        inversion: job.inversion.clone(),
        sheets: match (&job.inversion, job.share_safe) {
            (Some(inversion), false) => {
                vec![Sheet::default(); inversion.n_photos().min(SHEETS)]
            }
            _ => Vec::new(),
        },
        failed: None,
    };
    let of_file = |error| match &job.input.path {
        Some(file) => Error::from(unlift_io::Error::core(file, error)),
        None => Error::from(error),
    };
    let outcome = match job.hidden {
        None => run(job.original, job.descriptors, &job.plan, &mut watcher)
            .map_err(|error| of_file(error).advise("a smaller --k, or fewer --schemes"))?,
        Some(hidden) => {
            run_released(job.original, hidden, &job.plan, &mut watcher).map_err(of_file)?
        }
    };
    if let Some(error) = watcher.failed {
        return Err(error);
    }
    let doubts = doubts(job.original, job.hidden, &job.plan, &outcome.rows).map_err(of_file)?;
    for note in &doubts.notes {
        job.progress.say(&format!("note: {note}"));
    }
    let (rows, missing) = (&outcome.rows, &outcome.not_audited);
    let gates = gate_results(&job.gates, &job.plan, rows, missing, &doubts.of_rows)?;
    let mut options = job.options;
    if let Some(inversion) = &job.inversion {
        options.insert("inverter_sha256".into(), inversion.sha256().into());
    }
    let options = document::options(&job.plan, options);
    let provenance = Provenance {
        input: job.input,
        options,
        notes: job.notes.into_iter().chain(doubts.notes).collect(),
        gates,
        command: job.command,
        started: job.started,
    };
    let found = document::Found {
        rows: &outcome.rows,
        not_audited: &outcome.not_audited,
        break_even: &outcome.break_even,
        seconds: &outcome.seconds,
    };
    let document = document::document(&job.plan, &found, provenance);
    let scene = watcher.pictures.map(|p| p.into_scene(&job.cameras, job.up));
    let drawn = RenderOptions {
        error_cdf: curves_of(watcher.curves, &outcome.rows),
        inversions: watcher.sheets,
        ..RenderOptions::default()
    };
    Ok(Audited { document, scene, drawn })
}

/// Shows progress and keeps what the report draws.
struct Watcher<'a> {
    progress: &'a dyn Progress,
    pictures: Option<Pictures>,
    /// The error curve of every cell.
    curves: Vec<(Row, Vec<(f64, f64)>)>,
    /// Names of the solvers whose points are drawn.
    drawn: Vec<&'static str>,
    clouds: Option<(Clouds, &'a mut OutputSet)>,
    thresholds: Vec<f64>,
    inversion: Option<Arc<MapInversion>>,
    /// What the first cameras see.
    sheets: Vec<Sheet>,
    failed: Option<Error>,
}

/// The solvers whose points are drawn: what joint recovery starts from is not, beside what it ends with.
fn drawn<const D: usize>(plan: &Plan<D>) -> Vec<Solver> {
    let is_drawn =
        |solver: &Solver| *solver != Solver::JointStart || !plan.solvers.contains(&Solver::Joint);
    plan.solvers.iter().copied().filter(is_drawn).collect()
}

/// The curve of every row of `rows` that has one, by its cell.
pub fn curves_of(cells: Vec<(Row, Vec<(f64, f64)>)>, rows: &[Row]) -> Vec<ErrorCdf> {
    let curve = |(cell, points): (Row, Vec<(f64, f64)>)| {
        // A cell that failed under another seed has no row.
        let row = rows.iter().position(|row| row.is_same_cell(&cell))?;
        Some(ErrorCdf { row, points })
    };
    cells.into_iter().filter_map(curve).collect()
}

/// Points of an error curve.
const CURVE_POINTS: i32 = 80;

/// The errors of an error curve: from a hundredth of the largest threshold to ten times it, evenly on a
/// logarithmic axis.
pub fn curve_errors(largest_threshold: f64) -> impl Iterator<Item = f64> {
    let exponent = |step: i32| -2.0 + 3.0 * f64::from(step) / f64::from(CURVE_POINTS);
    (0..=CURVE_POINTS).map(move |step| largest_threshold * 10f64.powf(exponent(step)))
}

impl Observer for Watcher<'_> {
    fn progress(&mut self, done: usize, total: usize, what: &str) {
        self.progress.show(done, total, what);
    }

    fn goes_on(&self) -> bool {
        self.progress.goes_on()
    }

    fn cell(&mut self, cell: &Cell<'_>) {
        if cell.repeat > 0 {
            return;
        }
        let most = self.thresholds.iter().copied().fold(0.0, f64::max);
        let points = curve_errors(most).map(|at| (at, cell.accuracy.percent_within(at))).collect();
        self.curves.push((cell.row.clone(), points));
        if let (Some(pictures), true) = (&mut self.pictures, self.drawn.contains(&cell.row.solver))
        {
            pictures.add(cell);
        }
        if let (Some((clouds, out)), None) = (&mut self.clouds, &self.failed) {
            self.failed = clouds.write(out, cell, most).err().map(Error::from);
        }
        if let (Some(inversion), true, None) =
            (&self.inversion, self.drawn.contains(&cell.row.solver), &self.failed)
        {
            self.failed = inversion.add(cell, &mut self.sheets).err().map(Error::from);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_joint_starts_from_is_drawn_only_by_itself() {
        let mut plan = Plan::<3>::new(unlift::Unit::Meter);
        assert_eq!(drawn(&plan), [Solver::Joint]);
        plan.solvers = vec![Solver::JointStart, Solver::Ransac];
        assert_eq!(drawn(&plan), plan.solvers);
    }
}
