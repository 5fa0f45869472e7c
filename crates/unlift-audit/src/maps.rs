//! Audits of a prepared map, as `audit map` and `demo` run them.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use unlift::audit::{Alone, Cell, Observer, Outcome, Plan, Row, run, run_released};
use unlift::released::Released;
use unlift::truth::{Original, Secret};
use unlift::{Descriptors, ErrorKind, Unit};
use unlift_io::hash::hash_input;
use unlift_io::outputs::OutputSet;
use unlift_io::read;
use unlift_report::RenderOptions;
use unlift_report::document::Input;
use unlift_report::inversions::Inversion as Sheet;
use unlift_report::scene::Scene3d;

use crate::Error;
use crate::curves::{Curves, curves_of};
use crate::document::{self, Provenance};
use crate::doubts::{
    Spread, check_scale, check_truth, doubts, sides_m, unlike_neighbors, with_extent,
};
use crate::gate::{Gate, check_gates, check_lengths_of_gates, gate_results};
use crate::given_away::follows_places;
use crate::inversion::MapInversion;
use crate::localization::{self, Cameras, Localize};
use crate::outputs::{Audited, Finished};
use crate::prepare::{Preparation, Prepared, prepare};
use crate::scene::Pictures;
use crate::tiles;
pub use crate::tiles::{Tile, Tiles};
use crate::{Progress, Quiet};

/// The inputs of an audit.
pub struct Job<'a> {
    /// The points, in the unit of the audit.
    pub original: &'a Original<3>,
    /// Descriptors, one row per point.
    pub descriptors: Option<&'a Descriptors>,
    /// The release and its secret, if the points are hidden already.
    pub hidden: Option<&'a (Released<3>, Secret)>,
    /// An attack on values of the released file that its records do not contain.
    pub read: Option<Alone>,
    /// The cameras that observe the points, for localization; not used with tiles.
    pub localize: Option<Localize<'a>>,
    /// Camera centers in the unit of the audit, for the 3D view.
    pub cameras: Vec<[f64; 3]>,
    /// The up direction of the 3D view, if known.
    pub up: Option<[f64; 3]>,
    /// The plan of the audit.
    pub plan: Plan<3>,
    /// The input files.
    pub input: Input,
    /// Recorded options, in addition to those of the plan.
    pub options: serde_json::Map<String, serde_json::Value>,
    /// Notes for readers of the figures; also reported to `progress`.
    pub notes: Vec<String>,
    /// Doubts about all figures: reported as notes, and no gate holds with one.
    pub doubts: Vec<String>,
    /// The gates.
    pub gates: Vec<Gate>,
    /// The output folder.
    pub out: PathBuf,
    /// Hides and attacks each tile as a map of its own. Then the page shows only where the map
    /// leaks most.
    pub tiles: Option<Tiles>,
    /// Writes figures only.
    pub share_safe: bool,
    /// Makes pictures of recovered points; the plan measures with it, too.
    pub inversion: Option<Arc<MapInversion>>,
    /// Receives the progress.
    pub progress: &'a dyn Progress,
    /// The command line, for the record.
    pub command: Option<String>,
    /// The start of the command.
    pub started: Instant,
}

impl<'a> Job<'a> {
    /// Creates the default audit of the map at `path`, as [`open`] read it, with the output folder
    /// `out`.
    ///
    /// # Errors
    /// If the files of the map cannot be read again for their hash, or have changed.
    pub fn new(
        path: &Path,
        input: &read::Input,
        prepared: &'a Prepared,
        out: &Path,
        started: Instant,
    ) -> Result<Self, Error> {
        let points = prepared.original.reveal();
        let scale = 1.0 / prepared.unit_in_map_units;
        let job = Self::of(&prepared.original, started);
        Ok(Self {
            descriptors: prepared.descriptors.as_ref(),
            localize: Some(Localize {
                cameras: &prepared.cameras,
                held_out: None,
                protections: Vec::new(),
            }),
            cameras: input.cameras.iter().map(|c| c.map(|x| x * scale)).collect(),
            up: input.up,
            input: Input {
                path: Some(path.display().to_string()),
                sha256: Some(hash_input(input)?),
                scale_m_per_unit: (points.unit() == Unit::Meter).then_some(scale),
                unit_in_map_units: Some(prepared.unit_in_map_units),
                ..job.input
            },
            notes: prepared.notes.clone(),
            doubts: prepared.doubts.clone(),
            out: out.to_owned(),
            ..job
        })
    }

    /// Creates the default audit of points in memory, without output folder.
    pub fn of(original: &'a Original<3>, started: Instant) -> Self {
        let points = original.reveal();
        Self {
            original,
            descriptors: None,
            hidden: None,
            read: None,
            localize: None,
            cameras: Vec::new(),
            up: None,
            plan: Plan::new(points.unit()).for_map(points.len(), USUAL_K),
            input: Input { n_points: points.len() as u64, ..Input::default() },
            options: serde_json::Map::new(),
            notes: Vec::new(),
            doubts: Vec::new(),
            gates: Vec::new(),
            out: PathBuf::new(),
            tiles: None,
            share_safe: false,
            inversion: None,
            progress: &Quiet,
            command: None,
            started,
        }
    }
}

/// Maximum number of photos shown beside pictures.
const SHEETS: usize = 3;
/// K of a default audit of a map.
const USUAL_K: usize = 50;

/// Reads a map and prepares it for an audit; `descriptors` is a separate file of descriptors. Notes
/// and doubts about the input are in the result.
///
/// # Errors
/// If a file cannot be read, if the scale makes lengths meaningless, or if too few points are
/// left.
pub fn open(
    path: &Path,
    descriptors: Option<&Path>,
    preparation: &Preparation,
) -> Result<(read::Input, Prepared), Error> {
    let input = read::open(path).map_err(|error| {
        let way_out = "the folder of a COLMAP model or project; for photos, unlift audit images";
        let is_other = path.is_dir() && !read::is_project(path);
        let error = Error::from(error);
        if is_other { error.advise(way_out) } else { error }
    })?;
    check_scale(&input.positions, preparation.scale)?;
    let (mut notes, mut doubts) = (input.notes.clone(), input.doubts.clone());
    let (rows, file) = match descriptors {
        Some(file) => (Some(read::descriptors(file, &input)?), Some(file.to_owned())),
        None if preparation.beside => match beside(&input) {
            Ok((rows, file)) => {
                notes.push(format!("descriptors: {}, beside the model", file.display()));
                (Some(rows), Some(file))
            }
            Err(reasons) => {
                doubts.extend(reasons);
                (None, None)
            }
        },
        None => (None, None),
    };
    let mut prepared = prepare(&input.positions, rows.as_ref(), preparation).map_err(|error| {
        let few = error.kind() == ErrorKind::TooFewPoints && input.positions.len() > 2;
        let error = Error::from(unlift_io::Error::core(path, error));
        if few { error.advise("a smaller --k, or more points") } else { error }
    })?;
    if let Some(model) = &input.model {
        let scale = 1.0 / prepared.unit_in_map_units;
        // `prepared.rows` counts finite points only.
        let rows = rows_of_file(&prepared.rows, &input.left_out);
        match Cameras::read(model, &rows, scale) {
            Ok(cameras) => {
                prepared.notes.extend(cameras.note());
                prepared.cameras = cameras;
            }
            // An audit of points needs no cameras.
            Err(error) => prepared.notes.push(format!("localization: not measured: {error}")),
        }
    }
    prepared.notes.extend(prepared.descriptors.as_ref().and_then(zeros));
    prepared.notes.splice(0..0, notes);
    prepared.doubts = doubts;
    prepared.descriptors_file = file;
    if let Some(rows) = &prepared.descriptors {
        let points = prepared.original.reveal();
        prepared.doubts.extend(unlike_neighbors(points, rows)?);
    }
    prepared.rows = rows_of_file(&prepared.rows, &input.left_out);
    Ok((input, prepared))
}

/// Reads the first file beside the model of `input` that has the descriptors of its points; returns why none of
/// them has.
fn beside(input: &read::Input) -> Result<(Descriptors, PathBuf), Vec<String>> {
    let mut reasons = Vec::new();
    for file in &input.beside {
        match read::descriptors(file, input) {
            Ok(rows) => return Ok((rows, file.clone())),
            Err(error) => reasons.push(format!("descriptors: {error}")),
        }
    }
    Err(reasons)
}

/// Returns `rows` among all points of the file, which may contain points that the reader left out.
fn rows_of_file(rows: &[u32], left_out: &[u64]) -> Vec<u32> {
    let mut left_out = left_out.iter().peekable();
    let mut shift = 0;
    let of_file = |&row: &u32| {
        while left_out.next_if(|&&out| out <= u64::from(row) + shift).is_some() {
            shift += 1;
        }
        row + shift as u32
    };
    rows.iter().map(of_file).collect()
}

/// Returns a note about descriptors that are all zero; some exporters mark missing descriptors like
/// this.
pub fn zeros(descriptors: &Descriptors) -> Option<String> {
    let mut row = vec![0.0; descriptors.dim()];
    let mut zero = |at: &usize| {
        descriptors.read_row(*at, &mut row);
        row.iter().all(|&value| value == 0.0)
    };
    let (n, of) = ((0..descriptors.len()).filter(|at| zero(at)).count(), descriptors.len());
    (n > 0).then(|| {
        format!("{n} of {of} descriptors are all zero and give an attacker no information")
    })
}

/// Runs the job and writes its files, all or none.
pub fn perform(job: Job<'_>, out: OutputSet) -> Result<Finished, Error> {
    let (folder, share_safe) = (job.out.clone(), job.share_safe);
    find(job)?.write(out, &folder, share_safe)
}

/// Runs the job and writes nothing.
///
/// # Errors
/// If the plan does not fit the map, a gate fails, or `progress` stops the audit.
pub fn find(job: Job<'_>) -> Result<Audited, Error> {
    let localize = job.localize.as_ref().filter(|_| job.tiles.is_none());
    let localizes = localize.is_some_and(|localize| !localize.cameras.views.is_empty());
    check_gates(&job.gates, &job.plan, localizes)?;
    check_lengths_of_gates(job.original.reveal(), &job.gates)?;
    for note in job.doubts.iter().chain(&job.notes) {
        job.progress.say(&format!("note: {note}"));
    }
    let of_file = |error| match &job.input.path {
        Some(file) => Error::from(unlift_io::Error::core(file, error)),
        None => Error::from(error),
    };
    // Localization comes first: wrong features are reported before the long attacks.
    let (localization, said) = match localize {
        Some(localize) => {
            localization::of_schemes(localize, job.original, &job.plan, job.progress)?
        }
        None => Default::default(),
    };
    let whole = (job.original, job.descriptors);
    let cut = |asked: Tiles| asked.of(job.original.reveal().positions(), job.up);
    let cut = job.tiles.map(cut).transpose()?;
    let spread = match &cut {
        Some(tiles) => Spread::of_tiles(job.original, tiles, job.plan.k),
        None => Spread::of(job.original.reveal().positions(), job.plan.k),
    };
    let spread = spread.map_err(of_file)?;
    if let Some(hidden) = job.hidden {
        check_truth(job.original, hidden, &spread).map_err(of_file)?;
    }
    let Ran { mut outcome, scene, curves, sheets, tile_rows } = match &cut {
        Some(tiles) => {
            let (outcome, tile_rows, curves) = tiles::run(whole, tiles, &job.plan, job.progress)
                .map_err(|error| of_file(error).advise("a larger --tile-points"))?;
            let curves = curves.shares();
            Ran { outcome, scene: None, curves, sheets: Vec::new(), tile_rows }
        }
        None => {
            let mut watcher = watcher(&job);
            let outcome = match job.hidden {
                None => run(whole.0, whole.1, &job.plan, &mut watcher)
                    .map_err(|error| of_file(error).advise("a smaller --k, or fewer --schemes"))?,
                Some(hidden) => {
                    run_released(job.original, hidden, &job.plan, &mut watcher).map_err(of_file)?
                }
            };
            if let Some(error) = watcher.failed {
                return Err(error);
            }
            let scene = watcher.pictures.map(|p| p.into_scene(&job.cameras, job.up));
            let (curves, sheets) = (watcher.curves.shares(), watcher.sheets);
            Ran { outcome, scene, curves, sheets, tile_rows: Vec::new() }
        }
    };
    // Of values that are no better than a blind guess there is nothing to say.
    let beats = |alone: &&Alone, row: &Row| {
        alone.percent.iter().zip(&row.blind_percent).any(|(a, b)| a > b)
    };
    for row in &mut outcome.rows {
        row.records_alone.extend(job.read.as_ref().filter(|alone| beats(alone, row)).cloned());
    }
    let followed = job.hidden.map(|hidden| follows_places(job.original, hidden));
    let of_file: Vec<String> =
        job.doubts.iter().cloned().chain(followed.into_iter().flatten()).collect();
    let mut doubts = doubts(
        (job.original, spread),
        job.hidden,
        (&job.plan, &outcome.rows, &tile_rows),
        &of_file,
    );
    for note in doubts.notes.iter().filter(|note| !job.doubts.contains(note)) {
        job.progress.say(&format!("note: {note}"));
    }
    let (rows, missing) = (&outcome.rows, &outcome.not_audited);
    doubts.notes.extend(said);
    let of_hidden = job.hidden.is_some_and(|(released, _)| released.descriptors().is_some());
    let described = job.descriptors.is_some() || of_hidden;
    let gates = gate_results(
        &job.gates,
        (&job.plan, described),
        rows,
        missing,
        &doubts.of_rows,
        &localization,
    )?;
    let input = Input { extent_m: sides_m(job.original.reveal()), ..job.input };
    let gates = with_extent(gates, &input);
    let mut options = job.options;
    if let Some(inversion) = &job.inversion {
        options.insert("inverter_sha256".into(), inversion.sha256().into());
    }
    if let Some(Tiles { most, only }) = job.tiles {
        options.insert("tile_points".into(), most.into());
        options.extend(only.map(|at| ("tile".to_owned(), at.into())));
    }
    let options = document::options(&job.plan, options);
    let provenance = Provenance {
        input,
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
    let mut document = document::document(&job.plan, &found, provenance);
    document.localization = localization;
    if let Some(tiles) = &cut {
        document.tiles = document::tiles(tiles, &tile_rows, &outcome.rows, &job.plan.thresholds);
    }
    let drawn = RenderOptions {
        error_cdf: curves_of(curves, &outcome.rows),
        inversions: sheets,
        ..RenderOptions::default()
    };
    Ok(Audited { document, scene, drawn })
}

/// The results of a job before they become a document.
struct Ran {
    outcome: Outcome,
    scene: Option<Scene3d>,
    curves: Vec<(Row, Vec<(f64, f64)>)>,
    sheets: Vec<Sheet>,
    tile_rows: Vec<Vec<Row>>,
}

/// Creates the observer of the cells of `job`.
fn watcher<'a>(job: &Job<'a>) -> Watcher<'a> {
    let n_views = job.plan.schemes.len() * job.plan.rows_per_scheme();
    Watcher {
        progress: job.progress,
        pictures: (!job.share_safe).then(|| Pictures::new(job.original, &job.plan, n_views)),
        curves: Curves::new(&job.plan, job.progress),
        inversion: job.inversion.clone(),
        sheets: match (&job.inversion, job.share_safe) {
            (Some(inversion), false) => {
                vec![Sheet::default(); inversion.n_photos().min(SHEETS)]
            }
            _ => Vec::new(),
        },
        failed: None,
    }
}

/// Reports progress and collects what the page draws.
struct Watcher<'a> {
    progress: &'a dyn Progress,
    pictures: Option<Pictures>,
    curves: Curves<'a>,
    inversion: Option<Arc<MapInversion>>,
    /// One sheet for each of the first cameras.
    sheets: Vec<Sheet>,
    failed: Option<Error>,
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
        self.curves.cell(cell);
        if let Some(pictures) = &mut self.pictures {
            pictures.add(cell);
        }
        if let (Some(inversion), None) = (&self.inversion, &self.failed) {
            self.failed = inversion.add(cell, &mut self.sheets).err().map(Error::from);
        }
    }
}
