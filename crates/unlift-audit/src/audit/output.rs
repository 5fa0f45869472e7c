//! One audit of any input: its gates, its document and page, and its files, which are checked before anything is computed.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Map as Options, Value};
use unlift::OneLine;
use unlift::audit::{Plan, Seconds};
use unlift_io::atomic::{Access, OutputFile, make_folders, write_file};
use unlift_io::outputs::{Kind, OutputSet, Rules};
use unlift_report::document as report;
use unlift_report::{
    Document, Opening, RenderOptions, Shares, gate_lines, render, shares, text_table,
};

use crate::document::{Attacked, distinct, not_audited};
use crate::doubts::Remarks;
use crate::gate::{Gate, gate_result};
use crate::maps::Prepared;
use crate::{Error, bail};

/// An audit of any input: what there is to say of it, the gates, and where the results go.
#[derive(Clone, Debug)]
pub struct Audit {
    /// The input in the report.
    pub about: report::Input,
    /// Recorded options, in addition to those of the plan.
    pub options: Options<String, Value>,
    /// Notes and doubts about the input.
    pub remarks: Remarks,
    /// The gates.
    pub gates: Vec<Gate>,
    /// The output.
    pub output: Output,
}

impl Audit {
    /// Creates an audit without gates, notes and further options.
    pub fn new(output: Output) -> Self {
        let (about, options, remarks, gates) = Default::default();
        Self { about, options, remarks, gates, output }
    }

    /// Sets the input to `prepared` points, with what there is to say of them.
    #[must_use]
    pub fn of_map(self, prepared: &Prepared) -> Self {
        let about = report::Input { n_points: prepared.original.len() as u64, ..self.about };
        Self { about, remarks: prepared.remarks.clone(), ..self }
    }

    /// Checks the gates after the attack by `plan`. Returns the document, and what the page draws.
    pub(super) fn finish<const D: usize>(
        &self,
        plan: &Plan<D>,
        attacked: Attacked,
    ) -> Result<Audited, Error> {
        let gates = self.gates.iter().map(|gate| gate_result(gate, &attacked));
        let mut gates = gates.collect::<Result<Vec<_>, Error>>()?;
        if let Some(extent) = attacked.document.input.extent() {
            let of = gates.iter_mut().filter_map(|gate| gate.of.as_mut());
            of.for_each(|of| of.push_str(&format!(", in a map of {extent}")));
        }
        let Attacked { document, mut seconds, rendering, .. } = attacked;
        let doubts = document.doubts.iter().cloned();
        let doubts = doubts.chain(attacked.doubts.into_iter().flatten()).collect();
        // Some attacks measure no time per row.
        seconds.rows.resize_with(document.results.len(), Default::default);
        let document = Document {
            unlift: env!("CARGO_PKG_VERSION").to_owned(),
            schema: report::SCHEMA,
            gates,
            seed: plan.seed,
            not_audited: not_audited(plan, &attacked.not_audited),
            doubts: distinct(doubts, String::eq),
            run: self.output.record(&seconds),
            ..document
        };
        Ok(Audited { document, rendering })
    }
}

/// The output of an audit.
#[derive(Clone, Debug)]
pub struct Output {
    /// The folder of the page and the figures.
    pub folder: PathBuf,
    /// Writes figures only, which may be shown to others.
    pub share_safe: bool,
    /// A file for the results of the gates, as JUnit XML.
    pub junit: Option<PathBuf>,
    /// The command line, for the record.
    pub command: Option<String>,
    /// The start of the audit.
    pub started: Instant,
}

impl Output {
    /// Creates the output into `folder` of an audit that starts now.
    pub fn new(folder: &Path) -> Self {
        let folder = folder.to_owned();
        Self { folder, share_safe: false, junit: None, command: None, started: Instant::now() }
    }
}

/// File name of the page of an audit.
pub const PAGE: &str = "report.html";
/// File name of the figures of an audit.
pub const FIGURES: &str = "audit.json";

/// Converts an error of a file to an error of the option `--out`.
pub fn refused(error: unlift_io::Error) -> Error {
    Error::request(format!("--out: {error}"))
}

/// Checks that the file `path`, which `option` names, may be written, and returns its absolute place
/// with links resolved. Call it before and after the work.
///
/// Like [`Output::open`] for folders, it reports a place that cannot be written as an error of the command line.
pub fn check_file(option: &str, path: &Path, kind: Kind, rules: &Rules) -> Result<PathBuf, Error> {
    let refused = |error: unlift_io::Error| Error::request(format!("{option}: {error}"));
    let place = rules.check(path, kind).map_err(refused)?;
    // Permissions alone do not show whether a file can be written.
    drop(OutputFile::create(path, Access::Private).map_err(refused)?);
    Ok(place)
}

/// The files of an audit, which were checked before the work.
pub struct Files {
    output: Output,
    set: OutputSet,
    rules: Rules,
}

const JUNIT: &str = "--junit";

impl Output {
    fn record(&self, seconds: &Seconds) -> report::Run {
        let stages = [
            ("search", seconds.search),
            ("obfuscate", seconds.obfuscate),
            ("neighbors", seconds.neighbors),
            ("recover", seconds.recover),
            ("records_alone", seconds.records_alone),
            ("evaluate", seconds.evaluate),
        ];
        let rows = seconds.rows.iter().map(|row| {
            let made = (row.neighbors > 0.0).then(|| ("neighbors".to_owned(), row.neighbors));
            made.into_iter().chain([("recover".to_owned(), row.recover)]).collect()
        });
        report::Run {
            command: self.command.clone(),
            threads: rayon::current_num_threads() as u32,
            peak_memory_bytes: peak_bytes(),
            seconds: report::Seconds {
                total: self.started.elapsed().as_secs_f64(),
                rows: rows.collect(),
                stages: stages.into_iter().map(|(name, s)| (name.to_owned(), s)).collect(),
            },
        }
    }

    /// Opens the output folder of an audit, and checks the file for the results of gates, which is none of the report.
    pub fn open(&self, rules: Rules) -> Result<Files, Error> {
        let mut junit = None;
        if let Some(path) = &self.junit {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
            if let Some(folder) = folder.filter(|folder| !folder.exists()) {
                // It may be the folder of the report.
                make_folders(folder, access(self.share_safe))
                    .map_err(|error| Error::request(format!("{JUNIT}: {error}")))?;
            }
            junit = Some((path, check_file(JUNIT, path, Kind::Junit, &rules)?));
        }
        let first = [(PAGE, Kind::Page), (FIGURES, Kind::AuditJson)];
        let set = OutputSet::create(&self.folder, rules.clone(), access(self.share_safe), &first);
        let set = set.map_err(refused)?;
        let out = std::fs::canonicalize(&self.folder).unwrap_or_default();
        if let Some((path, target)) = junit
            && [PAGE, FIGURES].iter().any(|name| out.join(name) == target)
        {
            let path = path.display();
            bail!("{JUNIT}: {path}: expected a file of its own, found one of --out");
        }
        Ok(Files { output: self.clone(), set, rules })
    }
}

/// Returns who can read results: others, too, if they may be shared.
fn access(share_safe: bool) -> Access {
    if share_safe { Access::Usual } else { Access::Private }
}

/// Returns the peak resident memory of this process in bytes, if the system reports it (Linux).
fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

/// The results of an audit, before they are written.
#[derive(Clone, Debug)]
pub struct Audited {
    /// The figures.
    pub document: Document,
    rendering: RenderOptions,
}

/// A written audit.
pub struct Finished {
    /// The figures, as written.
    pub document: Document,
    /// The path of the report.
    pub report: PathBuf,
}

impl Audited {
    /// Renders the self-contained page.
    pub fn page(&self, share_safe: bool) -> Result<String, Error> {
        let options = RenderOptions { share_safe, ..self.rendering.clone() };
        Ok(render(&self.document, &options)?)
    }

    /// Returns the recovered shares of every scheme, the largest first.
    pub fn shares(&self) -> Vec<Shares> {
        shares(&self.document, &self.rendering.inversions)
    }

    /// Puts the verdict and pictures of `first` at the top of this audit's page, under `title`.
    /// `details` is a link to the page of `first`.
    #[must_use]
    pub fn opening_with(mut self, first: &Self, title: &str, details: &str) -> Self {
        let inversions = &first.rendering.inversions;
        self.rendering.opening = Some(Opening::titled(&first.document, inversions, title, details));
        self
    }

    /// Stages page and figures under `names` in `out`. They appear when `out` is committed.
    pub fn stage(
        &self,
        out: &mut OutputSet,
        names: [&str; 2],
        share_safe: bool,
    ) -> Result<Document, Error> {
        let page = self.page(share_safe)?;
        let document = if share_safe { self.document.share_safe() } else { self.document.clone() };
        let texts = [(Kind::Page, page), (Kind::AuditJson, document.to_json()?)];
        for (name, (kind, text)) in names.into_iter().zip(texts) {
            let file = out.stage(name, kind)?;
            write_file(&file, access(share_safe), |w| w.write_all(text.as_bytes()))?;
        }
        Ok(document)
    }

    /// Writes page and figures, both or none, and the results of gates.
    pub fn write(&self, files: Files) -> Result<Finished, Error> {
        let Files { output, mut set, rules } = files;
        let document = self.stage(&mut set, [PAGE, FIGURES], output.share_safe)?;
        set.commit()?;
        if let Some(path) = &output.junit {
            check_file(JUNIT, path, Kind::Junit, &rules)?;
            let text = unlift_report::junit(&document)?;
            write_file(path, Access::Usual, |w| w.write_all(text.as_bytes()))?;
        }
        Ok(Finished { document, report: output.folder.join(PAGE) })
    }
}

impl Finished {
    /// Returns true if every gate held.
    pub fn passed(&self) -> bool {
        self.document.gates.iter().all(|gate| gate.passed)
    }

    /// Returns the short table, the results of the gates and the path of the report.
    pub fn text(&self) -> String {
        let (table, gates) = (text_table(&self.document), gate_lines(&self.document));
        format!("{table}{gates}\nreport: {}\n", OneLine(self.report.display()))
    }
}
