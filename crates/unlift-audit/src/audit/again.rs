//! Audits of a map that is released twice: each release is hidden under its own key, and the
//! attacker, who has both, intersects their records.
//!
//! ```text
//! two maps ──obfuscate──> two releases ──again──> recovered points of the first
//! ```

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::json;
use unlift::Unit;
use unlift::again::{Solved, by_descriptors, by_geometry};
use unlift::audit::frames::doubt_of_frames;
use unlift::audit::{NotAudited, Plan, Row, measure, records_alone};
use unlift::evaluate::{blind, joined};
use unlift::geometry::knn::Knn;
use unlift::geometry::vector::distance;
use unlift::obfuscate::{Scheme, obfuscate};
use unlift::released::Released;
use unlift::seed::Key;
use unlift::truth::{Original, Secret};
use unlift_io::hash::hash_files;
use unlift_report::Document;
use unlift_report::attack::{AGAIN, AGAIN_GEOMETRY};
use unlift_report::document::Input;

use super::output::{Audit, Audited};
use crate::document::{Attacked, Tried, names};
use crate::doubts::with_sides;
use crate::error::check_stop;
use crate::gate::check_gates;
use crate::maps::{self, Preparation, Prepared};
use crate::{Error, Progress, bail};

const SOLVER: &str = "intersection";

/// The two maps of an audit, in one unit.
pub struct Maps {
    /// The first map, whose points are to be recovered.
    pub first: Prepared,
    /// The second map; `None` if it is the first one again.
    pub second: Option<Prepared>,
}

impl Maps {
    /// Reads two maps. Lengths of both are in the unit of the first. `descriptors` are the files of the first and of the second map, or
    /// of both, if they are one map. Notes and doubts about the second map are added to those of the first.
    pub fn open(
        [a, b]: [&Path; 2],
        descriptors: &[PathBuf],
        preparation: &Preparation,
    ) -> Result<Self, Error> {
        let files: [Option<&Path>; 2] = match (descriptors, a == b) {
            ([], _) => [None, None],
            ([both], true) => [Some(both), Some(both)],
            ([a, b], _) => [Some(a), Some(b)],
            (given, _) => bail!(
                "--descriptors: expected one file for A and one for B, as A and B differ, found {}",
                given.len()
            ),
        };
        let mut first = maps::open(a, files[0], preparation)?;
        if (a, files[0]) == (b, files[1]) {
            return Ok(Self { first, second: None });
        }
        let mut second = maps::open(b, files[1], preparation)?;
        let points = second.original.reveal();
        if points.unit() == Unit::KthNeighbor {
            let factor = second.unit_in_map_units / first.unit_in_map_units;
            let points = points.scaled(factor, Unit::KthNeighbor);
            let points = points.map_err(|error| unlift_io::Error::core(b, error))?;
            second.original = Arc::new(Original::new(points));
        }
        let dims = [&first, &second].map(|map| map.descriptors.as_ref().map(|rows| rows.dim()));
        if let [Some(a), Some(b)] = dims
            && a != b
        {
            bail!("--descriptors: expected {a} values per descriptor of B, as of A, found {b}");
        }
        let of_second = |text: &String| format!("second map: {text}");
        first.remarks.notes.extend(second.remarks.notes.iter().map(of_second));
        first.remarks.doubts.extend(second.remarks.doubts.iter().map(of_second));
        Ok(Self { first, second: Some(second) })
    }

    fn second(&self) -> &Prepared {
        self.second.as_ref().unwrap_or(&self.first)
    }

    /// Returns what a report says of the maps, whose first is at `path`.
    pub fn about(&self, path: &Path) -> Result<Input, Error> {
        let second = ("second".to_owned(), hash_files(&self.second().input.files)?);
        Ok(Input { other_sha256: [second].into_iter().collect(), ..self.first.about(path)? })
    }
}

/// A map that is released twice, and how it is attacked.
pub struct Again<'a> {
    /// The maps.
    pub maps: &'a Maps,
    /// Schemes of the first and of the second release.
    pub pairs: Vec<[Arc<dyn Scheme<3>>; 2]>,
    /// Thresholds, seed, and whether records alone are attacked.
    pub plan: Plan<3>,
}

impl Again<'_> {
    /// Attacks both releases. A scheme that cannot hide a map is an error.
    pub(super) fn attack(&self, audit: &Audit, progress: &dyn Progress) -> Result<Audited, Error> {
        let (first, second) = (&self.maps.first, self.maps.second());
        let described = first.descriptors.is_some() && second.descriptors.is_some();
        let sources = if described { &[AGAIN, AGAIN_GEOMETRY][..] } else { &[AGAIN_GEOMETRY] };
        let tried = Tried {
            schemes: self.pairs.iter().map(name).collect(),
            sources: sources.iter().map(|&by| by.to_owned()).collect(),
            solvers: vec![SOLVER.to_owned()],
            inlier_ratios: Vec::new(),
            lacks_best_source: described,
            ..Tried::by(&self.plan, described)
        };
        let frame = self.maps.second.as_ref().map(|second| {
            let own = (&*first.original, first.descriptors.as_ref());
            doubt_of_frames(own, (&second.original, second.descriptors.as_ref()))
        });
        let frame = frame.transpose()?.flatten();
        let doubts: Vec<String> = audit.remarks.doubts.iter().cloned().chain(frame).collect();
        let without = "links by geometry only: both maps need descriptors for others";
        let without = (!described).then(|| without.to_owned());
        let notes =
            doubts.iter().chain(&audit.remarks.notes).cloned().chain(without).collect::<Vec<_>>();
        check_gates(&audit.gates, &tried, Some(first.original.reveal()))?;
        notes.iter().for_each(|note| progress.note(note));
        let mut options = names(&tried, &audit.options);
        options.insert("records_alone".into(), json!(self.plan.records_alone));
        let input = with_sides(audit.about.clone(), first.original.reveal());
        let document = Document { input, options, notes, ..Document::default() };
        let mut attacked = Attacked { tried, document, ..Attacked::default() };
        let knn = Knn::new(second.original.reveal().positions())?;
        for (at, pair) in self.pairs.iter().enumerate() {
            let (done, total) = (at * sources.len(), self.pairs.len() * sources.len());
            let show = |what: &str| {
                progress.show(done, total, &format!("{}, {what}", name(pair)));
                check_stop(progress)
            };
            self.attack_pair(pair, sources, &knn, show, &mut attacked)?;
        }
        let n_rows = attacked.document.results.len();
        if n_rows == 0 {
            let first = attacked.not_audited.first();
            let reason = first.map_or("no schemes", |missing| missing.reason.as_str());
            bail!("audit again: expected a row, found none: {reason}");
        }
        attacked.doubts = vec![doubts.first().cloned(); n_rows];
        attacked.document.doubts = doubts;
        audit.finish(&self.plan, attacked)
    }

    fn attack_pair(
        &self,
        pair: &[Arc<dyn Scheme<3>>; 2],
        sources: &[&str],
        knn: &Knn<'_, 3>,
        show: impl Fn(&str) -> Result<(), Error>,
        attacked: &mut Attacked,
    ) -> Result<(), Error> {
        let (first, second, plan) = (&self.maps.first, self.maps.second(), &self.plan);
        let Attacked { seconds, not_audited, document, .. } = attacked;
        show("two releases")?;
        let mut hide = |scheme: &dyn Scheme<3>, map: &Prepared, seed: u64| {
            let (key, descriptors) = (Key::from_seed(seed), map.descriptors.as_ref());
            let work = || obfuscate(scheme, &map.original, descriptors, &key);
            seconds.time(|seconds| &mut seconds.obfuscate, work)
        };
        let a = hide(&*pair[0], first, plan.seed)?;
        let b = hide(&*pair[1], second, plan.seed.wrapping_add(1))?;
        let mut alone = Vec::new();
        if plan.records_alone {
            show("records alone")?;
            let work = || records_alone(&a, &first.original, plan, plan.seed);
            alone = seconds.time(|seconds| &mut seconds.records_alone, work)?;
        }
        for &source in sources {
            show(source)?;
            let by = if source == AGAIN { by_descriptors } else { by_geometry };
            let solved = match seconds.time(|seconds| &mut seconds.recover, || by(&a.0, &b.0)) {
                Ok(solved) => solved,
                Err(error) => {
                    not_audited.push(NotAudited::new(&name(pair), Some(source), error));
                    continue;
                }
            };
            let mut row = row(&solved, plan, (&first.original, &a), (&second.original, &b.1), knn)?;
            row.add_alone(alone.iter().cloned());
            let (neighbors, solver) = (source.to_owned(), SOLVER.to_owned());
            document.results.push(Row { scheme: name(pair), neighbors, solver, k: 2, ..row });
        }
        Ok(())
    }
}

/// Returns the name of a pair of schemes: `olc`, or `olc/cp` for two different ones.
fn name([a, b]: &[Arc<dyn Scheme<3>>; 2]) -> String {
    if a.name() == b.name() { a.name().to_owned() } else { format!("{}/{}", a.name(), b.name()) }
}

/// Measures what came back of the first map. A link is right if no point of the second map is nearer to the first one's.
fn row(
    solved: &Solved,
    plan: &Plan<3>,
    (original, (released, secret)): (&Original<3>, &(Released<3>, Secret)),
    (second, second_secret): (&Original<3>, &Secret),
    knn: &Knn<'_, 3>,
) -> Result<Row, unlift::Error> {
    let baseline = blind(released, original, secret);
    let (mut row, accuracy) =
        measure(&solved.recovered, original, secret, Some(&baseline), &plan.thresholds)?;
    let own = joined(&solved.recovered, original, secret);
    let (points, others) = (original.reveal().positions(), second.reveal().positions());
    let per_record = second_secret.slots_per_record();
    let headline = &plan.thresholds[plan.headline];
    let (mut n_linked, mut n_right, mut n_within) = (0, 0, 0);
    for (slot, link) in solved.links.iter().enumerate() {
        let Some(record) = link else { continue };
        let point = &points[own.hidden()[slot].index()];
        let nearest = knn.nearest_within(*point, f64::INFINITY);
        let limit = nearest.map_or(f64::INFINITY, |(distance2, _)| distance2.sqrt());
        let slots = *record as usize * per_record..(*record as usize + 1) * per_record;
        let away = |hidden: &unlift::OriginalId| distance(&others[hidden.index()], point);
        n_right += usize::from(second_secret.hidden()[slots].iter().any(|at| away(at) <= limit));
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
