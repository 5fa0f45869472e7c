//! An audit of many: their points pooled, a few of them in memory at a time.

use rayon::prelude::*;

use super::break_even::break_even;
use super::cells::{Finished, Owned};
use super::clock::Clock;
use super::clock::{RowSeconds, Seconds};
use super::item::of_item;
use super::observer::{Observer, Silent};
use super::plan::Plan;
use super::pool::Pool;
use super::row::Row;
use super::run::Outcome;
use crate::neighbors::oracle;
use crate::truth::Original;
use crate::{Descriptors, Error};

/// An image as its owner holds it.
#[derive(Clone, Debug)]
pub struct Image {
    /// Its name: in reports, and what its randomness comes from, so that an image's rows do not depend on
    /// the others. Two images should not have the same.
    pub name: String,
    /// Its keypoints, in pixels, within its bounds ([`Original::within`]).
    pub original: Original<2>,
    /// One row per keypoint.
    pub descriptors: Option<Descriptors>,
}

/// Hears how an audit of images goes.
///
/// Several images are at work at the same time: what is seen of one is collected on its own, and handed
/// over when its turn comes.
pub trait Watcher {
    /// What is collected of one image. It hears the progress of that image, from a thread of its own.
    type OfImage: Observer<2> + Send;

    /// Before an image is begun.
    fn begin(&mut self) -> Self::OfImage;

    /// `done` of `total` images are finished, as far as their number is known; `what` comes next.
    fn progress(&mut self, done: usize, total: usize, what: &str) {
        let _ = (done, total, what);
    }

    /// One image is finished, in the order of the images. `rows` has one per scheme, source, noise model,
    /// inlier ratio and solver, in this order; none for an image without keypoints.
    fn image(&mut self, name: &str, rows: &[Row], seen: Self::OfImage) {
        let _ = (name, rows, seen);
    }
}

impl Watcher for Silent {
    type OfImage = Self;

    fn begin(&mut self) -> Self {
        Self
    }
}

/// Images at work per thread: while a large one is finished the others' threads are not idle.
const AT_WORK: usize = 2;

/// Runs `plan` on all `images`, a few at a time.
///
/// Rows depend on the images, their names and the plan alone: the same bytes for any number of threads.
/// Memory does not grow with the number of images. Seconds are summed over images that are at work
/// at the same time.
///
/// # Errors
/// When the plan is not for images, an image cannot be read or has no bounds or descriptors that are
/// needed.
pub fn run_images<E: From<Error>>(
    images: impl IntoIterator<Item = Result<Image, E>>,
    plan: &Plan<2>,
    watcher: &mut impl Watcher,
) -> Result<Outcome, E> {
    plan.check_for_many()?;
    let mut images = images.into_iter();
    let expected = images.size_hint().0;
    let at_work = AT_WORK * rayon::current_num_threads();
    let mut all = Sums::default();
    let (mut n_images, mut n_too_small) = (0, 0);
    loop {
        let batch = images.by_ref().take(at_work).collect::<Result<Vec<Image>, E>>()?;
        let Some(first) = batch.first() else { break };
        watcher.progress(n_images, expected.max(n_images), &first.name);
        let begun: Vec<_> = batch.into_iter().map(|image| (image, watcher.begin())).collect();
        let one = |(image, mut seen)| {
            let done = one(&image, plan, &mut seen);
            (image, seen, done)
        };
        let done: Vec<_> = begun.into_par_iter().with_max_len(1).map(one).collect();
        for (image, seen, done) in done {
            let (rows, sums) = done.map_err(|error| error.within(&image.name))?;
            all.merge(sums);
            n_images += 1;
            n_too_small += usize::from(image.original.len() <= plan.k);
            watcher.image(&image.name, &rows, seen);
        }
    }
    watcher.progress(n_images, n_images, "done");
    let Sums { pools, rows: seconds, clock } = all;
    let pooled = |pools: &Vec<Pool>| {
        let repeats: Vec<Row> = pools.iter().map(|pool| pool.row(&plan.thresholds)).collect();
        Row::mean(&repeats)
    };
    let rows: Vec<Row> = pools.iter().map(pooled).collect();
    let break_even = break_even(plan, &rows);
    let seconds = Seconds { rows: seconds, ..clock.seconds };
    let (n_items, not_audited) = (n_images, Vec::new());
    Ok(Outcome { rows, not_audited, break_even, n_items, n_too_small, seconds })
}

/// What is summed over images.
#[derive(Default)]
struct Sums {
    /// Per row and repeat.
    pools: Vec<Vec<Pool>>,
    /// Per row.
    rows: Vec<RowSeconds>,
    clock: Clock,
}

impl Sums {
    /// Adds the sums of the next image.
    fn merge(&mut self, more: Self) {
        self.clock.merge(&more.clock);
        if self.pools.is_empty() {
            (self.pools, self.rows) = (more.pools, more.rows);
            return;
        }
        let pools = self.pools.iter_mut().flatten();
        pools.zip(more.pools.iter().flatten()).for_each(|(to, more)| to.merge(more));
        self.rows.iter_mut().zip(&more.rows).for_each(|(to, more)| to.add(more));
    }
}

/// The rows of one image, and its sums; nothing without keypoints.
fn one(
    image: &Image,
    plan: &Plan<2>,
    seen: &mut dyn Observer<2>,
) -> Result<(Vec<Row>, Sums), Error> {
    let mut sums = Sums::default();
    if image.original.is_empty() {
        seen.progress(1, 1, "done");
        return Ok((Vec::new(), sums));
    }
    check(image, plan)?;
    let Sums { pools, rows: seconds, clock } = &mut sums;
    let search = clock.time(|s| &mut s.search, || oracle::search(&image.original))?;
    let (original, descriptors) = (&image.original, image.descriptors.as_ref());
    let (hidden, name) = (None, Some(&*image.name));
    let owned = Owned { original, descriptors, hidden, search: &search, name };
    let mut each = |row: usize, finished: &Finished<'_>| {
        if pools.len() <= row {
            pools.push(Vec::new());
        }
        let mut pool = Pool::new(&finished.row, &plan.thresholds);
        pool.add(finished, &plan.thresholds);
        pools[row].push(pool);
    };
    let found = of_item(&owned, plan, clock, seen, &mut each)?;
    *seconds = found.seconds;
    Ok((found.rows, sums))
}

/// What [`Plan::check_for_many`] cannot know.
fn check(image: &Image, plan: &Plan<2>) -> Result<(), Error> {
    if image.original.bounds().is_none() {
        return Err(Error::new("image size", "known", "none"));
    }
    if image.descriptors.is_some() { Ok(()) } else { plan.without_descriptors() }
}
