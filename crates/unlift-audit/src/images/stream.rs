//! Images for an audit, one after the other. The next ones are read in parallel; broken ones in files are reported and skipped.

use std::cell::RefCell;
use std::path::Path;

use rayon::prelude::*;
use unlift::audit::{Item, Plan};
use unlift::geometry::frame::Bounds;
use unlift::neighbors::Needs;
use unlift::truth::Original;
use unlift::{PointSet, Unit};
use unlift_io::Error;
use unlift_io::hash::hash_features;

use super::FeatureSource;
use crate::Progress;

const PER_THREAD: usize = 2;

/// Counts of the images that were read so far.
#[derive(Debug, Default)]
pub struct Tally {
    /// Numbers of the images that can be used.
    pub used: Vec<usize>,
    /// Their keypoint counts.
    pub sizes: Vec<usize>,
    /// Their hashes, for images in memory.
    pub hashes: Vec<String>,
    /// Images that could not be used.
    pub unusable: usize,
    /// Keypoints that were moved to the edge of their image.
    n_moved: usize,
    /// Whether any image has descriptors.
    pub described: bool,
    /// The part of the declared sizes that keypoints of any image fill, as a box in `[0, 1]`.
    filled: Option<Bounds<2>>,
}

/// Minimum number of keypoints to estimate where an image ends.
const TELLING: usize = 30;
/// Keypoints fill more than this share of the correct size.
const FILLED: f64 = 0.5;

impl Tally {
    fn add(&mut self, at: usize, ready: Ready) -> Item<2> {
        let Ready { image, sha256, n_moved, described } = ready;
        self.fill(&image.original);
        self.used.push(at);
        self.sizes.push(image.original.len());
        self.hashes.extend(sha256);
        self.n_moved += n_moved;
        self.described |= described;
        image
    }

    fn fill(&mut self, original: &Original<2>) {
        let places = original.reveal().positions();
        let filled = Bounds::quantiles(places, 0.01).filter(|_| places.len() >= TELLING);
        let (Some(declared), Some(filled)) = (original.bounds(), filled) else { return };
        let of = |c: usize, x: f64| (x - declared.low[c]) / (declared.high[c] - declared.low[c]);
        let [low, high] = [filled.low, filled.high].map(|x| [of(0, x[0]), of(1, x[1])]);
        let all = self.filled.get_or_insert(Bounds { low, high });
        for c in 0..2 {
            all.low[c] = all.low[c].min(low[c]);
            all.high[c] = all.high[c].max(high[c]);
        }
    }

    /// Returns a doubt if the images are declared larger than the area of their keypoints. Schemes and attacks use the declared size.
    pub fn doubt(&self) -> Option<String> {
        let Bounds { low, high } = self.filled.as_ref()?;
        let share = (high[0] - low[0]) * (high[1] - low[1]);
        let doubt = format!(
            "sizes: keypoints fill {:.0} % of the declared size of the images: if it is wrong, recovery may be too low",
            100.0 * share
        );
        (share < FILLED).then_some(doubt)
    }

    /// Returns a note about keypoints that were moved.
    pub fn moved(&self) -> Option<String> {
        let what =
            "keypoints were at most a pixel outside of their images, and are moved to the edge";
        (self.n_moved > 0).then(|| format!("{} {what}", self.n_moved))
    }
}

/// An image that was read.
struct Ready {
    image: Item<2>,
    /// The hash of an image in memory.
    sha256: Option<String>,
    /// Number of keypoints that were moved to the edge.
    n_moved: usize,
    described: bool,
}

/// Returns the images `chosen` of a source, in order. Memory depends on the number of threads, not of images.
///
/// `path` names the source in errors, which are reported to `steps` and counted in `tally`. Images must have the descriptors that sources
/// of the `plan` need, and lose those that nothing needs; without a plan, they keep theirs.
pub fn stream<'a>(
    (source, path): (&'a FeatureSource, &'a Path),
    chosen: &'a [usize],
    plan: Option<&'a Plan<2>>,
    tally: &'a RefCell<Tally>,
    steps: &'a dyn Progress,
) -> impl Iterator<Item = Result<Item<2>, crate::Error>> + 'a {
    let blocks = chosen.chunks(PER_THREAD * rayon::current_num_threads());
    blocks.flat_map(move |block| {
        let read = |&at: &usize| (at, read(source, path, at, plan));
        let images: Vec<_> = block.par_iter().with_max_len(1).map(read).collect();
        images.into_iter().filter_map(move |(at, image)| match image {
            Ok(ready) => Some(Ok(tally.borrow_mut().add(at, ready))),
            // The caller can correct images in memory, so the error ends the audit.
            Err(error) if source.is_in_memory() => Some(Err(error)),
            Err(error) => {
                tally.borrow_mut().unusable += 1;
                steps.say(&error.to_string());
                steps.add(1.0, "");
                None
            }
        })
    })
}

fn read(
    source: &FeatureSource,
    path: &Path,
    at: usize,
    plan: Option<&Plan<2>>,
) -> Result<Ready, crate::Error> {
    let features = source.get(at)?;
    let sha256 = source.is_in_memory().then(|| hash_features(&features));
    let place = format!("image {}", features.name.escape_debug());
    let wrong = |expected: &str, found: &str| Error::new(path, place.clone(), expected, found);
    let sources = plan.into_iter().flat_map(Plan::own_sources);
    let needy: Vec<_> = sources.filter(|by| by.needs() != Needs::Nothing).collect();
    // Measures may use descriptors, too. These are most of the memory of an image.
    let keeps = !needy.is_empty() || plan.is_none_or(|plan| !plan.measures.is_empty());
    // An image without keypoints needs nothing.
    for source in needy.into_iter().filter(|_| !features.keypoints.is_empty()) {
        let descriptors = features.descriptors.as_ref();
        let descriptors = descriptors.ok_or_else(|| wrong("descriptors", "none"))?;
        source.takes(descriptors).map_err(|error| wrong(error.expected(), error.found()))?;
    }
    let [width, height] = features.size.ok_or_else(|| wrong("a size in pixels", "none"))?;
    // The middle of the first pixel is (0, 0).
    let high = [f64::from(width) - 0.5, f64::from(height) - 0.5];
    let of_image = |error: unlift::Error| Error::core(path, error.within(&place));
    let bounds = Bounds::try_new([-0.5; 2], high).map_err(of_image)?;
    // hloc stores half floats, whose rounding error is up to a pixel.
    let mut n_moved = 0;
    let to_edge = |keypoint: [f64; 2]| {
        let near = [0, 1].map(|c| keypoint[c].clamp(bounds.low[c], bounds.high[c]));
        let is_near = (0..2).all(|c| (near[c] - keypoint[c]).abs() <= 1.0) && near != keypoint;
        n_moved += usize::from(is_near);
        if is_near { near } else { keypoint }
    };
    let keypoints = features.keypoints.iter().copied().map(to_edge).collect();
    let points = PointSet::try_new(keypoints, Unit::Pixel).map_err(of_image)?;
    let original = Original::within(points, bounds).map_err(of_image)?;
    let described = features.descriptors.is_some();
    let descriptors = features.descriptors.filter(|_| keeps);
    let image = Item { name: features.name, original, descriptors };
    Ok(Ready { image, sha256, n_moved, described })
}
