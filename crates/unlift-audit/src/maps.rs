//! Maps: read and prepared, and attacked whole, in tiles or as they are released.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use unlift::audit::{Alone, Cell, Observer, Outcome, Plan, Row, run, run_released};
use unlift::geometry::frame::{Bounds, rounded_origin};
use unlift::released::{Obfuscation, Released};
use unlift::truth::Original;
use unlift::{Descriptors, ErrorKind};
use unlift_io::clouds::record_segments;
use unlift_io::read;
use unlift_report::inversions::Inversion as Sheet;
use unlift_report::scene::{
    ObfuscationView, Scene3d, SceneBox, Shapes, points_within_budget, subsample,
};
use unlift_report::{Attack, ByAttack, RenderOptions};

use crate::audit::{Attacked, Audit, Hidden};
use crate::curves::{Curves, curves_of};
use crate::doubts::{
    Spread, check_scale, check_truth, doubts, follows_places, unlike_neighbors, with_sides,
};
use crate::gate::Tried;
use crate::inversion::MapInversion;
use crate::localization::{self, Cameras, Localize};
use crate::prepare::{Preparation, Prepared, prepare};
use crate::tiles::{self, Tile, Tiles};
use crate::{Error, Progress, document};

/// A map, and how it is attacked.
pub struct Map<'a> {
    /// The points, in the unit of the audit.
    pub original: &'a Original<3>,
    /// Descriptors, one row per point.
    pub descriptors: Option<&'a Descriptors>,
    /// The cameras that observe the points, for localization; not used with tiles.
    pub localize: Option<Localize<'a>>,
    /// Camera centers in the unit of the audit, for the 3D view.
    pub cameras: Vec<[f64; 3]>,
    /// The up direction of the 3D view, if known.
    pub up: Option<[f64; 3]>,
    /// The plan of the attack.
    pub plan: Plan<3>,
    /// Makes pictures of recovered points; the plan measures with it, too.
    pub inversion: Option<Arc<MapInversion>>,
}

impl<'a> Map<'a> {
    /// Returns a map as [`open`] read it, with the default plan.
    pub fn new(prepared: &'a Prepared) -> Self {
        let (cameras, held_out, protections) = (&prepared.cameras, None, Vec::new());
        Self {
            descriptors: prepared.descriptors.as_ref(),
            localize: Some(Localize { cameras, held_out, protections }),
            cameras: prepared.centers(),
            up: prepared.input.up,
            ..Self::of(&prepared.original)
        }
    }

    /// Returns points in memory, with the default plan.
    pub fn of(original: &'a Original<3>) -> Self {
        let points = original.reveal();
        Self {
            original,
            descriptors: None,
            localize: None,
            cameras: Vec::new(),
            up: None,
            plan: Plan::new(points.unit()).for_map(points.len(), USUAL_K),
            inversion: None,
        }
    }
}

/// Maximum number of photos shown beside pictures.
const SHEETS: usize = 3;
/// K of a default audit of a map.
const USUAL_K: usize = 50;

/// Reads a map and prepares it for an audit; `descriptors` is a separate file of descriptors. The result has notes and doubts about the
/// input.
///
/// # Errors
/// If a file cannot be read, if the scale makes lengths meaningless, or if too few points are
/// left.
pub fn open(
    path: &Path,
    descriptors: Option<&Path>,
    preparation: &Preparation,
) -> Result<Prepared, Error> {
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
    prepared.input = input;
    Ok(prepared)
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

impl Map<'_> {
    /// Attacks the map: in `tiles`, or as it is `hidden`.
    pub(crate) fn attack(
        &self,
        tiles: Option<Tiles>,
        hidden: Option<&Hidden<'_>>,
        audit: &Audit<'_>,
        progress: &dyn Progress,
    ) -> Result<Attacked, Error> {
        let (original, plan) = (self.original, &self.plan);
        let release = hidden.map(|hidden| hidden.release);
        let localize = self.localize.as_ref().filter(|_| tiles.is_none());
        let of_hidden = release.is_some_and(|(released, _)| released.descriptors().is_some());
        let mut tried = Tried::by(plan, self.descriptors.is_some() || of_hidden);
        tried.localizes = localize.is_some_and(|localize| !localize.cameras.views.is_empty());
        let notes = audit.doubts.iter().chain(&audit.notes);
        audit.begin(&tried, Some(original.reveal()), notes, progress)?;
        let of_file = |error| match &audit.about.path {
            Some(file) => Error::from(unlift_io::Error::core(file, error)),
            None => Error::from(error),
        };
        // Localization comes first: wrong features are reported before the long attacks.
        let (localization, notes_on_images) = match localize {
            Some(localize) => localization::of_schemes(localize, original, plan, progress)?,
            None => Default::default(),
        };
        let cut = |tiles: Tiles| tiles.of(original.reveal().positions(), self.up);
        let cut = tiles.map(cut).transpose()?;
        let spread = match &cut {
            Some(tiles) => Spread::of_tiles(original, tiles, plan.k),
            None => Spread::of(original.reveal().positions(), plan.k),
        };
        let spread = spread.map_err(of_file)?;
        if let Some(release) = release {
            check_truth(original, release, &spread).map_err(of_file)?;
        }
        let Ran { mut outcome, scene, curves, sheets, tile_rows } = match &cut {
            Some(tiles) => {
                let whole = (original, self.descriptors);
                let (outcome, tile_rows, curves) = tiles::run(whole, tiles, plan, progress)
                    .map_err(|error| of_file(error).advise("a larger --tile-points"))?;
                let curves = curves.shares();
                Ran { outcome, scene: None, curves, sheets: Vec::new(), tile_rows }
            }
            None => {
                let mut watcher = self.watcher(audit.output.share_safe, progress);
                let outcome =
                    match release {
                        None => run(original, self.descriptors, plan, &mut watcher).map_err(
                            |error| of_file(error).advise("a smaller --k, or fewer --schemes"),
                        )?,
                        Some(release) => {
                            run_released((original, self.descriptors), release, plan, &mut watcher)
                                .map_err(of_file)?
                        }
                    };
                if let Some(error) = watcher.failed {
                    return Err(error);
                }
                let scene = watcher.pictures.map(|p| p.into_scene(&self.cameras, self.up));
                let (curves, sheets) = (watcher.curves.shares(), watcher.sheets);
                Ran { outcome, scene, curves, sheets, tile_rows: Vec::new() }
            }
        };
        // Of values that are no better than a blind guess there is nothing to say.
        let beats = |alone: &&Alone, row: &Row| {
            alone.shares.iter().any(|(label, share)| share.percent() > row.blind_percent[label])
        };
        let read = hidden.and_then(|hidden| hidden.read.as_ref());
        let given = plan.schemes.first().map(|scheme| scheme.name());
        for row in outcome.rows.iter_mut().filter(|row| given == Some(&*row.scheme)) {
            row.add_alone(read.filter(|alone| beats(alone, row)).cloned());
        }
        let followed = release.map(|release| follows_places(original, release));
        let of_file: Vec<String> =
            audit.doubts.iter().cloned().chain(followed.into_iter().flatten()).collect();
        let rows = (plan, &outcome.rows[..], &tile_rows[..]);
        let doubts = doubts((original, spread), release, rows, &of_file);
        for note in doubts.notes.iter().filter(|note| !audit.doubts.contains(note)) {
            progress.say(&format!("note: {note}"));
        }
        let mut options = audit.options.clone();
        if let Some(inversion) = &self.inversion {
            options.insert("inverter_sha256".into(), inversion.sha256().into());
        }
        if let Some(Tiles { max_points, only }) = tiles {
            options.insert("tile_points".into(), max_points.into());
            options.extend(only.map(|at| ("tile".to_owned(), at.into())));
        }
        let of_tiles = |tiles: &Vec<Tile>| document::tiles(tiles, &tile_rows, &outcome.rows);
        let (error_cdf, inversions) = (curves_of(curves, &outcome.rows), sheets);
        Ok(Attacked {
            tried,
            about: Some(with_sides(audit.about.clone(), original.reveal())),
            options: document::options(plan, options),
            notes: [audit.notes.clone(), doubts.notes, notes_on_images].concat(),
            doubts: doubts.of_rows,
            localization,
            tiles: cut.as_ref().map(of_tiles).unwrap_or_default(),
            scene,
            drawn: RenderOptions { error_cdf, inversions, ..RenderOptions::default() },
            rows: outcome.rows,
            not_audited: outcome.not_audited,
            break_even: outcome.break_even,
            seconds: outcome.seconds,
            images: Vec::new(),
        })
    }

    /// Creates the observer of the cells.
    fn watcher<'a>(&self, share_safe: bool, progress: &'a dyn Progress) -> Watcher<'a> {
        let n_views = self.plan.schemes.len() * self.plan.rows_per_scheme();
        let inversion = self.inversion.clone();
        let n_sheets = inversion.as_ref().map_or(0, |inversion| inversion.n_photos().min(SHEETS));
        Watcher {
            progress,
            pictures: (!share_safe).then(|| Pictures::new(self.original, &self.plan, n_views)),
            curves: Curves::new(&self.plan, progress),
            inversion,
            sheets: vec![Sheet::default(); if share_safe { 0 } else { n_sheets }],
            failed: None,
        }
    }
}

/// The results of an attack before they are checked.
struct Ran {
    outcome: Outcome,
    scene: Option<Scene3d>,
    curves: Vec<(Row, Vec<(f64, f64)>)>,
    sheets: Vec<Sheet>,
    tile_rows: Vec<Vec<Row>>,
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

/// Points and shapes that are collected while an audit runs.
struct Pictures {
    sample: Vec<usize>,
    /// The middle of the map. Relative to it `f32` is precise enough, even for georeferenced maps.
    middle: [f64; 3],
    bounds: SceneBox,
    scene: Scene3d,
}

/// Maximum number of shapes per scheme; more lines cannot be distinguished.
const MAX_SHAPES: usize = 3_000;

impl Pictures {
    /// Chooses the points for `n_views` results.
    fn new(original: &Original<3>, plan: &Plan<3>, n_views: usize) -> Self {
        let points = original.reveal().positions();
        let max_points = points_within_budget(n_views, plan.schemes.len());
        let sample = subsample(points.len(), max_points, plan.seed);
        let middle = rounded_origin(points);
        let originals: Vec<[f32; 3]> =
            sample.iter().map(|&at| near(&points[at], &middle)).collect();
        let bounds = SceneBox::robust(&originals);
        let scene = Scene3d { originals, n_points: points.len() as u64, ..Scene3d::default() };
        Self { sample, middle, bounds, scene }
    }

    /// Adds one result.
    fn add(&mut self, cell: &Cell<'_>) {
        let mut slot_of = vec![None; cell.original.len()];
        for (slot, original) in cell.secret.hidden().iter().enumerate() {
            slot_of[original.index()] = Some(slot);
        }
        if self.scene.obfuscations.iter().all(|view| view.scheme != cell.row.scheme) {
            let slots = self.sample.iter().filter_map(|&at| slot_of[at]);
            let mut records: Vec<usize> =
                slots.map(|slot| slot / cell.released.slots_per_record()).collect();
            records.sort_unstable();
            records.dedup();
            records.truncate(MAX_SHAPES);
            let shapes = shapes(&self.bounds, &self.middle, cell.released, &records);
            let shown = self.sample.iter().enumerate();
            let withheld = shown.filter(|&(_, &at)| slot_of[at].is_none()).map(|(i, _)| i);
            self.scene.obfuscations.push(ObfuscationView {
                scheme: cell.row.scheme.to_owned(),
                shapes,
                n_records: cell.released.obfuscation().len() as u64,
                withheld: withheld.collect(),
            });
        }
        let recovered = self.sample.iter().map(|&at| {
            let position = slot_of[at].and_then(|slot| cell.recovered.position(slot));
            position.map_or([f32::NAN; 3], |p| near(&p, &self.middle))
        });
        let (attack, recovered) = (Attack::of(cell.row), recovered.collect());
        self.scene.views.push(ByAttack { attack, recovered });
    }

    /// Returns the finished scene; `cameras` are in the unit of the audit.
    fn into_scene(mut self, cameras: &[[f64; 3]], up: Option<[f64; 3]>) -> Scene3d {
        self.scene.cameras = cameras.iter().map(|c| near(c, &self.middle)).collect();
        self.scene.up = up.map(|v| v.map(|x| x as f32));
        self.scene
    }
}

/// Returns the records with these numbers, clipped to `bounds`, relative to `middle`.
pub(crate) fn shapes(
    bounds: &SceneBox,
    middle: &[f64; 3],
    released: &Released<3>,
    records: &[usize],
) -> Shapes {
    let origin = released.origin();
    let place = |p: &[f32; 3]| -> [f32; 3] {
        std::array::from_fn(|c| (f64::from(p[c]) + origin[c] - middle[c]) as f32)
    };
    match released.obfuscation() {
        Obfuscation::Lines(_) | Obfuscation::Rays(_) => {
            let corner = |corner: [f32; 3]| [0, 1, 2].map(|c| f64::from(corner[c]) + middle[c]);
            let frame = Bounds { low: corner(bounds.low), high: corner(bounds.high) };
            let segments = record_segments(released, &frame, records.iter().copied());
            let ends = |ends: [[f64; 3]; 2]| ends.map(|end| near(&end, middle));
            Shapes::Segments(segments.into_iter().map(ends).collect())
        }
        Obfuscation::AxisPlanes(planes) => {
            let patch = |&r: &usize| {
                let axis = usize::from(planes.axis()[r]);
                let shift = (origin[axis] - middle[axis]) as f32;
                bounds.axis_patch(axis, planes.offset()[r] + shift)
            };
            Shapes::Patches(records.iter().filter_map(patch).collect())
        }
        Obfuscation::AxisCandidates(candidates) => {
            Shapes::Points(records.iter().map(|&r| place(&candidates.position()[r])).collect())
        }
    }
}

/// Returns a point relative to `middle`.
pub(crate) fn near(point: &[f64; 3], middle: &[f64; 3]) -> [f32; 3] {
    std::array::from_fn(|c| (point[c] - middle[c]) as f32)
}
