//! Audit of many images, or of the tiles of a large map. Points are pooled; a few items are in
//! memory at a time.

use rayon::prelude::*;

use super::break_even::break_even;
use super::cells::{Finished, Owned};
use super::clock::{Clock, RowSeconds, Seconds};
use super::item::{Rows, of_item};
use super::not_audited::NotAudited;
use super::observer::{Observer, Silent};
use super::plan::Plan;
use super::pool::Pool;
use super::row::Row;
use super::run::{Outcome, none_applies};
use crate::compiled::Both;
use crate::neighbors::oracle;
use crate::truth::Original;
use crate::{Descriptors, Error};

/// An image or a tile of a map with its ground truth.
#[derive(Clone, Debug)]
pub struct Item<const D: usize> {
    /// Unique name, used in reports. Random seeds depend on it, so the rows of an item do not
    /// depend on other items.
    pub name: String,
    /// Keypoints of an image, in pixels, within its bounds ([`Original::within`]); points of a tile.
    pub original: Original<D>,
    /// One row per point.
    pub descriptors: Option<Descriptors>,
}

/// Receives the progress and the rows of an audit of many items.
///
/// Several images are processed at the same time. Each has its own observer, which
/// [`item`](Self::item) returns in the order of the items.
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
    /// `rows` has one row per scheme, source, noise model, inlier ratio and solver, in this order.
    /// Rows of a tile that could not be audited are missing. An image without keypoints has no
    /// rows.
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

/// Runs `plan` on all `items`: a few images at a time; tiles one by one, because each uses all
/// threads.
///
/// Rows depend only on the items, their names and the plan: byte-identical for any number of
/// threads. Memory does not grow with the number of items. Seconds are summed over items, also over
/// items in progress at the same time. A cell that failed in one tile has no row, because a share
/// of some tiles is not a share of the map.
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
    let one: One<D> = ONE.of()?;
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
        let one = |(item, mut seen): (Item<D>, _)| {
            let done = one(&item, plan, &mut seen);
            (item, seen, done)
        };
        let done: Vec<_> = begun.into_par_iter().with_max_len(1).map(one).collect();
        for (item, seen, done) in done {
            let (rows, sums) = done.map_err(|error| error.within(&item.name))?;
            all.merge(sums);
            n_items += 1;
            n_too_small += usize::from(item.original.len() <= plan.k);
            watcher.item(&item.name, &rows, seen);
        }
    }
    watcher.progress(n_items, n_items, "done");
    let Sums { mut cells, not_audited, n_pooled, clock } = all;
    cells.retain(|cell| cell.n_items == n_pooled);
    if let (true, Some(first)) = (cells.is_empty(), not_audited.first()) {
        return Err(none_applies(first).into());
    }
    let pooled = |cell: &CellSums| {
        let repeats: Vec<Row> = cell.pools.iter().map(|pool| pool.row(&plan.thresholds)).collect();
        Row::mean(&repeats)
    };
    let rows: Vec<Row> = cells.iter().map(pooled).collect();
    let break_even = break_even(plan, &rows);
    let seconds = cells.iter().map(|cell| cell.seconds).collect();
    let seconds = Seconds { rows: seconds, ..clock.seconds };
    Ok(Outcome { rows, not_audited, break_even, n_items, n_too_small, seconds })
}

#[derive(Default)]
struct Sums {
    /// Cells in the order of the first item's rows.
    cells: Vec<CellSums>,
    not_audited: Vec<NotAudited>,
    /// Number of items with points.
    n_pooled: usize,
    clock: Clock,
}

struct CellSums {
    /// Row of the first item.
    row: Row,
    pools: Vec<Pool>,
    n_items: usize,
    seconds: RowSeconds,
}

impl Sums {
    fn merge(&mut self, more: Self) {
        self.clock.merge(&more.clock);
        self.n_pooled += more.n_pooled;
        for missing in more.not_audited {
            if !self.not_audited.iter().any(|other| other.is_same_cell(&missing)) {
                self.not_audited.push(missing);
            }
        }
        for cell in more.cells {
            match self.cells.iter_mut().find(|other| other.row.is_same_cell(&cell.row)) {
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

type One<const D: usize> =
    fn(&Item<D>, &Plan<D>, &mut dyn Observer<D>) -> Result<(Vec<Row>, Sums), Error>;

static ONE: Both<One<2>, One<3>> = Both(one::<2>, one::<3>);

/// Returns the rows of one item and its sums; both are empty without points.
fn one<const D: usize>(
    item: &Item<D>,
    plan: &Plan<D>,
    seen: &mut dyn Observer<D>,
) -> Result<(Vec<Row>, Sums), Error> {
    let mut sums = Sums::default();
    if item.original.is_empty() {
        seen.progress(1, 1, "done");
        return Ok((Vec::new(), sums));
    }
    check(item, plan)?;
    let search = sums.clock.time(|s| &mut s.search, || oracle::search(&item.original))?;
    let (original, descriptors) = (&item.original, item.descriptors.as_ref());
    let (hidden, name) = (None, Some(&*item.name));
    let owned = Owned { original, descriptors, hidden, search: &search, name };
    let mut pools: Vec<(Row, Vec<Pool>)> = Vec::new();
    let mut each = |finished: &Finished<'_>| {
        let mut pool = Pool::new(&finished.row, &plan.thresholds);
        pool.add(finished, &plan.thresholds);
        match pools.iter_mut().find(|(row, _)| row.is_same_cell(&finished.row)) {
            Some((_, pools)) => pools.push(pool),
            None => pools.push((finished.row.clone(), vec![pool])),
        }
    };
    let found = of_item(&owned, plan, &mut sums.clock, seen, &mut each)?;
    let Rows { rows, seconds, not_audited } = found;
    for (row, seconds) in rows.iter().zip(seconds) {
        // A cell that failed in another repeat has no row.
        if let Some(at) = pools.iter().position(|(other, _)| other.is_same_cell(row)) {
            let (row, pools) = pools.swap_remove(at);
            sums.cells.push(CellSums { row, pools, n_items: 1, seconds });
        }
    }
    (sums.not_audited, sums.n_pooled) = (not_audited, 1);
    Ok((rows, sums))
}

/// Checks an item for conditions that [`Plan::check_for_many`] cannot check.
fn check<const D: usize>(item: &Item<D>, plan: &Plan<D>) -> Result<(), Error> {
    if D == 2 && item.original.bounds().is_none() {
        return Err(Error::new("image size", "known", "none"));
    }
    if D == 3 {
        return plan.check(item.original.len(), item.descriptors.is_some());
    }
    if item.descriptors.is_some() { Ok(()) } else { plan.without_descriptors() }
}
