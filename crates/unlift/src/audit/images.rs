//! An audit of many images: their keypoints pooled, one image in memory at a time.

use super::break_even::{BreakEven, break_even};
use super::cells::{Owned, Run, cells};
use super::clock::Clock;
use super::plan::Plan;
use super::pool::Pool;
use super::row::Row;
use super::run::{Observer, RowSeconds, Seconds};
use crate::neighbors::oracle;
use crate::seed::{Draws, Stage};
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

/// What an audit of images found.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// One row per scheme, source, noise model, inlier ratio and solver, in this order, over the keypoints
    /// of all images. Keypoints of images with too few to be attacked count, as lost.
    pub rows: Vec<Row>,
    /// The ratio at which half of the keypoints come back, per scheme, noise model and solver.
    pub break_even: Vec<BreakEven>,
    /// Images, those without keypoints included.
    pub n_images: usize,
    /// Images with no more keypoints than a neighborhood has: too few to be attacked.
    pub n_too_small: usize,
    /// Where the time went.
    pub seconds: Seconds,
}

/// Runs `plan` on all `images`, one after the other.
///
/// Rows depend on the images, their names and the plan alone: the same bytes for any number of threads.
/// Memory does not grow with the number of images. `observer` hears the rows of every image; progress is
/// counted in images.
///
/// # Errors
/// When the plan is not for images, an image cannot be read or has no bounds or descriptors that are
/// needed.
pub fn run<E: From<Error>>(
    images: impl IntoIterator<Item = Result<Image, E>>,
    plan: &Plan,
    observer: &mut dyn Observer<2>,
) -> Result<Outcome, E> {
    plan.check_for_images()?;
    let mut clock = Clock::default();
    let images = images.into_iter();
    let expected = images.size_hint().0;
    let mut pools: Vec<Vec<Pool>> = Vec::new();
    let mut seconds: Vec<RowSeconds> = Vec::new();
    let (mut n_images, mut n_too_small) = (0, 0);
    for image in images {
        let image = image?;
        observer.progress(n_images, expected.max(n_images), &image.name);
        n_images += 1;
        n_too_small += usize::from(image.original.len() <= plan.k);
        if image.original.is_empty() {
            observer.image(&image.name, &[]);
            continue;
        }
        let rows = one(&image, plan, &mut clock, observer, &mut pools, &mut seconds)
            .map_err(|error| error.within(&image.name))?;
        observer.image(&image.name, &rows);
    }
    observer.progress(n_images, n_images, "done");
    let pooled = |pools: &Vec<Pool>| {
        let repeats: Vec<Row> = pools.iter().map(|pool| pool.row(&plan.thresholds)).collect();
        Row::mean(&repeats)
    };
    let rows: Vec<Row> = pools.iter().map(pooled).collect();
    clock.seconds.rows = seconds;
    let break_even = break_even(plan, &rows);
    Ok(Outcome { rows, break_even, n_images, n_too_small, seconds: clock.seconds })
}

/// The rows of one image, added to the pools of its row and repeat.
fn one(
    image: &Image,
    plan: &Plan,
    clock: &mut Clock,
    observer: &mut dyn Observer<2>,
    pools: &mut Vec<Vec<Pool>>,
    seconds: &mut Vec<RowSeconds>,
) -> Result<Vec<Row>, Error> {
    check(image, plan)?;
    let search = clock.time(|s| &mut s.search, || oracle::search(&image.original))?;
    let descriptors = image.descriptors.as_ref();
    let owned =
        Owned { original: &image.original, descriptors, search: &search, one_of_many: true };
    let mut by_repeat: Vec<Vec<Row>> = Vec::new();
    let mut first = 0;
    for &entry in &plan.schemes {
        let mut next = first;
        for repeat in 0..plan.repeats {
            let seed = plan.seed.wrapping_add(u64::from(repeat));
            let seed = Draws::new(seed, Stage::Image, hash(&image.name)).bits();
            next = first;
            let run = Run { plan, entry, repeat, seed };
            cells(&owned, &run, clock, observer, |_, _, finished| {
                let Some(finished) = finished else { return };
                if by_repeat.len() <= next {
                    by_repeat.push(Vec::new());
                }
                if pools.len() <= next {
                    pools.push(Vec::new());
                    seconds.push(RowSeconds::default());
                }
                if pools[next].len() <= repeat as usize {
                    pools[next].push(Pool::new(&finished.row, &plan.thresholds));
                }
                pools[next][repeat as usize].add(&finished, &plan.thresholds);
                seconds[next].add(&finished.seconds);
                by_repeat[next].push(finished.row);
                next += 1;
            })?;
        }
        first = next;
    }
    Ok(by_repeat.iter().map(|repeats| Row::mean(repeats)).collect())
}

/// What [`Plan::check_for_images`] cannot know.
fn check(image: &Image, plan: &Plan) -> Result<(), Error> {
    if image.original.bounds().is_none() {
        return Err(Error::new("image size", "known", "none"));
    }
    if image.descriptors.is_none()
        && let Some(source) = plan.needs_descriptors()
    {
        let expected = format!("some, as neighbors by {} need them", source.name());
        return Err(Error::new("descriptors", expected, "none"));
    }
    Ok(())
}

/// FNV-1a, 64 bits.
fn hash(name: &str) -> u64 {
    let step = |h: u64, byte: u8| (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
    name.bytes().fold(0xCBF2_9CE4_8422_2325, step)
}
