//! Localization of held-out images: their keypoints are matched with a map that was made without
//! them, and their poses are estimated from the matches.

use std::sync::Arc;

use super::cost::{FEWEST_HELD_OUT, HeldOut, Localization, upper_median};
use super::estimate::{Match, OnLine, estimate};
use super::matches::{Pair, Unit32, mutual, with_protected};
use super::{View, free_directions};
use crate::descriptors::Values;
use crate::geometry::camera::{Camera, PoseError};
use crate::geometry::frame::Bounds;
use crate::geometry::vector::{distance, median};
use crate::obfuscate::{Change, Scheme, obfuscate};
use crate::seed::{Key, Stage};
use crate::truth::Original;
use crate::{Descriptors, Error, PointSet, ProtectedDescriptors, Unit};
use unlift_attack::parallel;

/// A keypoint belongs to a point that its image observes if it is this near to the projection, in
/// pixels. Right matches have the same limit.
pub const NEAR: f64 = 3.0;
/// Smallest number of other images in which a point of the map must be found.
const FEWEST_OTHERS: usize = 2;
/// Standard deviation of the centers of starts, as a share of the distance to the points.
const REACH: f64 = 0.1;

/// The keypoints of an image of a map.
#[derive(Debug)]
pub struct Photo {
    /// The number of its view.
    pub view: usize,
    /// Keypoints in pixels of the pinhole, and their rows among `descriptors`.
    pub places: Vec<([f64; 2], usize)>,
    /// One row per keypoint.
    pub descriptors: Descriptors,
    /// Points that the image observes, with the row of the keypoint of each.
    pub of_points: Vec<(usize, usize)>,
}

struct Query {
    /// The camera with its true pose.
    camera: Camera,
    /// Width and height of the image in pixels.
    size: [f64; 2],
    /// Undistorted keypoints in pixels of the pinhole, within the image.
    places: Vec<[f64; 2]>,
    descriptors: Unit32,
}

/// The rows of a map, their descriptors, and the matches of every image with them.
type Known = (Vec<usize>, Compared, Arc<Vec<Vec<Pair>>>);

/// Descriptors of a map that keypoints are compared with.
#[derive(PartialEq)]
enum Compared {
    Plain(Unit32),
    Protected(ProtectedDescriptors),
}

/// A map that was made without some images, and these images.
pub struct Held<'a> {
    original: &'a Original<3>,
    /// All images of the map but the held-out ones.
    others: Vec<&'a View>,
    queries: Vec<Query>,
    /// One row per point. Points that are not part of the map have the descriptor of another.
    descriptors: Descriptors,
    /// The points of the map, ascending: those that enough other images show.
    parts: Vec<usize>,
    /// Matches by the descriptors that they depend on.
    known: Vec<Known>,
}

impl<'a> Held<'a> {
    /// Holds out every `nth` of `photos`, which are of images among `views`. Makes the descriptor of every point from its keypoints in
    /// the other photos.
    ///
    /// # Errors
    /// If there are too few photos, their descriptors differ in length, or they show no point.
    pub fn new(
        original: &'a Original<3>,
        views: &'a [View],
        photos: Vec<Photo>,
        nth: usize,
    ) -> Result<Self, Error> {
        let positions = original.reveal().positions();
        let is_held = |at: usize| at % nth == nth / 2;
        let n_held = (0..photos.len()).filter(|&at| is_held(at)).count();
        if n_held == 0 || photos.len() - n_held < FEWEST_OTHERS {
            let expected =
                format!("1 to hold out and {FEWEST_OTHERS} others (another --hold-out?)");
            let found = format!("{}, of which {n_held} to hold out", photos.len());
            return Err(Error::new("images with features", expected, found));
        }
        let dim = photos[0].descriptors.dim();
        if let Some(photo) = photos.iter().find(|photo| photo.descriptors.dim() != dim) {
            let expected = format!("{dim} values per descriptor in every image");
            return Err(Error::new("features", expected, photo.descriptors.dim()));
        }
        let mut held = vec![false; views.len()];
        let (mut queries, mut sums) = (Vec::new(), vec![0.0_f32; positions.len() * dim]);
        let mut found = vec![0; positions.len()];
        let is_bytes = matches!(photos[0].descriptors.values(), Values::U8(_));
        for (number, photo) in photos.into_iter().enumerate() {
            if is_held(number) {
                held[photo.view] = true;
                let View { camera, size, .. } = views[photo.view];
                let (places, rows): (Vec<_>, Vec<_>) = photo.places.into_iter().unzip();
                let descriptors = Unit32::of(&photo.descriptors, rows.into_iter());
                queries.push(Query { camera, size, places, descriptors });
                continue;
            }
            let unit = Unit32::of(&photo.descriptors, 0..photo.descriptors.len());
            for (point, keypoint) in photo.of_points {
                found[point] += 1;
                let sum = &mut sums[point * dim..][..dim];
                sum.iter_mut().zip(unit.row(keypoint)).for_each(|(sum, x)| *sum += x);
            }
        }
        let is_part = |row: usize| found[row] >= FEWEST_OTHERS;
        let parts: Vec<usize> = (0..positions.len()).filter(|&row| is_part(row)).collect();
        if parts.is_empty() {
            let expected = "keypoints at the projections of the map's points";
            return Err(Error::new("features", expected, "none"));
        }
        // Mitigations learn from all rows, so the other rows have the same distribution.
        let row = |row: usize| if is_part(row) { row } else { parts[row % parts.len()] };
        let scaled = (0..positions.len()).flat_map(|at| {
            let sum = &sums[row(at) * dim..][..dim];
            let length = sum.iter().map(|x| x * x).sum::<f32>().sqrt();
            let scale = if is_bytes { 512.0 } else { 1.0 } / length.max(1e-12);
            sum.iter().map(move |x| x * scale)
        });
        let values = match is_bytes {
            // A cast saturates.
            true => Values::U8(scaled.map(|x| x.round() as u8).collect()),
            false => Values::F32(scaled.collect()),
        };
        let others = views.iter().zip(&held).filter(|(_, is_held)| !**is_held);
        let others = others.map(|(view, _)| view).collect();
        let descriptors = Descriptors::try_new(values, dim)?;
        Ok(Self { original, others, queries, descriptors, parts, known: Vec::new() })
    }

    /// Returns a note about the map and the images.
    pub fn note(&self) -> String {
        let (n, n_points) = (self.parts.len(), self.original.len());
        let n_images = self.queries.len();
        let few = format!(
            " (fewer than {FEWEST_HELD_OUT} do not tell schemes apart, so only the bound counts)"
        );
        let few = if (n_images as u64) < FEWEST_HELD_OUT { &*few } else { "" };
        format!(
            "localization: images held out: {n_images}{few}; the map without them has {n} of {n_points} points, \
             those that at least {FEWEST_OTHERS} other images see"
        )
    }

    /// Returns the problems of all images with the map in the clear.
    pub fn unprotected(&mut self) -> Vec<Problem> {
        let pairs = self.pairs_in_the_clear();
        self.problems(&pairs, |_, _, place, point| Some(Match { place, point, line: None }))
    }

    /// Returns the problems of all images with the map that `scheme` protects under `key`.
    pub fn with_map(&mut self, scheme: &dyn Scheme<3>, key: &Key) -> Result<Vec<Problem>, Error> {
        let (released, secret) = obfuscate(scheme, self.original, Some(&self.descriptors), key)?;
        let secret = secret.by_descriptor_row();
        let is_part = |point: &usize| self.parts.binary_search(point).is_ok();
        let rows = secret.hidden().iter().enumerate().map(|(row, id)| (id.index(), row as u32));
        let mut rows: Vec<(usize, u32)> = rows.filter(|(point, _)| is_part(point)).collect();
        rows.sort_unstable();
        let (points, rows): (Vec<usize>, Vec<u32>) = rows.into_iter().unzip();
        let compared = match released.protected() {
            Some(all) => Compared::Protected(all.select(&rows)),
            None => {
                let all = released.descriptors().unwrap_or(&self.descriptors);
                Compared::Plain(Unit32::of(all, rows.into_iter().map(|row| row as usize)))
            }
        };
        let pairs = self.pairs(points, compared);
        let free = free_directions(&released, &secret);
        Ok(self.problems(&pairs, |_, (_, row), place, point| {
            Some(Match { place, point, line: Some(OnLine::OfMap(free[row]?)) })
        }))
    }

    /// Returns the problems of all images, whose keypoints `scheme` protects, with the map in the clear.
    pub fn with_queries(
        &mut self,
        scheme: &dyn Scheme<2>,
        key: &Key,
    ) -> Result<Vec<Problem>, Error> {
        let all_in_the_clear = self.pairs_in_the_clear();
        let (points, map) = (&self.parts, self.in_the_clear());
        let hide = |number: usize| {
            let query = &self.queries[number];
            let keypoints = PointSet::try_new(query.places.clone(), Unit::Pixel)?;
            let original = Original::within(keypoints, Bounds::try_new([0.0; 2], query.size)?)?;
            let key = key.of_item(Stage::Image, number as u64);
            let (released, secret) = obfuscate(scheme, &original, None, &key)?;
            let free = free_directions(&released, &secret);
            let pairs = match scheme.changes().into_iter().find_map(Change::protection) {
                None => all_in_the_clear[number].clone(),
                Some(protection) => {
                    let protected = protection.protect(&query.descriptors.plain()?, &key)?;
                    let pairs = with_protected(&map, &protected, true).into_iter();
                    pairs.map(|(keypoint, at)| (keypoint, points[at])).collect()
                }
            };
            Ok((free, pairs))
        };
        let hidden = parallel::map(self.queries.len(), hide).into_iter();
        let (free, pairs): (Vec<Vec<Option<[f64; 2]>>>, Vec<_>) =
            hidden.collect::<Result<Vec<_>, Error>>()?.into_iter().unzip();
        Ok(self.problems(&pairs, |image, (keypoint, _), place, point| {
            Some(Match { place, point, line: Some(OnLine::OfImage(free[image][keypoint]?)) })
        }))
    }

    fn pairs_in_the_clear(&mut self) -> Arc<Vec<Vec<Pair>>> {
        self.pairs(self.parts.clone(), Compared::Plain(self.in_the_clear()))
    }

    /// Returns the descriptors of the points of the map.
    fn in_the_clear(&self) -> Unit32 {
        Unit32::of(&self.descriptors, self.parts.iter().copied())
    }

    /// Returns the matches of every image with the points `rows`, whose descriptors are `compared`.
    fn pairs(&mut self, rows: Vec<usize>, compared: Compared) -> Arc<Vec<Vec<Pair>>> {
        let known = self.known.iter().find(|(of, same, _)| *of == rows && *same == compared);
        if let Some((.., pairs)) = known {
            return Arc::clone(pairs);
        }
        let of = |at: usize| -> Vec<Pair> {
            let query = &self.queries[at];
            let matched = match &compared {
                Compared::Plain(unit) => mutual(&query.descriptors, unit),
                Compared::Protected(map) => with_protected(&query.descriptors, map, false),
            };
            matched.into_iter().map(|(keypoint, at)| (keypoint, rows[at])).collect()
        };
        let pairs = Arc::new(parallel::map(self.queries.len(), of));
        self.known.push((rows, compared, Arc::clone(&pairs)));
        pairs
    }

    /// Returns the problem of every image; `fixed` returns what a match of an image fixes, by its keypoint and its point.
    fn problems(
        &self,
        pairs: &[Vec<Pair>],
        fixed: impl Fn(usize, Pair, [f64; 2], [f64; 3]) -> Option<Match>,
    ) -> Vec<Problem> {
        let positions = self.original.reveal().positions();
        let of = |(number, query): (usize, &Query)| {
            let pairs = &pairs[number];
            let is_right = |&&(keypoint, row): &&Pair| {
                let place = query.camera.project(&positions[row]);
                place.is_some_and(|p| distance(&p, &query.places[keypoint]) <= NEAR)
            };
            let fixed = |&(keypoint, row): &Pair| {
                fixed(number, (keypoint, row), query.places[keypoint], positions[row])
            };
            let start = self.most_similar(pairs).map(|similar| {
                let points = pairs.iter().map(|(_, row)| &positions[*row]);
                let pose = similar.camera.pose;
                let mut away: Vec<f64> = points.map(|p| distance(p, &pose.center)).collect();
                (Camera { pose, ..query.camera }, REACH * median(&mut away))
            });
            Problem {
                truth: query.camera,
                size: query.size,
                start,
                n_pairs: pairs.len(),
                n_right: pairs.iter().filter(is_right).count(),
                matches: pairs.iter().filter_map(fixed).collect(),
            }
        };
        self.queries.iter().enumerate().map(of).collect()
    }

    /// Returns the other image that observes most of the matched points, as retrieval would.
    fn most_similar(&self, pairs: &[Pair]) -> Option<&View> {
        if pairs.is_empty() {
            return None;
        }
        let mut is_matched = vec![false; self.original.len()];
        pairs.iter().for_each(|(_, row)| is_matched[*row] = true);
        let shared =
            |view: &View| view.observed.iter().filter(|&&row| is_matched[row as usize]).count();
        // Of equal ones, the first.
        self.others.iter().copied().rev().max_by_key(|view| shared(view))
    }
}

/// The pose problem of one held-out image.
pub struct Problem {
    /// The camera with its true pose.
    pub truth: Camera,
    /// Width and height of the image in pixels.
    pub size: [f64; 2],
    /// The matches, as far as they fix the pose.
    pub matches: Vec<Match>,
    /// The pose of the most similar other image, and the standard deviation of further starts.
    start: Option<(Camera, f64)>,
    n_pairs: usize,
    /// Matches within 3 px of the true projection.
    n_right: usize,
}

impl Problem {
    /// Estimates the pose and returns its error.
    pub fn solve(&self, seed: u64) -> Option<PoseError> {
        let (start, reach) = self.start.as_ref()?;
        let (camera, _) = estimate(start, &self.matches, *reach, seed)?;
        Some(camera.pose.error(&self.truth.pose))
    }
}

impl HeldOut {
    /// Summarizes the errors of all images beside the unprotected ones. `limits` are pairs of errors with their names.
    pub(super) fn of(
        problems: &[Problem],
        [errors, unprotected]: [&[Option<PoseError>]; 2],
        limits: &[(String, f64, f64)],
    ) -> Self {
        let [own, base] = [errors, unprotected].map(|errors| Localization::of("", errors, errors));
        let middle = |count: fn(&Problem) -> usize| {
            let counts = problems.iter().map(|problem| count(problem) as f64);
            upper_median(counts.collect()).unwrap_or(f64::INFINITY)
        };
        let recall = |(name, max_center, max_angle): &(String, f64, f64)| {
            let is_within = |error: &&PoseError| {
                error.center <= *max_center && error.rotation_degrees <= *max_angle
            };
            let n = errors.iter().flatten().filter(is_within).count();
            (name.clone(), 100.0 * n as f64 / errors.len().max(1) as f64)
        };
        let multiple = own.center_error.zip(base.center_error).map(|(own, base)| own / base);
        Self {
            n_images: problems.len() as u64,
            right_matches: middle(|problem| problem.n_right),
            matches: middle(|problem| problem.n_pairs),
            center_error: own.center_error,
            rotation_error_degrees: own.rotation_error_degrees,
            multiple: multiple.filter(|multiple| multiple.is_finite() && *multiple > 0.0),
            recall_percent: limits.iter().map(recall).collect(),
        }
    }
}
