//! One audit from a prepared map to the files in its folder: what `audit map` and `demo` share.

use std::path::{Path, PathBuf};
use std::time::Instant;

use unlift::Descriptors;
use unlift::audit::{Cell, Observer, Plan, REFERENCE, Row, run};
use unlift::truth::Original;
use unlift_io::atomic::{OutputDir, write_file};
use unlift_report::document::{Document, GateResult, Input};
use unlift_report::{RenderOptions, render, text_table};

use crate::clouds::Clouds;
use crate::document::{self, Provenance};
use crate::exit::{advise, usage};
use crate::gate::{Candidate, Gate};
use crate::pictures::Pictures;
use crate::progress::Progress;

/// Everything an audit needs.
pub struct Job<'a> {
    /// The points, in the unit of the audit.
    pub original: &'a Original<3>,
    /// One row per point.
    pub descriptors: Option<&'a Descriptors>,
    /// Camera centers in the unit of the audit, for the picture.
    pub cameras: Vec<[f64; 3]>,
    /// The direction that is up in the picture, where known.
    pub up: Option<[f64; 3]>,
    /// What is to be done.
    pub plan: Plan,
    /// What was read.
    pub input: Input,
    /// Options for the record, beside those in the plan.
    pub options: serde_json::Map<String, serde_json::Value>,
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
    /// No progress bars.
    pub quiet: bool,
    /// When the command began.
    pub started: Instant,
}

/// What an audit left behind.
pub struct Finished {
    /// The figures, as written.
    pub document: Document,
    /// Where the report is.
    pub report: PathBuf,
}

impl Finished {
    /// Whether every gate held.
    pub fn passed(&self) -> bool {
        self.document.gates.iter().all(|gate| gate.passed)
    }

    /// The short table, the gates that failed, and where the report is.
    pub fn text(&self) -> String {
        let mut text = text_table(&self.document);
        for gate in &self.document.gates {
            let word = if gate.passed { "held" } else { "FAILED" };
            let found = gate.found_percent.map(|found| format!("found {found:.1} %"));
            let found: Vec<String> = found.into_iter().chain(gate.reason.clone()).collect();
            text.push_str(&format!("gate {}: {word}, {}\n", gate.gate, found.join("; ")));
        }
        text.push_str(&format!("\nreport: {}\n", self.report.display()));
        text
    }
}

/// The file that marks a folder as an audit.
pub const MARKER: &str = "audit.json";

/// Opens the folder an audit goes to: refused early, before anything is computed.
pub fn open_out(out: &Path) -> anyhow::Result<OutputDir> {
    OutputDir::create(out, MARKER).map_err(|error| usage(format!("--out: {error}")))
}

/// Runs the job and writes its folder, whole or not at all.
pub fn perform(job: Job<'_>, out: OutputDir) -> anyhow::Result<Finished> {
    check_gates(&job.gates, &job.plan)?;
    let n_cells = job.plan.schemes.len() * job.plan.variants().len() * job.plan.solvers.len();
    let mut watcher = Watcher {
        progress: Progress::new(job.quiet),
        pictures: (!job.share_safe).then(|| Pictures::new(job.original, &job.plan, n_cells)),
        curves: Vec::new(),
        row_of_cell: RowOfCell::new(&job.plan),
        clouds: job
            .write_clouds
            .then(|| Clouds::new(out.path(), job.unit_in_map_units))
            .transpose()?,
        thresholds: job.plan.thresholds.iter().map(|t| t.value).collect(),
        failed: None,
    };
    let outcome = run(job.original, job.descriptors, &job.plan, &mut watcher).map_err(|error| {
        let file = job.input.path.clone().unwrap_or_default();
        advise(unlift_io::Error::core(file, error), "a smaller --k, or fewer --schemes")
    })?;
    if let Some(error) = watcher.failed {
        return Err(error.into());
    }
    drop(watcher.progress);
    let gates = gate_results(&job.gates, &job.plan, &outcome.rows)?;
    let options = document::options(&job.plan, job.options);
    let provenance = Provenance { input: job.input, options, gates, started: job.started };
    let found = document::Found {
        rows: &outcome.rows,
        break_even: &outcome.break_even,
        seconds: &outcome.seconds,
    };
    let document = document::document(&job.plan, &found, provenance);
    let shown = if job.share_safe { document.share_safe() } else { document };
    let scene = watcher.pictures.map(|p| p.into_scene(&job.cameras, job.up));
    let options = RenderOptions {
        share_safe: job.share_safe,
        error_cdf: watcher.curves,
        ..RenderOptions::default()
    };
    let page = render(&shown, scene.as_ref(), &options)?;
    let json = shown.to_json()?;
    write_file(&out.path().join("report.html"), |w| std::io::Write::write_all(w, page.as_bytes()))?;
    write_file(&out.path().join(MARKER), |w| std::io::Write::write_all(w, json.as_bytes()))?;
    out.commit()?;
    Ok(Finished { document: shown, report: job.out.join("report.html") })
}

/// Rows that the plan will have, as gates see them.
fn candidates<'a>(plan: &'a Plan, rows: Option<&'a [Row]>) -> Vec<Candidate<'a>> {
    let mut candidates = Vec::new();
    if let Some(rows) = rows {
        // The reference is no attack.
        for row in rows.iter().filter(|row| row.solver != REFERENCE) {
            for (at, threshold) in plan.thresholds.iter().enumerate() {
                candidates.push(Candidate {
                    scheme: row.scheme,
                    inlier_ratio: row.oracle_noise.is_some().then_some(row.inlier_ratio),
                    threshold: threshold.value,
                    recovered_percent: row.recovered_percent[at],
                    blind_percent: row.blind_percent[at],
                });
            }
        }
        return candidates;
    }
    for scheme in &plan.schemes {
        for variant in plan.variants() {
            for threshold in &plan.thresholds {
                candidates.push(Candidate {
                    scheme: scheme.name,
                    inlier_ratio: variant.inlier_ratio,
                    threshold: threshold.value,
                    recovered_percent: 0.0,
                    blind_percent: 0.0,
                });
            }
        }
    }
    candidates
}

/// A gate about no row is told before the audit runs, not after.
pub fn check_gates(gates: &[Gate], plan: &Plan) -> anyhow::Result<()> {
    let rows = candidates(plan, None);
    match gates.iter().find(|gate| gate.worst(rows.iter().copied()).is_none()) {
        None => Ok(()),
        Some(gate) => {
            let thresholds: Vec<&str> = plan.thresholds.iter().map(|t| &t.label[..]).collect();
            let error = usage(format!(
                "--gate {}: expected a scheme, inlier ratio and threshold of this audit, found none \
                 that fits",
                gate.typed
            ));
            let of = thresholds.join(", ");
            Err(advise(
                error,
                format!("a threshold of {of} (--scale and --thresholds change them)"),
            ))
        }
    }
}

/// How every gate ended.
pub fn gate_results(gates: &[Gate], plan: &Plan, rows: &[Row]) -> anyhow::Result<Vec<GateResult>> {
    let rows = candidates(plan, Some(rows));
    let result = |gate: &Gate| {
        // A gate that is about no row must never count as held.
        let found = gate.worst(rows.iter().copied());
        let found_percent = found
            .ok_or_else(|| usage(format!("--gate {}: expected a row, found none", gate.typed)))?;
        Ok(GateResult {
            gate: gate.typed.clone(),
            found_percent: Some(found_percent),
            bound_percent: gate.bound_percent,
            passed: gate.passes(found_percent),
            reason: None,
        })
    };
    gates.iter().map(result).collect()
}

/// Shows progress and keeps what the report draws.
struct Watcher {
    progress: Progress,
    pictures: Option<Pictures>,
    curves: Vec<unlift_report::ErrorCdf>,
    row_of_cell: RowOfCell,
    clouds: Option<Clouds>,
    thresholds: Vec<f64>,
    failed: Option<unlift_io::Error>,
}

/// Which row of the results a cell becomes: the reference of a scheme has a row, and no cell.
#[derive(Clone, Copy, Debug)]
pub struct RowOfCell {
    cells_per_scheme: usize,
    reference: bool,
}

impl RowOfCell {
    pub fn new(plan: &Plan) -> Self {
        let cells_per_scheme = plan.variants().len() * plan.solvers.len();
        Self { cells_per_scheme, reference: plan.reference }
    }

    /// The row of cell number `cell` of the first repeat.
    pub fn of(&self, cell: usize) -> usize {
        cell + usize::from(self.reference) * (cell / self.cells_per_scheme.max(1))
    }
}

/// Points of an error curve.
const CURVE_POINTS: i32 = 80;

/// The errors of an error curve: from a hundredth of the largest threshold to ten times it, evenly on a
/// logarithmic axis.
pub fn curve_errors(largest_threshold: f64) -> impl Iterator<Item = f64> {
    let exponent = |step: i32| -2.0 + 3.0 * f64::from(step) / f64::from(CURVE_POINTS);
    (0..=CURVE_POINTS).map(move |step| largest_threshold * 10f64.powf(exponent(step)))
}

impl Observer for Watcher {
    fn progress(&mut self, done: usize, total: usize, what: &str) {
        self.progress.show(done, total, what);
    }

    fn cell(&mut self, cell: &Cell<'_>) {
        if cell.repeat > 0 {
            return;
        }
        let most = self.thresholds.iter().copied().fold(0.0, f64::max);
        let points = curve_errors(most).map(|at| (at, cell.accuracy.percent_within(at))).collect();
        let row = self.row_of_cell.of(self.curves.len());
        self.curves.push(unlift_report::ErrorCdf { row, points });
        if let Some(pictures) = &mut self.pictures {
            pictures.add(cell);
        }
        if let (Some(clouds), None) = (&mut self.clouds, &self.failed) {
            self.failed = clouds.write(cell, most).err();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_stand_between_the_cells_of_schemes() {
        let mut plan = Plan::new(unlift::Unit::Meter);
        plan.inlier_ratios = vec![1.0, 0.5];
        let rows = |plan: &Plan| [0, 1, 2, 3, 4].map(|cell| RowOfCell::new(plan).of(cell));
        assert_eq!(rows(&plan), [0, 1, 2, 3, 4]);
        plan.reference = true;
        assert_eq!(rows(&plan), [0, 1, 3, 4, 6]);
    }
}
