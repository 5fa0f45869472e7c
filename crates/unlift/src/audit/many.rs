//! Audit of many images, or of the tiles of a large map, whose points are pooled.

use std::collections::BTreeMap;
use std::ops::AddAssign;

use rayon::prelude::*;

use super::cells::{Finished, Owned, Rows, of_item};
use super::clock::{RowSeconds, Seconds};
use super::missing::{NotAudited, add_new};
use super::observer::{Observer, Silent};
use super::plan::Plan;
use super::row::{Alone, Distinct, Parts, Row, places_within, within};
use super::run::Outcome;
use super::share::{Shares, Threshold};
use crate::evaluate::Accuracy;
use crate::truth::Original;
use crate::{Descriptors, Error};

/// An image or a tile of a map with its ground truth.
#[derive(Clone, Debug)]
pub struct Item<const D: usize> {
    /// Unique name. Random seeds depend on it, so rows do not depend on other items.
    pub name: String,
    /// Keypoints of an image, in pixels, within its bounds ([`Original::within`]); points of a tile.
    pub original: Original<D>,
    /// One row per point.
    pub descriptors: Option<Descriptors>,
}

/// Receives the progress and the rows of an audit of many items.
///
/// Images are processed in parallel, each with an observer, which [`item`](Self::item) returns.
pub trait Watcher<const D: usize> {
    /// Observer of one item. It runs on a thread of its own.
    type OfItem: Observer<D> + Send;

    /// Returns the observer of the next item.
    fn begin(&mut self) -> Self::OfItem;

    /// Called when `done` of `total` items are finished, if the total is known; `what` comes next.
    fn progress(&mut self, done: usize, total: usize, what: &str) {
        let _ = (done, total, what);
    }

    /// Called for each finished item, in order.
    ///
    /// `rows` has one row per scheme, source, noise model, inlier ratio and solver. Rows that could
    /// not be audited are missing, as are all of an image without keypoints.
    fn item(&mut self, name: &str, rows: &[Row], seen: Self::OfItem) {
        let _ = (name, rows, seen);
    }
}

impl<const D: usize> Watcher<D> for Silent {
    type OfItem = Self;

    fn begin(&mut self) -> Self {
        Self
    }
}

/// Images in progress per thread: other images keep threads busy while a large one finishes.
const AT_WORK: usize = 2;

/// Runs `plan` on all `items`: a few images at a time, or one tile, which uses all threads.
///
/// Rows depend only on the items, their names and the plan: byte-identical for any number of
/// threads. Memory does not grow with the number of items. Seconds are summed over items. A cell
/// that failed in one tile has no row, because a share of some tiles is not a share of the map.
///
/// # Errors
/// When the plan is for a single item, when an item cannot be read, lacks required descriptors or
/// is an image without bounds, or when no scheme can be applied to the tiles.
pub fn run_many<const D: usize, E: From<Error>>(
    items: impl IntoIterator<Item = Result<Item<D>, E>>,
    plan: &Plan<D>,
    watcher: &mut impl Watcher<D>,
) -> Result<Outcome, E> {
    plan.check_for_many()?;
    let sums_of: SumsOf<D> = SUMS_OF.of()?;
    let mut items = items.into_iter();
    let expected = items.size_hint().0;
    let at_work = if D == 2 { AT_WORK * rayon::current_num_threads() } else { 1 };
    let mut all = Sums::default();
    let (mut n_items, mut n_too_small) = (0, 0);
    loop {
        let batch = items.by_ref().take(at_work).collect::<Result<Vec<Item<D>>, E>>()?;
        let Some(first) = batch.first() else { break };
        watcher.progress(n_items, expected.max(n_items), &first.name);
        let begun: Vec<_> = batch.into_iter().map(|item| (item, watcher.begin())).collect();
        let work = |(item, mut observer): (Item<D>, _)| {
            let done = sums_of(&item, plan, &mut observer);
            (item, observer, done)
        };
        let done: Vec<_> = begun.into_par_iter().with_max_len(1).map(work).collect();
        for (item, observer, done) in done {
            let (rows, sums) = done.map_err(|error| error.within(&item.name))?;
            all.merge(sums);
            n_items += 1;
            n_too_small += usize::from(item.original.len() <= plan.k);
            watcher.item(&item.name, &rows, observer);
        }
    }
    watcher.progress(n_items, n_items, "done");
    let Sums { mut cells, not_audited, n_pooled, clock } = all;
    cells.retain(|cell| cell.n_items == n_pooled);
    let pooled = |cell: &CellSums| {
        (Row::mean(&cell.pools.iter().map(Pool::row).collect::<Vec<_>>()), cell.seconds)
    };
    let (rows, seconds) = cells.iter().map(pooled).unzip();
    let all = Rows { rows, seconds, not_audited };
    Ok(Outcome::new(plan, all, clock, [n_items, n_too_small])?)
}

#[derive(Default)]
struct Sums {
    /// Cells in the order of the first item's rows.
    cells: Vec<CellSums>,
    not_audited: Vec<NotAudited>,
    /// Number of items with points.
    n_pooled: usize,
    clock: Seconds,
}

struct CellSums {
    /// The sums of each repeat.
    pools: Vec<Pool>,
    n_items: usize,
    seconds: RowSeconds,
}

impl Sums {
    fn merge(&mut self, more: Self) {
        self.clock.merge(&more.clock);
        self.n_pooled += more.n_pooled;
        add_new(&mut self.not_audited, more.not_audited);
        for cell in more.cells {
            match self.cells.iter_mut().find(|known| known.pools[0].is_of(&cell.pools[0].cell)) {
                Some(to) => {
                    to.pools.iter_mut().zip(&cell.pools).for_each(|(to, more)| to.merge(more));
                    to.seconds.add(&cell.seconds);
                    to.n_items += cell.n_items;
                }
                None => self.cells.push(cell),
            }
        }
    }
}

type SumsOf<const D: usize> =
    fn(&Item<D>, &Plan<D>, &mut dyn Observer<D>) -> Result<(Vec<Row>, Sums), Error>;

unlift_attack::both! { SUMS_OF: SumsOf = sums_of }

/// Returns the rows of one item and its sums; both are empty without points.
fn sums_of<const D: usize>(
    item: &Item<D>,
    plan: &Plan<D>,
    observer: &mut dyn Observer<D>,
) -> Result<(Vec<Row>, Sums), Error> {
    let mut sums = Sums::default();
    if item.original.is_empty() {
        observer.progress(1, 1, "done");
        return Ok((Vec::new(), sums));
    }
    // What `Plan::check_for_many` cannot check.
    if D == 3 {
        plan.check(item.original.len(), item.descriptors.is_some())?;
    } else if item.original.bounds().is_none() {
        return Err(Error::new("image size", "known", "none"));
    } else if item.descriptors.is_none() {
        plan.without_descriptors()?;
    }
    let (original, descriptors) = (&item.original, item.descriptors.as_ref());
    let owned = Owned { original, descriptors, hidden: None, name: Some(&item.name) };
    let mut all_pools: Vec<Vec<Pool>> = Vec::new();
    let mut each = |finished: &Finished<'_>| {
        let pool = Pool::of(finished, &plan.thresholds);
        match all_pools.iter_mut().find(|pools| pools[0].is_of(&finished.row)) {
            Some(pools) => pools.push(pool),
            None => all_pools.push(vec![pool]),
        }
    };
    let Rows { rows, seconds, not_audited } =
        of_item(&owned, plan, &mut sums.clock, observer, &mut each)?;
    for (row, seconds) in rows.iter().zip(seconds) {
        // A cell that failed in another repeat has no row.
        if let Some(at) = all_pools.iter().position(|pools| pools[0].is_of(row)) {
            let pools = all_pools.swap_remove(at);
            sums.cells.push(CellSums { pools, n_items: 1, seconds });
        }
    }
    (sums.not_audited, sums.n_pooled) = (not_audited, 1);
    Ok((rows, sums))
}

/// Bits of the mantissa of an `f32` that the histogram of errors ignores: bins are 0.05 % wide.
const DROPPED_BITS: u32 = 12;

/// Weighted sum of a figure, and the weight of the points or images that have it.
#[derive(Clone, Copy, Debug, Default)]
struct Figure {
    sum: f64,
    known: usize,
    /// True if images count once, not points.
    of_images: bool,
}

/// Sums over images. Shares are computed at the end, so rounding errors do not add up.
#[derive(Debug)]
pub(super) struct Pool {
    /// Row of the first image, which identifies the cell. Its numbers of points and its reliability are those of all images.
    cell: Row,
    /// Sums by figure: of entries and true entries of lists, of percentages times points. A figure that no image has is absent.
    sums: BTreeMap<&'static str, f64>,
    /// Points and distinct places within each threshold.
    shares: SharesByName,
    metrics: BTreeMap<String, Figure>,
    trials: BTreeMap<u32, u64>,
    /// Shares of each attack on the records alone.
    alone: SharesByName,
    errors: Errors,
    blind_errors: Errors,
}

impl Pool {
    fn is_of(&self, row: &Row) -> bool {
        self.cell.is_same_cell(row)
    }

    /// Returns the sums of one image.
    pub(super) fn of(finished: &Finished<'_>, thresholds: &[Threshold]) -> Self {
        let Finished { row, accuracy, baseline, weights, whole, n_listed, .. } = finished;
        let n = accuracy.n_points();
        let percentage = |percent: Option<f64>| percent.map(|percent| percent * n as f64);
        let sums = [
            ("delta", Some(row.delta * n as f64)),
            ("listed", Some(*n_listed as f64)),
            ("hits", Some(row.inlier_ratio * *n_listed as f64)),
            ("places", Some(weights.iter().sum())),
            ("exact", accuracy.n_exact.map(|n_exact| n_exact as f64)),
            ("axis", percentage(row.axis_accuracy_percent)),
            ("assignment", percentage(row.assignment_accuracy_percent)),
        ];
        let figure = |(name, value): (&String, &f64)| {
            let of_images = whole.contains(name);
            let known = if of_images { 1 } else { n };
            (name.clone(), Figure { sum: value * known as f64, known, of_images })
        };
        Self {
            cell: row.clone(),
            sums: sums.into_iter().filter_map(|(name, sum)| Some((name, sum?))).collect(),
            shares: BTreeMap::from([
                ("recovered", within(accuracy, thresholds)),
                ("blind", within(baseline, thresholds)),
                ("places", places_within(accuracy, weights, thresholds)),
                ("blind places", places_within(baseline, weights, thresholds)),
            ]),
            metrics: row.metrics.iter().map(figure).collect(),
            trials: row.ransac_trials.iter().flatten().copied().collect(),
            alone: row.parts.alone.iter().map(|of| (of.name, of.shares.clone())).collect(),
            errors: Errors::of(accuracy),
            blind_errors: Errors::of(baseline),
        }
    }

    /// Adds the sums of `more`, a pool of the same row.
    pub(super) fn merge(&mut self, more: &Self) {
        let (all, of_more) = (&mut self.cell, &more.cell);
        all.n_points += of_more.n_points;
        merge_counts(&mut all.lost, &of_more.lost);
        merge_counts(&mut all.dropped, &of_more.dropped);
        if let (Some(all), Some(more)) = (&mut all.parts.reliability, &of_more.parts.reliability) {
            all.merge(more);
        }
        // Confidence counts only if it is known for all items.
        all.sure_unknown = all.sure_unknown.take().or_else(|| of_more.sure_unknown.clone());
        merge_counts(&mut self.sums, &more.sums);
        merge_shares(&mut self.shares, &more.shares);
        merge_shares(&mut self.alone, &more.alone);
        for (name, more) in &more.metrics {
            let figure = self.metrics.entry(name.clone()).or_default();
            figure.sum += more.sum;
            figure.known += more.known;
            figure.of_images = more.of_images;
        }
        merge_counts(&mut self.trials, &more.trials);
        merge_counts(&mut self.errors.0, &more.errors.0);
        merge_counts(&mut self.blind_errors.0, &more.blind_errors.0);
    }

    pub(super) fn row(&self) -> Row {
        let Row { n_points, parts, sure_unknown, .. } = &self.cell;
        let n = (*n_points).max(1) as f64;
        let sum = |name| self.sums.get(name).copied();
        let total = |name| sum(name).unwrap_or(0.0);
        let is_known =
            |(_, figure): &(&String, &Figure)| figure.of_images || figure.known == *n_points;
        let alone = |(&name, shares): (&&'static str, &Shares)| {
            // An attack that cannot run on an item recovers nothing there.
            let of_all = shares.iter().map(|(label, share)| (label.clone(), share.among(n)));
            Alone { name, shares: of_all.collect() }
        };
        let mut row = Row {
            // A requested ratio identifies the cell. A measured one is a mean over entries.
            inlier_ratio: match self.cell.oracle_noise {
                None if total("listed") > 0.0 => total("hits") / total("listed"),
                _ => self.cell.inlier_ratio,
            },
            delta: total("delta") / n,
            n_lost: self.cell.lost.values().sum(),
            axis_accuracy_percent: sum("axis").map(|sum| sum / n),
            exact_percent: sum("exact").map(|exact| 100.0 * exact / n),
            metrics: self
                .metrics
                .iter()
                .filter(is_known)
                .map(|(name, figure)| (name.clone(), figure.sum / figure.known.max(1) as f64))
                .collect(),
            blind_median_error: self.blind_errors.percentile(50.0, *n_points),
            ransac_trials: (self.cell.ransac_trials.is_some() || !self.trials.is_empty())
                .then(|| self.trials.iter().map(|(&up_to, &slots)| (up_to, slots)).collect()),
            parts: Parts {
                alone: self.alone.iter().map(alone).collect(),
                reliability: parts.reliability.clone().filter(|_| sure_unknown.is_none()),
            },
            assignment_accuracy_percent: sum("assignment").map(|sum| sum / n),
            distinct: self.cell.distinct.as_ref().map(|_| {
                Distinct::of(total("places"), &self.shares["places"], &self.shares["blind places"])
            }),
            ..self.cell.clone()
        };
        row.fill_shares(&self.shares["recovered"], &self.shares["blind"]);
        row.fill_errors(|p| self.errors.percentile(p, *n_points));
        row.summarize();
        row
    }
}

/// Histogram of finite errors by their leading bits.
#[derive(Debug)]
struct Errors(BTreeMap<u32, usize>);

impl Errors {
    fn of(accuracy: &Accuracy) -> Self {
        let mut counts = BTreeMap::new();
        for &error in accuracy.errors().iter().filter(|error| error.is_finite()) {
            *counts.entry((error as f32).to_bits() >> DROPPED_BITS).or_insert(0) += 1;
        }
        Self(counts)
    }

    /// Returns the error that `percent` of `of` points do not exceed, if as many were recovered.
    fn percentile(&self, percent: f64, of: usize) -> Option<f64> {
        let rank = ((percent / 100.0 * of as f64).ceil() as usize).max(1);
        let mut below = 0;
        for (&bin, &count) in &self.0 {
            below += count;
            if below >= rank {
                // Errors of exactly 0 stay 0; other bins return their middle.
                let half = if bin == 0 { 0 } else { 1 << (DROPPED_BITS - 1) };
                return Some(f64::from(f32::from_bits(bin << DROPPED_BITS | half)));
            }
        }
        None
    }
}

type SharesByName = BTreeMap<&'static str, Shares>;

fn merge_shares(to: &mut SharesByName, more: &SharesByName) {
    for (name, more) in more {
        let to = to.entry(name).or_default();
        more.iter().for_each(|(label, more)| to.entry(label.clone()).or_default().merge(more));
    }
}

pub(super) fn merge_counts<K: Clone + Ord, N: Copy + AddAssign + Default>(
    to: &mut BTreeMap<K, N>,
    more: &BTreeMap<K, N>,
) {
    for (key, &count) in more {
        *to.entry(key.clone()).or_default() += count;
    }
}
