//! Maps: attacked whole, in tiles or as they are released.

use std::sync::Arc;

use unlift::PointSet;
use unlift::audit::doubts::{NeighborDistances, check_truth};
use unlift::audit::published::{follows_places, read_from_file};
use unlift::audit::{Alone, Cell, Observer, Plan, Row, run, run_many, run_released};
use unlift::geometry::frame::rounded_origin;
use unlift::released::Released;
use unlift::truth::Secret;
use unlift_report::inversions::Inversion as Sheet;
use unlift_report::scene::{ObfuscationView, SceneBox, points_within_budget, subsample};
use unlift_report::{ByAttack, Document, RenderOptions, Scene3d};

use super::items::OfItems;
use super::output::{Audit, Audited};
use super::tiles::{Tiles, figures};
use crate::document::{self, Attacked, Tried};
use crate::doubts::{doubts, with_sides};
use crate::gate::check_gates;
use crate::inversion::MapInversion;
use crate::localization::{Localize, localization};
use crate::maps::released::slot_of;
use crate::maps::shapes::{near, shapes};
use crate::maps::{Prepared, USUAL_K};
use crate::{Error, Progress};

/// A map, and how it is attacked.
pub struct Map<'a> {
    /// The points, descriptors and cameras.
    pub prepared: &'a Prepared,
    /// How localization with the cameras is measured, if it is; not used with tiles.
    pub localize: Option<Localize>,
    /// The plan of the attack.
    pub plan: Plan<3>,
    /// Makes pictures of recovered points; the plan measures with it, too.
    pub inversion: Option<Arc<MapInversion>>,
}

impl<'a> Map<'a> {
    /// Returns a map with the default plan.
    pub fn new(prepared: &'a Prepared) -> Self {
        let points = prepared.original.reveal();
        let plan = Plan::new(points.unit()).for_map(points.len(), USUAL_K);
        Self { prepared, localize: Some(Localize::default()), plan, inversion: None }
    }
}

/// A released map with its secret.
pub struct Hidden<'a> {
    /// The release and its secret.
    pub release: &'a (Released<3>, Secret),
    /// Values of the released file that its records do not contain, each with a position per record.
    pub published: Vec<Vec<[f64; 3]>>,
}

/// Maximum number of photos shown beside pictures.
const SHEETS: usize = 3;

impl Map<'_> {
    /// Attacks the map: in `tiles`, or as it is `hidden`.
    pub(super) fn attack(
        &self,
        tiles: Option<Tiles>,
        hidden: Option<&Hidden<'_>>,
        audit: &Audit,
        progress: &dyn Progress,
    ) -> Result<Audited, Error> {
        let Self { prepared, plan, .. } = self;
        let (original, descriptors) = (&*prepared.original, prepared.descriptors.as_ref());
        let points = original.reveal();
        let release = hidden.map(|hidden| hidden.release);
        let localize = self.localize.as_ref().filter(|_| tiles.is_none());
        let of_hidden = release.is_some_and(|(released, _)| released.descriptors().is_some());
        let mut tried = Tried::by(plan, descriptors.is_some() || of_hidden);
        tried.localizes = localize.is_some() && !prepared.cameras.views.is_empty();
        let mut remarks = audit.remarks.clone();
        if release.is_some() && plan.repeats > 1 {
            remarks.notes.push("repeats: the records of the file stay the same; for their randomness, write and audit several files".to_owned());
        }
        check_gates(&audit.gates, &tried, Some(points))?;
        remarks.doubts.iter().chain(&remarks.notes).for_each(|note| progress.note(note));
        let of_file = |error| match &audit.about.path {
            Some(file) => Error::from(unlift_io::Error::core(file, error)),
            None => Error::from(error),
        };
        // Localization comes first: wrong features are reported before the long attacks.
        let (localization, notes_on_images) = match localize {
            Some(localize) => localization(localize, prepared, plan, progress)?,
            None => Default::default(),
        };
        let cut = tiles.map(|tiles| tiles.of(points.positions(), prepared.input.up)).transpose()?;
        let usual = match &cut {
            Some(tiles) => {
                NeighborDistances::of(tiles.iter().map(|tile| tile.points(points)), plan.k)
            }
            None => NeighborDistances::of(std::iter::once(Ok(points)), plan.k),
        };
        let usual = usual.map_err(of_file)?;
        if let Some(release) = release {
            check_truth(original, release, &usual).map_err(of_file)?;
        }
        let (mut scene, mut inversions, mut tile_rows) = (None, Vec::new(), Vec::new());
        let mut outcome = match &cut {
            Some(tiles) => {
                let each = |_: &str, rows: &[Row]| tile_rows.push(rows.to_vec());
                progress.show(0, tiles.len(), "splitting the map into tiles");
                let items = tiles.iter().map(|tile| tile.item(original, descriptors));
                run_many(items, plan, &mut OfItems { steps: progress, each })
                    .map_err(|error| of_file(error).advise("a larger --tile-points"))?
            }
            None => {
                let inversion = self.inversion.clone();
                let n_sheets = inversion.as_ref().map_or(0, |by| by.n_photos().min(SHEETS));
                let draws = !audit.output.share_safe;
                let mut watcher = Watcher {
                    progress,
                    pictures: draws.then(|| Pictures::new(prepared, plan)),
                    inversion,
                    sheets: vec![Sheet::default(); if draws { n_sheets } else { 0 }],
                    failed: None,
                };
                let advice = "a smaller --k, or fewer --schemes";
                let outcome = match release {
                    None => run(original, descriptors, plan, &mut watcher)
                        .map_err(|error| of_file(error).advise(advice)),
                    Some(release) => {
                        run_released((original, descriptors), release, plan, &mut watcher)
                            .map_err(of_file)
                    }
                }?;
                if let Some(error) = watcher.failed {
                    return Err(error);
                }
                scene = watcher.pictures.map(|pictures| pictures.scene);
                inversions = watcher.sheets;
                outcome
            }
        };
        // Of values that are no better than a blind guess there is nothing to say.
        let beats = |alone: &Alone, row: &Row| {
            alone.shares.iter().any(|(label, share)| share.percent() > row.blind_percent[label])
        };
        let read = hidden.and_then(|Hidden { release, published }| {
            read_from_file(published, original, &release.1, &plan.thresholds)
        });
        let given = plan.schemes.first().map(|scheme| scheme.name());
        for row in outcome.rows.iter_mut().filter(|row| given == Some(&*row.scheme)) {
            row.add_alone(read.clone().filter(|alone| beats(alone, row)));
        }
        let mut of_points = remarks.doubts.clone();
        of_points.extend(release.iter().flat_map(|release| follows_places(original, release)));
        let rows = (plan, &outcome.rows[..], &tile_rows[..]);
        // Points that are in no record, as of a thinned map, count for the unit.
        let all = (prepared.input.positions.len() > points.len())
            .then(|| PointSet::try_new(prepared.input.positions.clone(), points.unit()));
        let of_all = match all.transpose()? {
            Some(all) => NeighborDistances::of(std::iter::once(Ok(&all)), plan.k)?.middle,
            None => usual.middle,
        };
        let release = release.map(|release| (release, of_all));
        let doubts = doubts((original, usual), release, rows, &of_points);
        for note in doubts.notes.iter().filter(|note| !remarks.doubts.contains(note)) {
            progress.note(note);
        }
        let inverter = self.inversion.as_ref().map(|inversion| inversion.sha256());
        let mut options = document::options(plan, &audit.options, inverter);
        if let Some(Tiles { max_points, only }) = tiles {
            options.insert("tile_points".into(), max_points.into());
            options.extend(only.map(|at| ("tile".to_owned(), at.into())));
        }
        let tiles = cut.iter().flat_map(|tiles| figures(tiles, &tile_rows, &outcome.rows));
        let document = Document {
            input: with_sides(audit.about.clone(), points),
            options,
            notes: [remarks.notes.clone(), doubts.notes, notes_on_images].concat(),
            doubts: doubts.all,
            localization,
            tiles: tiles.collect(),
            results: outcome.rows,
            break_even: outcome.break_even,
            ..Document::default()
        };
        let attacked = Attacked {
            tried,
            document,
            not_audited: outcome.not_audited,
            seconds: outcome.seconds,
            doubts: doubts.of_rows,
            rendering: RenderOptions { scene, inversions, ..RenderOptions::default() },
        };
        audit.finish(plan, attacked)
    }
}

struct Watcher<'a> {
    progress: &'a dyn Progress,
    pictures: Option<Pictures>,
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
        if let Some(pictures) = &mut self.pictures {
            pictures.add(cell);
        }
        if let (Some(inversion), None) = (&self.inversion, &self.failed) {
            self.failed = inversion.add(cell, &mut self.sheets).err().map(Error::from);
        }
    }
}

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
    fn new(prepared: &Prepared, plan: &Plan<3>) -> Self {
        let points = prepared.original.reveal().positions();
        let n_schemes = plan.schemes.len();
        let max_points = points_within_budget(n_schemes * plan.rows_per_scheme(), n_schemes);
        let sample = subsample(points.len(), max_points, plan.seed);
        let middle = rounded_origin(points);
        let originals: Vec<[f32; 3]> =
            sample.iter().map(|&at| near(&points[at], &middle)).collect();
        let bounds = SceneBox::robust(&originals);
        let scale = 1.0 / prepared.unit_in_map_units;
        let camera = |center: &[f64; 3]| near(&center.map(|x| x * scale), &middle);
        let scene = Scene3d {
            originals,
            n_points: points.len() as u64,
            cameras: prepared.input.cameras.iter().map(camera).collect(),
            up: prepared.input.up.map(|up| up.map(|x| x as f32)),
            ..Scene3d::default()
        };
        Self { sample, middle, bounds, scene }
    }

    fn add(&mut self, cell: &Cell<'_>) {
        let slot_of = slot_of(cell.secret);
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
        let (row, recovered) = (cell.row.clone(), recovered.collect());
        self.scene.views.push(ByAttack { row, recovered });
    }
}
