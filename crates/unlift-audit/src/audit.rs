//! One audit of any input: attack it, check the gates, make the document and the page.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Map as Options, Value};
use unlift::audit::{BreakEven, NotAudited, Plan, Row, Seconds};
use unlift::released::Released;
use unlift::truth::Secret;
use unlift::{PointSet, audit::Alone};
use unlift_report::RenderOptions;
use unlift_report::document::{self as report, ImageFigures, Localization, TileFigures};
use unlift_report::scene::Scene3d;

use crate::again::Again;
use crate::document;
use crate::doubts::with_extent;
use crate::gate::{Gate, Tried, check_gates, check_lengths_of_gates, gate_results};
use crate::images::audit::Images;
use crate::maps::Map;
use crate::outputs::Audited;
use crate::prepare::Prepared;
use crate::sequence::Sequence;
use crate::tiles::Tiles;
use crate::{Error, Progress};

/// An audit: what is attacked and how, the gates, and where the results go.
pub struct Audit<'a> {
    /// What is attacked, each with its plan.
    pub input: Input<'a>,
    /// The input in the report.
    pub about: report::Input,
    /// Recorded options, in addition to those of the plan.
    pub options: Options<String, Value>,
    /// Notes for readers of the figures; also reported as progress.
    pub notes: Vec<String>,
    /// Doubts about all figures: reported as notes, and no gate holds with one.
    pub doubts: Vec<String>,
    /// The gates.
    pub gates: Vec<Gate>,
    /// The output.
    pub output: Output,
}

/// The input of an audit.
// There is one per audit, so its size costs nothing.
#[allow(clippy::large_enum_variant)]
pub enum Input<'a> {
    /// A map, which is hidden under each scheme.
    Map(Map<'a>),
    /// A map in tiles: each is hidden and attacked as a map of its own.
    Tiles(Map<'a>, Tiles),
    /// A map that a program of the user hid.
    Released(Map<'a>, Hidden<'a>),
    /// Images, whose keypoints are hidden.
    Images(Images<'a>),
    /// Several releases of the same points.
    Views(Views<'a>),
}

/// Several releases of the same points.
#[allow(clippy::large_enum_variant)]
pub enum Views<'a> {
    /// Images with known poses, each hidden under its own key.
    Sequence(Sequence<'a>),
    /// A map that is released twice.
    Again(Again<'a>),
}

/// A released map with its secret.
pub struct Hidden<'a> {
    /// The release and its secret.
    pub release: &'a (Released<3>, Secret),
    /// An attack on values of the released file that its records do not contain.
    pub read: Option<Alone>,
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

/// What an attack gives, before gates.
#[derive(Default)]
pub(crate) struct Attacked {
    pub(crate) tried: Tried,
    pub(crate) rows: Vec<Row>,
    pub(crate) not_audited: Vec<NotAudited>,
    pub(crate) break_even: Vec<BreakEven>,
    pub(crate) seconds: Seconds,
    /// The input in the report, if the attack knows more of it.
    pub(crate) about: Option<report::Input>,
    /// Options of the report.
    pub(crate) options: Options<String, Value>,
    /// All notes of the report.
    pub(crate) notes: Vec<String>,
    /// A doubt per row, or none.
    pub(crate) doubts: Vec<Option<String>>,
    pub(crate) localization: Vec<Localization>,
    pub(crate) images: Vec<ImageFigures>,
    pub(crate) tiles: Vec<TileFigures>,
    pub(crate) scene: Option<Scene3d>,
    pub(crate) drawn: RenderOptions,
}

impl<'a> Audit<'a> {
    /// Creates an audit without gates, notes and further options.
    pub fn new(input: Input<'a>, output: Output) -> Self {
        let about = report::Input::default();
        let (options, notes, doubts, gates) = Default::default();
        Self { input, about, options, notes, doubts, gates, output }
    }

    /// Creates an audit of `prepared` points, with their notes and doubts.
    pub fn of_map(input: Input<'a>, prepared: &Prepared, output: Output) -> Self {
        let about =
            report::Input { n_points: prepared.original.len() as u64, ..Default::default() };
        let (notes, doubts) = (prepared.notes.clone(), prepared.doubts.clone());
        Self { about, notes, doubts, ..Self::new(input, output) }
    }

    /// Runs the audit and writes nothing.
    ///
    /// # Errors
    /// If the input or a file of it cannot be used, the plan does not fit it, a gate has no row, no image can be used, or `progress`
    /// stops the audit. Images of files that cannot be used are reported and counted, if there are others.
    pub fn run(self, progress: &dyn Progress) -> Result<Audited, Error> {
        match &self.input {
            Input::Map(map) => self.document(&map.plan, map.attack(None, None, &self, progress)?),
            Input::Tiles(map, tiles) => {
                self.document(&map.plan, map.attack(Some(*tiles), None, &self, progress)?)
            }
            Input::Released(map, hidden) => {
                self.document(&map.plan, map.attack(None, Some(hidden), &self, progress)?)
            }
            Input::Images(images) => self.document(&images.plan, images.attack(&self, progress)?),
            Input::Views(Views::Sequence(sequence)) => {
                self.document(&sequence.plan, sequence.attack(&self, progress)?)
            }
            Input::Views(Views::Again(again)) => {
                self.document(&again.plan, again.attack(&self, progress)?)
            }
        }
    }

    /// Checks the gates before the attack, and reports `notes`. `points` are those of a map.
    pub(crate) fn begin<'n>(
        &self,
        tried: &Tried,
        points: Option<&PointSet<3>>,
        notes: impl IntoIterator<Item = &'n String>,
        progress: &dyn Progress,
    ) -> Result<(), Error> {
        check_gates(&self.gates, tried)?;
        points.map_or(Ok(()), |points| check_lengths_of_gates(points, &self.gates))?;
        notes.into_iter().for_each(|note| progress.say(&format!("note: {note}")));
        Ok(())
    }

    /// Returns the document and what the page draws.
    fn document<const D: usize>(
        &self,
        plan: &Plan<D>,
        attacked: Attacked,
    ) -> Result<Audited, Error> {
        let gates = gate_results(&self.gates, &attacked)?;
        let input = attacked.about.unwrap_or_else(|| self.about.clone());
        let document = report::Document {
            unlift: env!("CARGO_PKG_VERSION").to_owned(),
            schema: report::SCHEMA,
            gates: with_extent(gates, &input),
            input,
            options: attacked.options,
            seed: plan.seed,
            not_audited: document::not_audited(plan, &attacked.not_audited),
            results: attacked.rows,
            notes: attacked.notes,
            break_even: attacked.break_even,
            images: attacked.images,
            tiles: attacked.tiles,
            localization: attacked.localization,
            run: document::run(&self.output, &attacked.seconds),
        };
        Ok(Audited { document, scene: attacked.scene, drawn: attacked.drawn })
    }
}
