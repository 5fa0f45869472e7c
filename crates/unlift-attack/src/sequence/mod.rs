//! Recovery of keypoints from a sequence of protected queries whose poses are known.
//!
//! A line seen from a known pose is a plane, and three planes meet in a point. Links between queries come from descriptors alone.
//!
//! ```text
//! queries, poses ──Links──> tracks ──triangulate──> points ──project──> positions on the records
//! ```

mod triangulate;

use std::collections::HashMap;
use std::ops::Range;

use triangulate::{Fit, MISS, MOST_HYPOTHESES, Sight, triangulate};

use crate::geometry::camera::Camera;
use crate::geometry::frame::Bounds;
use crate::geometry::vector::{distance, dot, median, sub, widen};
use crate::neighbors::{Blocks, Neighborhoods, comparable, mutual};
use crate::parallel;
use crate::recover::{Confidence, Estimate, RecoverOptions, Recovered, Status, recover_from};
use crate::released::{Obfuscation, Rays, Released};
use crate::{About, Descriptors, Error, RowOrder, Unit};

/// Cosine of the largest angle between the viewing directions of two queries that are compared: 75 degrees.
const TURNED: f64 = 0.26;

/// A protected query and the pose at which the service localized it.
#[derive(Clone, Debug)]
pub struct Query {
    /// The released records and descriptors. Pixels are those of a pinhole camera, without distortion.
    pub released: Released<2>,
    /// The camera; the middle of the first pixel is `(0, 0)`.
    pub camera: Camera,
}

impl Query {
    fn sight(&self, projection: [[f64; 4]; 3], slot: usize) -> Sight {
        let (records, origin) = (self.released.obfuscation(), self.released.origin());
        let record = slot / self.released.slots_per_record();
        let absolute = |p: &[f32; 2]| [0, 1].map(|c| f64::from(p[c]) + origin[c]);
        let through = |(p, d): (&[f32; 2], &[f32; 2])| {
            let [x, y] = widen(d);
            let length = dot(&[x, y], &[x, y]).sqrt();
            let normal = [-y / length, x / length];
            [normal[0], normal[1], -dot(&normal, &absolute(p))]
        };
        let at = |axis: usize, x: f64| if axis == 0 { [1.0, 0.0, -x] } else { [0.0, 1.0, -x] };
        let lines: Vec<[f64; 3]> = match records {
            Obfuscation::Lines(_) | Obfuscation::Rays(_) => {
                records.line(record).map(through).into_iter().collect()
            }
            Obfuscation::AxisCandidates(candidates) => {
                let [u, v] = absolute(&candidates.position()[record]);
                vec![at(0, u), at(1, v)]
            }
            Obfuscation::AxisPlanes(planes) => {
                let axis = usize::from(planes.axis()[record]);
                vec![at(axis, f64::from(planes.offset()[record]) + origin[axis])]
            }
        };
        let region = |rays: &Rays<2>| Some(rays.regions()?[usize::from(rays.center()[record])]);
        let region = records.rays().and_then(region).map(|of| of.about(&origin.map(|x| -x)));
        let area = region.or(self.released.bounds()).unwrap_or(EVERYWHERE);
        Sight::new(projection, area, &lines)
    }
}

const EVERYWHERE: Bounds<2> = Bounds { low: [f64::NEG_INFINITY; 2], high: [f64::INFINITY; 2] };

/// Positions of one query's keypoints, recovered from a sequence.
#[derive(Clone, Debug)]
pub struct Solved {
    /// Positions with their confidence.
    pub recovered: Recovered<2>,
    /// Number of views of each slot's track, with the query itself.
    pub n_views: Vec<usize>,
    /// Condition of each position: its standard deviation in pixels if all lines are off by one pixel. Infinite without a position.
    pub condition: Vec<f64>,
    /// The noise of keypoints and poses that the tracks show, in pixels.
    pub noise_px: f64,
}

/// Noise with which tracks are first triangulated, in pixels. Shares depend little on it.
const FIRST_NOISE_PX: f64 = 5.0;
const LEAST_NOISE_PX: f64 = 1.0;
/// Largest noise assumed, in pixels. With more, every line would agree.
const MOST_NOISE_PX: f64 = 12.0;
/// Side of an image of unknown size, in pixels.
const USUAL_SIDE_PX: f64 = 600.0;
/// Planes that meet in a point.
const LEAST_VIEWS: usize = 3;
/// Tracks with at least this many agreeing views show the noise.
const TELLING: usize = 5;

/// Recovers the keypoints of `queries[query]` from the queries in `window`, which may contain it. The position of a slot is the projection
/// of its point in space, moved onto its own record.
///
/// # Errors
/// When `query` or the window is out of range.
pub fn recover(
    queries: &[Query],
    links: &Links,
    query: usize,
    window: Range<usize>,
) -> Result<Solved, Error> {
    if query >= queries.len() || window.end > queries.len() {
        let found = format!("query {query}, window {window:?}");
        return Err(Error::new("sequence", format!("{} queries", queries.len()), found));
    }
    let projections: Vec<_> = queries.iter().map(|query| query.camera.projection()).collect();
    let own = &queries[query];
    let n_slots = own.released.n_slots();
    let sight = |query: usize, slot: usize| queries[query].sight(projections[query], slot);
    let sights = |slot: usize| -> Vec<Sight> {
        let track = links.track(query, slot, &window);
        let others = track.iter().map(|&(other, at)| sight(other as usize, at as usize));
        std::iter::once(sight(query, slot)).chain(others).collect()
    };
    let solve = |noise_px: f64, least_views: usize| -> Vec<(usize, Option<Fit>)> {
        let of = |slot: usize| {
            let sights = sights(slot);
            let enough = sights.len() >= least_views;
            (sights.len(), enough.then(|| triangulate(&sights, noise_px)).flatten())
        };
        parallel::map(n_slots, of)
    };
    let first = solve(FIRST_NOISE_PX, TELLING);
    let telling = first.iter().filter_map(|(_, fit)| fit.filter(|fit| fit.n_agree >= TELLING));
    let mut residuals: Vec<f64> = telling.map(|fit| fit.residual_px).collect();
    // A track's residual has three unknowns less than views, and a noise that is too small loses more than one too large.
    let noise_px = match residuals.is_empty() {
        true => FIRST_NOISE_PX,
        false => (2.0 * median(&mut residuals)).clamp(LEAST_NOISE_PX, MOST_NOISE_PX),
    };
    let fits = solve(noise_px, LEAST_VIEWS);
    let is_pair = matches!(own.released.obfuscation(), Obfuscation::AxisCandidates(_));
    let origin = own.released.origin();
    let estimate = |(n_views, fit): &(usize, Option<Fit>)| match fit {
        Some(fit) => {
            let position = [0, 1].map(|c| (fit.place[c] - origin[c]) as f32);
            let axis = if is_pair { 1 - fit.line } else { 0 };
            Estimate::at(position, fit.n_agree as u32, axis, 0.0)
        }
        None if *n_views < LEAST_VIEWS => Estimate::lost(Status::TooFewNeighbors),
        None => Estimate::lost(Status::NoSupport),
    };
    let estimates: Vec<Estimate<2>> = fits.iter().map(estimate).collect();
    let side = own.released.bounds().map_or(USUAL_SIDE_PX, |bounds| {
        let [width, height] = sub(&bounds.high, &bounds.low);
        (width * height).sqrt()
    });
    let confidence = fits.iter().map(|(n_views, fit)| match fit {
        Some(fit) => confidence(fit, *n_views, is_pair, (noise_px, side)),
        None => Confidence::LOST,
    });
    let about =
        About { map: Some(own.released.fingerprint()), order: RowOrder::Slots, ..About::default() };
    let recovered = Recovered::try_new(&estimates, is_pair, None, origin, Unit::Pixel, noise_px)?
        .with_about(about)
        .with_confidence(confidence.collect())?;
    let condition = |(_, fit): &(usize, Option<Fit>)| fit.map_or(f64::INFINITY, |f| f.condition);
    Ok(Solved {
        recovered,
        n_views: fits.iter().map(|(n_views, _)| *n_views).collect(),
        condition: fits.iter().map(condition).collect(),
        noise_px,
    })
}

/// Positions of a sequence with at least this probability tell how often lists alone are right.
const SURE: f32 = 0.9;
/// Lists alone are right if they place a keypoint this near to a sure position, in pixels.
const NEAR_PX: f64 = 10.0;

/// Recovers the keypoints of a query also from its lists of neighbors. `known` has the positions that [`recover`] found, and `alone` those
/// that lists alone give. Known positions stay if they are likelier right than those of lists alone, or near them. There is no confidence.
///
/// # Errors
/// When the lists do not have one row per slot, or the arguments are of different queries.
pub fn with_lists(
    known: &Recovered<2>,
    query: &Query,
    (lists, alone): (&Neighborhoods, &Recovered<2>),
    seed: u64,
) -> Result<Recovered<2>, Error> {
    let confidence = known.confidence().unwrap_or_default();
    let is_near = |slot: usize| {
        let both = known.position(slot).zip(alone.position(slot));
        both.is_some_and(|(a, b)| distance(&a, &b) <= NEAR_PX)
    };
    let sure = || (0..confidence.len()).filter(|&slot| confidence[slot].found >= SURE);
    let right = sure().filter(|&slot| is_near(slot)).count() as f32 / sure().count().max(1) as f32;
    let keeps = |slot: usize, row: &Confidence| row.found > right || is_near(slot);
    let kept = |(slot, row)| if keeps(slot, row) { *row } else { Confidence::LOST };
    let kept = confidence.iter().enumerate().map(kept).collect();
    let known = known.clone().with_confidence(kept)?;
    let options = RecoverOptions { seed, ..RecoverOptions::default() };
    recover_from(&known, &query.released, lists, &options)
}

/// Predicts whether a fit is right, and its error: more views agree than by chance (docs/decisions/sequence.md).
fn confidence(
    fit: &Fit,
    n_views: usize,
    is_pair: bool,
    (noise_px, side): (f64, f64),
) -> Confidence {
    let n_lines = if is_pair { 2.0 } else { 1.0 };
    // Probability that a wrong record passes within the distance that counts as agreement.
    let chance = (n_lines * 2.0 * MISS * noise_px / side).min(0.5);
    let (n, agree) = ((n_views - 3) as f64, fit.n_agree.clamp(3, n_views) as f64 - 3.0);
    let ln_choose =
        |n: f64, k: f64| libm::lgamma(n + 1.0) - libm::lgamma(k + 1.0) - libm::lgamma(n - k + 1.0);
    let others = n_views as f64 - 1.0;
    let tried =
        (0.5 * others * (others - 1.0) * n_lines * n_lines * n_lines).min(MOST_HYPOTHESES as f64);
    // Logarithm of the number of hypotheses on which as many views would agree by chance.
    let surprise = -agree * libm::log(chance) - ln_choose(n, agree) - libm::log(tried);
    let logit = -0.3 + 0.42 * surprise.min(40.0) + 0.05 * fit.lead.min(30.0);
    let found = 1.0 / (1.0 + libm::exp(-logit));
    // `noise_px` is twice the residual, and the median of an error is two thirds of its deviation.
    Confidence { found: found as f32, scale: (0.33 * noise_px * fit.condition) as f32 }
}

/// A mutual nearest neighbor is a link if its distance is below this share of that of the second nearest (docs/decisions/sequence.md).
const RATIO: f32 = 0.95;

/// Links between the slots of all queries of a sequence.
#[derive(Clone, Debug, Default)]
pub struct Links {
    /// Linked (query, slot) of each (query, slot) that has any, at most one per other query, sorted.
    of_slot: HashMap<(u32, u32), Vec<(u32, u32)>>,
}

impl Links {
    /// Links mutual nearest neighbors of the descriptors of queries fewer than `reach` apart that look in similar directions.
    ///
    /// # Errors
    /// When a query has no descriptors, or two have descriptors of different length.
    pub fn by_descriptors(queries: &[Query], reach: usize) -> Result<Self, Error> {
        let mut described: Vec<&Descriptors> = Vec::with_capacity(queries.len());
        for (at, query) in queries.iter().enumerate() {
            let Some(descriptors) = query.released.descriptors() else {
                return Err(Error::new(format!("query {at}"), "descriptors", "none"));
            };
            described.push(descriptors);
            let (what, rule) = (format!("descriptors of query {at}"), " columns, as in query 0");
            Error::check_len(&what, descriptors.dim(), described[0].dim(), rule)?;
        }
        let described = comparable(&described);
        let blocks: Vec<Blocks> = parallel::map(described.len(), |at| Blocks::new(&described[at]));
        let toward = |query: usize| &queries[query].camera.pose.rotation[2];
        let pairs: Vec<(usize, usize)> = (0..queries.len())
            .flat_map(|a| (a + 1..queries.len().min(a + reach)).map(move |b| (a, b)))
            .filter(|&(a, b)| dot(toward(a), toward(b)) > TURNED)
            .collect();
        let of_pair = |at: usize| mutual(&blocks[pairs[at].0], &blocks[pairs[at].1]);
        let found = parallel::map(pairs.len(), of_pair);
        let mut links = Self::default();
        for (&(a, b), found) in pairs.iter().zip(&found) {
            for &(row, column, _) in found.iter().filter(|pair| pair.2 < RATIO * RATIO) {
                links.link((a as u32, row), (b as u32, column));
            }
        }
        Ok(links)
    }

    /// Links all slots of each track, a list of (query, slot). Of several slots of a query in one track, the first counts.
    pub fn of_tracks(tracks: impl IntoIterator<Item = Vec<(u32, u32)>>) -> Self {
        let mut links = Self::default();
        for mut track in tracks {
            track.sort_unstable();
            for (at, &a) in track.iter().enumerate() {
                track[at + 1..].iter().filter(|b| b.0 != a.0).for_each(|&b| links.link(a, b));
            }
        }
        links
    }

    /// Returns these links for other releases of the same keypoints. `of_slots` has, per query, the old slot of each new slot.
    ///
    /// # Panics
    /// When a slot is out of range or a slot has no new one.
    #[must_use]
    pub fn reordered(&self, of_slots: &[Vec<u32>]) -> Self {
        let inverse = |of: &Vec<u32>| {
            let mut new = vec![0; of.len()];
            of.iter().enumerate().for_each(|(slot, &old)| new[old as usize] = slot as u32);
            new
        };
        let new: Vec<Vec<u32>> = of_slots.iter().map(inverse).collect();
        let moved = |&(query, slot): &(u32, u32)| (query, new[query as usize][slot as usize]);
        let of_slot = |(at, linked): (_, &Vec<_>)| (moved(at), linked.iter().map(moved).collect());
        Self { of_slot: self.of_slot.iter().map(of_slot).collect() }
    }

    fn link(&mut self, a: (u32, u32), b: (u32, u32)) {
        for (from, to) in [(a, b), (b, a)] {
            let known = self.of_slot.entry(from).or_default();
            if let Err(at) = known.binary_search_by_key(&to.0, |link| link.0) {
                known.insert(at, to);
            }
        }
    }

    /// Returns the track of `slot` of `query` among the queries in `window`: at most one (query, slot) per other query. A query that is
    /// not linked directly adds the slot to which most linked ones are linked.
    pub fn track(&self, query: usize, slot: usize, window: &Range<usize>) -> Vec<(u32, u32)> {
        let within = |link: &&(u32, u32)| window.contains(&(link.0 as usize));
        let linked = |link: &(u32, u32)| self.of_slot.get(link).map_or(&[][..], Vec::as_slice);
        let direct = linked(&(query as u32, slot as u32));
        let mut found: Vec<(u32, u32)> = direct.iter().filter(within).copied().collect();
        let is_new = |link: &&(u32, u32)| {
            let is_linked = direct.binary_search_by_key(&link.0, |direct| direct.0).is_ok();
            link.0 as usize != query && !is_linked
        };
        let votes = found.iter().flat_map(|link| linked(link).iter().filter(within).filter(is_new));
        let mut votes: Vec<(u32, u32)> = votes.copied().collect();
        votes.sort_unstable();
        for of_query in votes.chunk_by(|a, b| a.0 == b.0) {
            // Of slots with equally many votes, the first.
            let best = of_query.chunk_by(|a, b| a == b).rev().max_by_key(|votes| votes.len());
            found.extend(best.and_then(<[_]>::first));
        }
        found.sort_unstable();
        found
    }
}
