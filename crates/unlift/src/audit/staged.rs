//! Stages of an audit for callers that process one image at a time.

use std::borrow::Cow;

pub use super::plan::{key_of, oracle_seed};

use super::cells::Finished;
use super::lists::{Kept, Lists};
use super::many::{Pool, merge_counts};
use super::plan::{NeighborsBy, Variant};
use super::row::{ByReason, Row, dropped, measure};
use super::share::Threshold;
use crate::Error;
use crate::evaluate::{blind, distinct_weights};
use crate::neighbors::Neighborhoods;
use crate::neighbors::oracle::{self, Noise};
use crate::recover::Recovered;
use crate::released::Released;
use crate::truth::{Original, Secret};

/// Makes lists of `k` records at inlier ratio `ratio`, shorter in an image with few points.
///
/// # Errors
/// When the secret does not belong to these points, or a map has too few of them.
pub fn oracle_lists<const D: usize>(
    original: &Original<D>,
    hidden: &(Released<D>, Secret),
    (noise, ratio, k): (Noise, f64, usize),
    seed: u64,
) -> Result<Neighborhoods, Error> {
    let search = oracle::search(original)?;
    let by = &NeighborsBy::Oracle;
    let variant = Variant { by, noise: Some(noise), inlier_ratio: Some(ratio) };
    // The oracle's lists do not depend on the attacker's seed.
    let kept = Kept::default();
    let mut lists = Lists::new(k, &search, hidden, (seed, 0), &kept);
    Ok(lists.make(&variant, D == 2)?.lists)
}

/// A row over many images, added one by one. Memory does not grow with their number.
#[derive(Debug)]
pub struct Pooled {
    pool: Option<Pool>,
    thresholds: Vec<Threshold>,
    /// True if the blind figures of every image are known.
    with_blind: bool,
    /// Dropped points of images of which nothing was released.
    dropped: ByReason,
}

impl Pooled {
    /// Returns an empty sum with these thresholds.
    pub fn new(thresholds: &[Threshold]) -> Self {
        let thresholds = thresholds.to_vec();
        Self { pool: None, thresholds, with_blind: true, dropped: ByReason::new() }
    }

    /// Adds the result of one image. Without its released map the row has no blind figures.
    ///
    /// # Errors
    /// When the arguments do not belong together.
    pub fn add(
        &mut self,
        recovered: &Recovered<2>,
        original: &Original<2>,
        secret: &Secret,
        released: Option<&Released<2>>,
    ) -> Result<(), Error> {
        let baseline = released.map(|released| blind(released, original, secret));
        let (mut row, accuracy) =
            measure(recovered, original, secret, baseline.as_ref(), &self.thresholds)?;
        self.with_blind &= baseline.is_some();
        let baseline = &baseline.unwrap_or_else(|| accuracy.clone());
        let weights = distinct_weights(original, secret);
        row.fill_distinct(&accuracy, baseline, &weights, &self.thresholds);
        let (secret, whole) = (Cow::Borrowed(secret), Vec::new());
        let finished = Finished { row, accuracy, baseline, secret, weights, whole, n_listed: 0 };
        let pool = Pool::of(&finished, &self.thresholds);
        match &mut self.pool {
            None => self.pool = Some(pool),
            Some(all) => all.merge(&pool),
        }
        Ok(())
    }

    /// Adds an image of which no point was released.
    pub fn add_unreleased(&mut self, secret: &Secret) {
        merge_counts(&mut self.dropped, &dropped(secret));
    }

    /// Returns the row over all images, without its name; `None` if no image released a point.
    pub fn row(&self) -> Option<Row> {
        let mut row = self.pool.as_ref()?.row();
        merge_counts(&mut row.dropped, &self.dropped);
        if !self.with_blind {
            row.blind_percent.clear();
            row.interval.iter_mut().for_each(|interval| interval.blind_percent.clear());
            row.blind_median_error = None;
            row.distinct.iter_mut().for_each(|distinct| distinct.blind_percent.clear());
        }
        Some(row)
    }
}
