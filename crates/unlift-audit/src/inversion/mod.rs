//! Pictures that a network makes of what came back, and how alike they are to the photos.

mod images;
mod maps;

use std::borrow::Cow;

use unlift::recover::Recovered;
use unlift::released::Released;
use unlift::{Descriptors, Error, RowOrder};
use unlift_features::ColorImage;
use unlift_features::preview::jpeg_of;
use unlift_invert::{Inverter, Lpips, Metrics, Points, Projection, View};
use unlift_report::Given;
use unlift_report::inversions::{InvertedView, Likeness};

pub use images::Inversion;
pub use maps::{MapInversion, view};

/// Points that are less likely to be about where they were recovered are left out: they paint wrong things over right
/// ones.
const LEAST: f64 = 0.2;
/// Longest side of a picture on the page in pixels.
const SHOWN: usize = 320;
/// Behind the names of figures of true points.
const BASELINE: &str = "_baseline";
/// Equal pictures have no finite ratio of signal to noise.
const MOST_DB: f64 = 100.0;

/// Within how many pixels a keypoint must lie for its descriptor to paint the right thing.
const NEAR_PX: f64 = 10.0;
/// The same for a point of a map, of its distance from the camera: about 15 of 640 pixels.
const NEAR: f64 = 0.03;

/// Paints points, and compares what it painted. Every picture has half the size of the photo, rounded down.
pub struct Painter {
    inverter: Inverter,
    lpips: Lpips,
}

impl Painter {
    /// With the networks that the program carries.
    ///
    /// # Errors
    /// When a file that is to be taken in place of one of them cannot be.
    pub fn try_new() -> Result<Self, Error> {
        Ok(Self { inverter: Inverter::sift()?, lpips: Lpips::try_new()? })
    }

    /// The picture of keypoints `(n, 2)` in an image of `size` (width, height) pixels.
    ///
    /// # Errors
    /// When there is not one SIFT descriptor per keypoint.
    pub fn keypoints(
        &self,
        places: &[[f32; 2]],
        descriptors: &Descriptors,
        size: [usize; 2],
    ) -> Result<ColorImage, Error> {
        let weights = &vec![1.0; places.len()];
        self.inverter.invert(&Points { places, descriptors, weights, depths: None }, size)
    }

    /// The picture of what came back of an image: every recovered keypoint with the descriptor that it was given, as
    /// much as the attacker trusts it.
    ///
    /// # Errors
    /// When the size of the image or descriptors were not released, or these are not SIFT's.
    pub fn image(
        &self,
        released: &Released<2>,
        recovered: &Recovered<2>,
    ) -> Result<ColorImage, Error> {
        let place = |slot| recovered.position(slot).map_or([f32::NAN; 2], |x| x.map(|x| x as f32));
        let places: Vec<[f32; 2]> = (0..recovered.n_slots()).map(place).collect();
        let weights: Vec<f32> =
            (0..recovered.n_slots()).map(|slot| weight(recovered, slot, NEAR_PX)).collect();
        let descriptors = &*assigned(released, recovered)?;
        let points = Points { places: &places, descriptors, weights: &weights, depths: None };
        self.inverter.invert(&points, size(released)?)
    }

    /// The picture of what came back of a map, as `view` sees it.
    ///
    /// # Errors
    /// When descriptors were not released, or are not SIFT's.
    pub fn map(
        &self,
        view: &View,
        released: &Released<3>,
        recovered: &Recovered<3>,
    ) -> Result<ColorImage, Error> {
        let positions: Vec<_> =
            (0..recovered.n_slots()).map(|slot| recovered.position(slot)).collect();
        self.seen(view, &positions, &*assigned(released, recovered)?, |slot, depth| {
            weight(recovered, slot, NEAR * f64::from(depth))
        })
    }

    /// Whether any recovered point lies before the camera.
    ///
    /// # Errors
    /// As [`map`](Self::map).
    pub fn sees(&self, view: &View, recovered: &Recovered<3>) -> Result<bool, Error> {
        let positions: Vec<_> =
            (0..recovered.n_slots()).map(|slot| recovered.position(slot)).collect();
        Ok(!view.project(&positions)?.points.is_empty())
    }

    /// The picture of points as `view` sees them, without those behind others.
    fn seen(
        &self,
        view: &View,
        positions: &[Option<[f64; 3]>],
        descriptors: &Descriptors,
        weight: impl Fn(usize, f32) -> f32,
    ) -> Result<ColorImage, Error> {
        let all = view.project(positions)?;
        // Whoever distrusts a point does not let it hide others.
        let trusted = |at: usize| weight(all.points[at] as usize, all.depths[at]) > 0.0;
        let projection = all.only(trusted);
        let visible = projection.visible(view.size);
        let Projection { points, places, depths } = &projection;
        let weights: Vec<f32> = (points.iter().zip(depths).zip(visible))
            .map(|((&slot, &depth), seen)| if seen { weight(slot as usize, depth) } else { 0.0 })
            .collect();
        let descriptors = &descriptors.select(points);
        let points = Points { places, descriptors, weights: &weights, depths: Some(depths) };
        self.inverter.invert(&points, view.size)
    }

    fn compare(&self, picture: &ColorImage, photo: &ColorImage) -> Result<Metrics, Error> {
        Metrics::of(picture, photo, &self.lpips)
    }
}

/// A photo at the size of its pictures, and how well the true points paint it.
#[derive(Debug)]
struct Truth {
    /// The photo, at half its size.
    photo: ColorImage,
    /// The picture of the true points.
    picture: ColorImage,
    /// How alike the two are: no attack on positions can be expected to do better.
    baseline: Metrics,
}

/// Named figures of a picture, and of that of the true points.
fn figures(found: Metrics, baseline: Metrics) -> Vec<(String, f64)> {
    let named = |(metrics, of): (Metrics, &str)| {
        let Metrics { ssim, psnr, lpips } = metrics;
        [("ssim", ssim), ("psnr", psnr.min(MOST_DB)), ("lpips", lpips)]
            .map(|(name, value)| (format!("{name}{of}"), value))
    };
    [(found, ""), (baseline, BASELINE)].into_iter().flat_map(named).collect()
}

/// A picture of what came back, for the page.
fn shown(
    row: &unlift::audit::Row,
    picture: &ColorImage,
    metrics: &Metrics,
) -> Result<InvertedView, Error> {
    Ok(InvertedView {
        scheme: row.scheme.clone(),
        given: Given {
            neighbors: row.neighbors.clone(),
            oracle_noise: row.oracle_noise.map(str::to_owned),
            inlier_ratio: row.inlier_ratio,
        },
        solver: row.solver.to_owned(),
        likeness: likeness(metrics),
        picture: jpeg_of(picture, SHOWN)?,
    })
}

fn likeness(metrics: &Metrics) -> Likeness {
    Likeness { ssim: metrics.ssim, lpips: metrics.lpips }
}

/// The descriptors of the true points.
fn originals(descriptors: Option<&Descriptors>) -> Result<&Descriptors, Error> {
    descriptors.ok_or_else(|| Error::new("pictures", "descriptors", "none"))
}

fn descriptors<const D: usize>(released: &Released<D>) -> Result<&Descriptors, Error> {
    released.descriptors().ok_or_else(|| Error::new("pictures", "descriptors", "none"))
}

/// The descriptors of recovered points, in their order. Lists that an attacker makes from descriptors are counted as
/// these are: there is nothing to guess.
fn assigned<'a, const D: usize>(
    released: &'a Released<D>,
    recovered: &Recovered<D>,
) -> Result<Cow<'a, Descriptors>, Error> {
    let descriptors = descriptors(released)?;
    let own = recovered.about().order == RowOrder::DescriptorRows;
    Ok(match recovered.descriptor_row().filter(|_| !own) {
        Some(rows) => Cow::Owned(descriptors.select(rows)),
        None => Cow::Borrowed(descriptors),
    })
}

/// Width and height of a released image in pixels.
fn size(released: &Released<2>) -> Result<[usize; 2], Error> {
    let bounds = released.bounds();
    let bounds = bounds.ok_or_else(|| Error::new("image size", "known", "none"))?;
    Ok([0, 1].map(|c| (bounds.high[c] - bounds.low[c]).round() as usize))
}

/// How much a recovered point is trusted to be about where it is said to be; fully by attackers who do not know how
/// sure they are.
fn weight<const D: usize>(recovered: &Recovered<D>, slot: usize, near: f64) -> f32 {
    match recovered.probability_within(slot, near) {
        Some(sure) if sure < LEAST => 0.0,
        Some(sure) => sure as f32,
        None if recovered.position(slot).is_some() => 1.0,
        None => 0.0,
    }
}
