//! Audits of a sequence of queries: every image hides its keypoints on its own, and the attacker, who
//! knows the poses, recovers them from several images.
//!
//! ```text
//! model, features ──> views ──obfuscate──> queries ──Links──> recover ──> rows by number of queries
//! ```

mod view;

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;
use serde_json::json;
use unlift::audit::staged::{Pooled, key_of};
use unlift::audit::{Plan, Row};
use unlift::evaluate::evaluate;
use unlift::geometry::camera::PoseError;
use unlift::neighbors::{Neighborhoods, Source, of_what_there_is};
use unlift::obfuscate::{Change, Scheme, obfuscate};
use unlift::recover::recover as recover_map;
use unlift::recover::{Builtin, RecoverOptions, Recovered};
use unlift::released::Obfuscation;
use unlift::seed::Key;
use unlift::sequence::{Links, Query, Solved, recover, with_lists};
use unlift::truth::{OriginalId, Secret};
use unlift_io::hash::hash_files;
use unlift_io::read;
use unlift_report::Document;
use unlift_report::attack::{SEQUENCE, SEQUENCE_AND_LISTS, TRACKS};
use unlift_report::document::ImageCounts;
use unlift_report::inversions::Inversion as Sheet;
use unlift_vision::pictures::{Points, trusted};

use self::view::{Model, View};
use crate::audit::output::{Audit, Audited};
use crate::document::{Attacked, Tried, names};
use crate::error::check_stop;
use crate::gate::check_gates;
use crate::images::{FeatureSource, Opened, evenly};
use crate::inversion::Inversion;
use crate::maps::released::slot_of;
use crate::sources::BY_DESCRIPTORS;
use crate::{Error, Progress};

/// Images with known poses, and how they are attacked.
pub struct Sequence<'a> {
    /// The COLMAP project or model with the poses.
    pub model: &'a Path,
    /// The features of the images.
    pub opened: &'a Opened,
    /// The plan: schemes, thresholds and seed count.
    pub plan: Plan<2>,
    /// Makes lists of neighbors within each query, which the attacker combines with the other queries, if wanted.
    pub lists: Option<Arc<dyn Source<2>>>,
    /// Numbers of queries to attack with, ascending.
    pub queries: Vec<usize>,
    /// The error that is added to the poses.
    pub pose_error: Option<PoseError>,
    /// Makes pictures of recovered keypoints, if they are wanted.
    pub inversion: Option<Inversion>,
}

const SOLVER: &str = "triangulation";
/// A line of each of three views meets the others in a point.
const LEAST_VIEWS: usize = 3;

impl Sequence<'_> {
    /// Attacks the images. Fewer than two with usable features, or fewer than the smallest number of queries, are an error.
    pub(super) fn attack(&self, audit: &Audit, progress: &dyn Progress) -> Result<Audited, Error> {
        let Opened { source, path, .. } = self.opened;
        let FeatureSource { passed_over, refused, .. } = source;
        passed_over.iter().for_each(|note| progress.note(note));
        progress.show(0, 1, "reading images");
        let input = read::open(self.model)?;
        let Some(folder) = &input.model else {
            let expected = "a COLMAP model, which has the poses";
            return Err(unlift_io::Error::new(self.model, "", expected, input.format).into());
        };
        let pose_error = self.pose_error.map(|error| (error, self.plan.seed));
        refused.iter().for_each(|line| progress.say(line));
        let model = Model::read(folder)?;
        let views = model.views((source, path), pose_error);
        let n_found = views.len() + refused.len();
        let told = |view: Result<View, Error>| view.inspect_err(|e| progress.say(&e.to_string()));
        let views: Vec<View> = views.into_iter().flat_map(told).collect();
        let fewest = self.queries.first().copied().unwrap_or(2);
        if views.len() < fewest {
            let expected = format!("at least {fewest} images that are in {}", self.model.display());
            let found = views.len().to_string();
            return Err(unlift_io::Error::new(path, "", expected, found).into());
        }
        let wrong = |(expected, found)| unlift_io::Error::new(path, "", expected, found);
        alike(&views, model.positions.len()).map_err(wrong)?;
        let mut notes = Vec::new();
        let n_left_out: usize = views.iter().map(|view| view.n_left_out).sum();
        if n_left_out > 0 {
            notes.push(format!(
                "{n_left_out} keypoints have no place in a pinhole camera: left out"
            ));
        }
        let (queries, too_many): (Vec<usize>, Vec<usize>) =
            self.queries.iter().partition(|n| **n <= views.len());
        if !too_many.is_empty() {
            notes.push(format!("{} images: no rows for {too_many:?} queries", views.len()));
        }
        let tried = self.tried(&queries);
        check_gates(&audit.gates, &tried, None)?;
        notes.iter().for_each(|note| progress.note(note));
        let mut options = names(&tried, &audit.options);
        options.insert("queries".into(), json!(queries));
        options.extend(self.lists.as_ref().map(|by| ("lists".to_owned(), json!(by.name()))));
        if let Some(error) = self.pose_error {
            options.insert("pose_error_distance".into(), json!(error.center));
            options.insert("pose_error_angle_deg".into(), json!(error.rotation_degrees));
        }
        let counts = ImageCounts {
            used: views.len() as u64,
            unusable: (n_found - views.len()) as u64,
            ..ImageCounts::default()
        };
        let n_points = views.iter().map(|view| view.original.len()).sum();
        let mut about = self.opened.about(&self.opened.chosen, n_points, counts)?;
        about.other_sha256.insert("model".to_owned(), hash_files(&input.files)?);
        let document = Document { input: about, options, notes, ..Document::default() };
        let mut attacked = Attacked { tried, document, ..Attacked::default() };
        self.attack_views(&views, &queries, &mut attacked, progress)?;
        // Photos that could not be used have no pictures.
        attacked.rendering.inversions.retain(|sheet| !sheet.views.is_empty());
        audit.finish(&self.plan, attacked)
    }

    fn kinds(&self) -> impl Iterator<Item = &'static str> {
        [SEQUENCE, TRACKS].into_iter().chain(self.lists.is_some().then_some(SEQUENCE_AND_LISTS))
    }

    fn tried(&self, queries: &[usize]) -> Tried {
        let sources = queries.iter().flat_map(|n| self.kinds().map(move |by| format!("{by}@{n}")));
        let is_best = |by: &Arc<dyn Source<2>>| by.name() == BY_DESCRIPTORS.name;
        Tried {
            sources: sources.collect(),
            solvers: vec![SOLVER.to_owned()],
            inlier_ratios: Vec::new(),
            lacks_best_source: !self.lists.as_ref().is_some_and(is_best),
            ..Tried::by(&self.plan, false)
        }
    }

    /// Hides the views under each scheme and attacks them with each number of queries.
    fn attack_views(
        &self,
        views: &[View],
        queries: &[usize],
        attacked: &mut Attacked,
        progress: &dyn Progress,
    ) -> Result<(), Error> {
        let Attacked { document, seconds, rendering, .. } = attacked;
        let (plan, rows) = (&self.plan, &mut document.results);
        let reach = queries.iter().copied().max().unwrap_or(0);
        let mut known: Option<(Vec<Secret>, Links)> = None;
        let total = plan.schemes.len() * queries.len() * self.kinds().count();
        for scheme in &plan.schemes {
            let hide = || hide(&**scheme, views, plan.seed);
            let (protected, secrets) = seconds.time(|seconds| &mut seconds.obfuscate, hide)?;
            progress.show(rows.len(), total, &format!("{}, linking queries", scheme.name()));
            let started = Instant::now();
            // Links depend on descriptors and cameras only.
            let is_plain = !scheme.changes().into_iter().any(Change::changes_descriptors);
            let same = known.as_ref().filter(|_| is_plain);
            let same = same.and_then(|(of, links)| Some(links.reordered(&orders(of, &secrets)?)));
            let is_new = same.is_none();
            let links = &same.map_or_else(|| Links::by_descriptors(&protected, reach), Ok)?;
            if is_plain && is_new {
                known = Some((secrets.clone(), links.clone()));
            }
            let tracks = tracks(views, &secrets);
            let hidden = Protected { views, queries: protected, secrets };
            let lists = self.lists.as_deref().map(|by| hidden.lists(by, plan.seed)).transpose()?;
            seconds.neighbors += started.elapsed().as_secs_f64();
            let kinds = [(SEQUENCE, links, None), (TRACKS, &tracks, None)];
            let combined = lists.as_ref().map(|lists| (SEQUENCE_AND_LISTS, links, Some(lists)));
            for &n in queries {
                for (by, links, lists) in kinds.into_iter().chain(combined) {
                    check_stop(progress)?;
                    let what = format!("{}, {n} queries, links by {by}", scheme.name());
                    progress.show(rows.len(), total, &what);
                    let attack = Attack { links, lists, n, seed: plan.seed };
                    let row = || hidden.row(&attack, &tracks, plan);
                    let row = seconds.time(|seconds| &mut seconds.recover, row)?;
                    let (scheme, neighbors) = (scheme.name().to_owned(), format!("{by}@{n}"));
                    let share = |row: &Row| row.recovered_percent[plan.headline];
                    // Who has more queries can use fewer.
                    let of = |fewer: &&Row| {
                        let is_same = fewer.neighbors.split('@').next() == Some(by);
                        is_same && fewer.scheme == scheme && share(fewer) > share(&row)
                    };
                    let row = rows.iter().rfind(of).cloned().unwrap_or(row);
                    let row = Row { scheme, neighbors, k: n, solver: SOLVER.to_owned(), ..row };
                    let strongest = if combined.is_some() { SEQUENCE_AND_LISTS } else { SEQUENCE };
                    if let Some(inversion) = self.inversion.as_ref().filter(|_| by == strongest) {
                        let sheets = &mut rendering.inversions;
                        paint(inversion, (&hidden, &attack), &row, progress, sheets)?;
                    }
                    rows.push(row);
                }
            }
        }
        Ok(())
    }
}

/// Returns what was expected and found if keypoints that show one point have descriptors that are not alike.
fn alike(views: &[View], n_points: usize) -> Result<(), (String, String)> {
    let dim = views.first().map_or(0, |view| view.descriptors.dim());
    let mut alike = read::Alike::new(n_points, dim);
    for view in views.iter().filter(|view| view.descriptors.dim() == dim) {
        let (mut points, mut rows, mut row) = (Vec::new(), Vec::new(), vec![0.0; dim]);
        for (at, point) in view.shows.iter().enumerate() {
            let Some(point) = point else { continue };
            view.descriptors.read_row(at, &mut row);
            points.push(*point as usize);
            rows.extend(row.iter().map(|&x| f64::from(x)));
        }
        alike.add(&points, &rows)?;
    }
    alike.check()
}

fn hide(
    scheme: &dyn Scheme<2>,
    views: &[View],
    seed: u64,
) -> Result<(Vec<Query>, Vec<Secret>), Error> {
    let hide = |view: &View| {
        let key = key_of(&Key::from_seed(seed), &view.name);
        let hidden = obfuscate(scheme, &view.original, Some(&view.descriptors), &key);
        let (released, secret) = hidden.map_err(|error| error.within(&view.name))?;
        Ok((Query { released, camera: view.camera }, secret))
    };
    let hidden: Result<Vec<_>, unlift::Error> = views.iter().map(hide).collect();
    Ok(hidden?.into_iter().unzip())
}

/// Returns, per query, the slot under `known` of each slot under `secrets`; `None` if they do not hide the same keypoints.
fn orders(known: &[Secret], secrets: &[Secret]) -> Option<Vec<Vec<u32>>> {
    let of_query = |(known, secret): (&Secret, &Secret)| {
        let slots = slot_of(known);
        let slot = |original: &OriginalId| Some(slots[original.index()]? as u32);
        let of: Option<Vec<u32>> = secret.hidden().iter().map(slot).collect();
        of.filter(|_| known.n_slots() == secret.n_slots())
    };
    known.iter().zip(secrets).map(of_query).collect()
}

/// Links the slots that hide keypoints of the same point of the model.
fn tracks(views: &[View], secrets: &[Secret]) -> Links {
    let mut of_point: std::collections::BTreeMap<u32, Vec<(u32, u32)>> = Default::default();
    for (query, (view, secret)) in views.iter().zip(secrets).enumerate() {
        for (slot, original) in secret.hidden().iter().enumerate() {
            if let Some(point) = view.shows[original.index()] {
                of_point.entry(point).or_default().push((query as u32, slot as u32));
            }
        }
    }
    Links::of_tracks(of_point.into_values())
}

struct Protected<'a> {
    views: &'a [View],
    queries: Vec<Query>,
    secrets: Vec<Secret>,
}

/// An attack on each query by the `n` consecutive queries around it.
struct Attack<'a> {
    links: &'a Links,
    /// Lists of neighbors within each query, if they are used.
    lists: Option<&'a Vec<(Neighborhoods, Recovered<2>)>>,
    n: usize,
    seed: u64,
}

/// Whether each of these is right: keypoints, within the headline threshold, that are linked in three or more views, linked so by the
/// model's tracks, and without a point of the service's map; then links of which the model knows both keypoints.
type Outcomes = [Vec<bool>; 4];

/// Returns the percentage that is right; `None` of nothing.
fn percent(outcomes: &[bool]) -> Option<f64> {
    let n_right = outcomes.iter().filter(|&&is_right| is_right).count();
    (!outcomes.is_empty()).then(|| 100.0 * n_right as f64 / outcomes.len() as f64)
}

const NAMES: [&str; 3] = ["linked", "tracked", "new"];

impl Protected<'_> {
    /// Makes the lists of neighbors within each query, and the positions that they give alone.
    fn lists(
        &self,
        source: &dyn Source<2>,
        seed: u64,
    ) -> Result<Vec<(Neighborhoods, Recovered<2>)>, unlift::Error> {
        let options = RecoverOptions { seed, ..RecoverOptions::default() };
        let both = |query: &Query| {
            let lists = of_what_there_is(source, &query.released, seed)?;
            let alone = recover_map(&query.released, &lists, &Builtin::Joint, &options)?;
            Ok((lists, alone))
        };
        let of_query = |(query, view): (&Query, &View)| {
            both(query).map_err(|error: unlift::Error| error.within(&view.name))
        };
        self.queries.par_iter().zip(self.views).with_max_len(1).map(of_query).collect()
    }

    /// Attacks every query. `tracks` says which links are right.
    fn row(
        &self,
        attack: &Attack<'_>,
        tracks: &Links,
        plan: &Plan<2>,
    ) -> Result<Row, unlift::Error> {
        let headline = plan.thresholds[plan.headline].value;
        let of_query = |query| self.of_query(attack, tracks, query, headline);
        let queries = (0..self.views.len()).into_par_iter().with_max_len(1);
        let solved = queries.map(of_query).collect::<Result<Vec<_>, unlift::Error>>()?;
        let mut pooled = Pooled::new(&plan.thresholds);
        let mut all = Outcomes::default();
        for (query, (recovered, outcomes)) in solved.iter().enumerate() {
            let (original, released) = (&self.views[query].original, &self.queries[query].released);
            pooled.add(recovered, original, &self.secrets[query], Some(released))?;
            all.iter_mut().zip(outcomes).for_each(|(all, of)| all.extend(of));
        }
        let missing = || unlift::Error::new("sequence", "keypoints", "none");
        let mut row = pooled.row().ok_or_else(missing)?;
        let label = &plan.thresholds[plan.headline].label;
        for (name, of) in NAMES.into_iter().zip(&all) {
            let of_all = 100.0 * of.len() as f64 / row.n_points.max(1) as f64;
            row.metrics.insert(format!("{name}_percent"), of_all);
            let within = percent(of).map(|share| (format!("{name}_within_{label}_percent"), share));
            row.metrics.extend(within);
        }
        row.inlier_ratio = percent(&all[3]).unwrap_or(0.0) / 100.0;
        Ok(row)
    }

    fn solve(&self, attack: &Attack<'_>, query: usize) -> Result<Solved, unlift::Error> {
        let mut solved = recover(&self.queries, attack.links, query, self.window(query, attack.n))?;
        if let Some(lists) = attack.lists {
            let own = &self.queries[query];
            let (lists, alone) = &lists[query];
            // Where they differ from a sequence, lists are no better under `cp2d` (docs/decisions/sequence.md).
            let is_pair = matches!(own.released.obfuscation(), Obfuscation::AxisCandidates(_));
            let alone = if is_pair { &solved.recovered } else { alone };
            solved.recovered = with_lists(&solved.recovered, own, (lists, alone), attack.seed)?;
        }
        Ok(solved)
    }

    /// Attacks `query` and counts what comes back within `headline`.
    fn of_query(
        &self,
        attack: &Attack<'_>,
        tracks: &Links,
        query: usize,
        headline: f64,
    ) -> Result<(Recovered<2>, Outcomes), unlift::Error> {
        let window = self.window(query, attack.n);
        let solved = self.solve(attack, query)?;
        let original = &self.views[query].original;
        let accuracy = evaluate(&solved.recovered, original, &self.secrets[query])?;
        let mut outcomes = Outcomes::default();
        for (slot, &error) in accuracy.errors().iter().enumerate() {
            let is_within = error <= headline;
            let point = self.point(query, slot);
            let counts = [
                solved.n_views[slot] >= LEAST_VIEWS,
                1 + tracks.track(query, slot, &window).len() >= LEAST_VIEWS,
                point.is_none(),
            ];
            for (of, _) in outcomes.iter_mut().zip(counts).filter(|(_, is)| *is) {
                of.push(is_within);
            }
            let Some(point) = point else { continue };
            for (other, at) in attack.links.track(query, slot, &window) {
                if let Some(other) = self.point(other as usize, at as usize) {
                    outcomes[3].push(point == other);
                }
            }
        }
        Ok((solved.recovered, outcomes))
    }

    /// Returns the `n` consecutive queries around `query`.
    fn window(&self, query: usize, n: usize) -> Range<usize> {
        let first = query.saturating_sub(n / 2).min(self.views.len() - n);
        first..first + n
    }

    /// Returns the point of the model that a slot shows.
    fn point(&self, query: usize, slot: usize) -> Option<u32> {
        self.views[query].shows[self.secrets[query].hidden()[slot].index()]
    }
}

const SHOWN: usize = 3;

/// Paints what `row` recovers of a few queries, and adds the pictures to their sheets. Photos that cannot be used are reported once.
fn paint(
    inversion: &Inversion,
    (hidden, attack): (&Protected<'_>, &Attack<'_>),
    row: &Row,
    progress: &dyn Progress,
    sheets: &mut Vec<Sheet>,
) -> Result<(), Error> {
    for query in evenly(hidden.views.len(), Some(SHOWN)) {
        let view = &hidden.views[query];
        let at = sheets.iter().position(|sheet| sheet.name == view.name);
        let at = at.unwrap_or_else(|| {
            let size = view.size.map(|side| side as u32);
            sheets.push(Sheet { name: view.name.clone(), size, ..Sheet::default() });
            sheets.len() - 1
        });
        let places: Vec<[f32; 2]> =
            view.original.reveal().positions().iter().map(|&place| view.in_photo(place)).collect();
        let solved = hidden.solve(attack, query)?;
        let (shown, weights) = trusted(&solved.recovered, |place| view.in_photo(place));
        let Some(descriptors) = hidden.queries[query].released.descriptors() else { continue };
        let points = Points { places: &shown, descriptors, weights: &weights, depths: None };
        let original = (&places[..], &view.descriptors);
        let name = (view.name.as_str(), view.size);
        let added = inversion.add_keypoints(name, original, &points, row, &mut sheets[at]);
        if let Err(error) = added {
            progress.note(&format!("not painted: {error}"));
        }
    }
    Ok(())
}
