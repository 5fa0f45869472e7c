//! Pictures that a network makes from recovered points, and their similarity to the photos.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::Path;

use unlift::recover::Recovered;
use unlift::released::Released;
use unlift::{Descriptors, Error, RowOrder};

use super::{
    CLASSES, Detection, Detector, Gallery, Inverter, Lpips, Metrics, Points, Projection, View,
};
use crate::features::{ColorImage, halved};
use crate::network::DescriptorKind;

/// Points with a lower probability of being near their recovered place are omitted: they would paint wrong content over correct content.
const LEAST: f64 = 0.2;
const BASELINE: &str = "_baseline";
/// Limit of PSNR, which is infinite for equal pictures.
const MOST_DB: f64 = 100.0;

/// Share of the pictures that are nearer to their own photo than to every other one.
const REIDENTIFIED: &str = "reidentified";
const OBJECTS: &str = "objects_found";
/// Minimum confidence of the detector for an object.
const SURE: f32 = 0.3;
/// Minimum overlap (intersection over union) of two boxes of the same object.
const SAME: f32 = 0.5;

/// Distance in pixels within which a keypoint's descriptor paints the correct content.
const NEAR_PX: f64 = 10.0;
/// Distance within which a map point's descriptor paints the correct content, as a share of its depth: about 15 of 640 pixels.
const NEAR: f64 = 0.03;

/// Makes pictures from points and compares them with photos. Every picture has half the size of the photo, rounded down.
#[derive(Debug)]
pub struct Painter {
    /// The network that paints.
    pub inverter: Inverter,
    lpips: Lpips,
    detector: Detector,
}

/// A photo that pictures are compared with, at their size.
#[derive(Debug)]
pub struct Reference {
    /// Its name among the photos.
    pub name: String,
    /// The photo.
    pub image: ColorImage,
    objects: Vec<Detection>,
}

/// A picture, compared with its photo.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The picture.
    pub image: ColorImage,
    /// Its similarity to the photo.
    pub metrics: Metrics,
    /// The class of every object of the photo, and whether it is found in the picture.
    objects: Vec<(usize, bool)>,
    /// Whether the picture is nearer to its photo than to every other one, if it was compared.
    reidentified: Option<bool>,
}

impl Painter {
    /// Opens the painter for descriptors of `kind`, with the network of the user or the known one, and the networks that compare.
    ///
    /// # Errors
    /// If a network is missing or cannot be read.
    pub fn open(kind: DescriptorKind, network: Option<&Path>) -> Result<Self, Error> {
        let inverter = Inverter::open(kind, network);
        let (lpips, detector) = (Lpips::try_new()?, Detector::try_new()?);
        Ok(Self { inverter: inverter?, lpips, detector })
    }

    /// Makes the picture of keypoints `(n, 2)` in an image of `size` (width, height) pixels.
    ///
    /// # Errors
    /// If the network does not support the descriptors.
    pub fn keypoints(
        &self,
        places: &[[f32; 2]],
        descriptors: &Descriptors,
        size: [usize; 2],
    ) -> Result<ColorImage, Error> {
        let weights = &vec![1.0; places.len()];
        self.inverter.invert(&Points { places, descriptors, weights, depths: None }, size)
    }

    /// Makes the picture of a recovered image: every recovered keypoint with its assigned
    /// descriptor, weighted by its probability of being correct.
    ///
    /// # Errors
    /// If the size of the image or descriptors were not released, or the network does not support the descriptors.
    pub fn image(
        &self,
        released: &Released<2>,
        recovered: &Recovered<2>,
    ) -> Result<ColorImage, Error> {
        let (places, weights) = trusted(recovered, |x| x.map(|x| x as f32));
        let descriptors = &*assigned(released, recovered)?;
        let points = Points { places: &places, descriptors, weights: &weights, depths: None };
        self.inverter.invert(&points, size(released)?)
    }

    /// Makes the picture of a recovered map as `view` sees it.
    ///
    /// # Errors
    /// If descriptors were not released, or the network does not support them.
    pub fn map(
        &self,
        view: &View,
        released: &Released<3>,
        recovered: &Recovered<3>,
    ) -> Result<ColorImage, Error> {
        let descriptors = &*assigned(released, recovered)?;
        self.points(view, &positions(recovered), descriptors, |slot, depth| {
            weight(recovered, slot, NEAR * f64::from(depth))
        })
    }

    /// Returns true if any recovered point is inside the image.
    ///
    /// # Errors
    /// If the image is too large.
    pub fn sees(&self, view: &View, recovered: &Recovered<3>) -> Result<bool, Error> {
        Ok(!view.project(&positions(recovered))?.points.is_empty())
    }

    /// Makes the picture of `positions` as `view` sees them, each with the `weight` of its index and depth.
    ///
    /// # Errors
    /// If the image is too large, or the network does not support the descriptors.
    pub fn points(
        &self,
        view: &View,
        positions: &[Option<[f64; 3]>],
        descriptors: &Descriptors,
        weight: impl Fn(usize, f32) -> f32,
    ) -> Result<ColorImage, Error> {
        let (projection, weights) = in_sight(view, positions, weight)?;
        let Projection { points, places, depths } = &projection;
        let descriptors = &descriptors.select(points);
        let points = Points { places, descriptors, weights: &weights, depths: Some(depths) };
        self.inverter.invert(&points, view.size)
    }

    /// Prepares the photo `name` for comparison.
    ///
    /// # Errors
    /// If it is too small.
    pub fn reference(&self, name: &str, photo: &ColorImage) -> Result<Reference, Error> {
        let image = halved(photo)?;
        Ok(Reference { name: name.to_owned(), objects: self.detector.find(&image, SURE)?, image })
    }

    /// Compares a picture with its photo, and finds out whether it is assigned to it among those of a gallery.
    ///
    /// # Errors
    /// If their sizes differ.
    pub fn compare(
        &self,
        image: ColorImage,
        photo: &Reference,
        gallery: Option<&Gallery>,
    ) -> Result<Picture, Error> {
        let metrics = Metrics::of(&image, &photo.image, &self.lpips)?;
        let found = self.detector.find(&image, SURE)?;
        let again = |object: &Detection| {
            let mut same = found.iter().filter(|of| of.class == object.class);
            (object.class, same.any(|of| of.overlap(object) >= SAME))
        };
        let objects = photo.objects.iter().map(again).collect();
        let assigns = |gallery: &Gallery| gallery.assigns(&image, &photo.name, &self.lpips);
        let reidentified = gallery.map(assigns).transpose()?.flatten();
        Ok(Picture { image, metrics, objects, reidentified })
    }
}

impl Picture {
    /// Returns the figures of the picture: its similarity, whether it is assigned to its photo, the share of the photo's objects
    /// that are found in it, if there are any, and then by class. Names end with `end`.
    fn named(&self, end: &str) -> Vec<(String, f64)> {
        let Metrics { ssim, psnr, lpips } = self.metrics;
        let figures = [("ssim", ssim), ("psnr", psnr.min(MOST_DB)), ("lpips", lpips)];
        let share = |of: &dyn Fn(usize) -> bool| {
            let of = self.objects.iter().filter(|(class, _)| of(*class));
            let (n, found) = (of.clone().count(), of.filter(|(_, found)| *found).count());
            found as f64 / n as f64
        };
        let classes: BTreeSet<usize> = self.objects.iter().map(|(class, _)| *class).collect();
        let all = (!classes.is_empty()).then(|| (OBJECTS.to_owned(), share(&|_| true)));
        let name = |class: usize| format!("{OBJECTS}_of_{}", CLASSES[class].replace(' ', "_"));
        let each = classes.iter().map(|&class| (name(class), share(&|known| known == class)));
        let figures = figures.map(|(name, value)| (name.to_owned(), value)).into_iter();
        let assigned =
            self.reidentified.map(|yes| (REIDENTIFIED.to_owned(), f64::from(u8::from(yes))));
        let named = figures.chain(assigned).chain(all).chain(each);
        named.map(|(name, value)| (name + end, value)).collect()
    }

    /// Returns the figures of the picture, of the picture of the true points, and chance.
    pub fn figures(&self, baseline: &Self, gallery: &Gallery) -> Vec<(String, f64)> {
        let chance = gallery.chance().filter(|_| self.reidentified.is_some());
        let chance = chance.map(|chance| (format!("{REIDENTIFIED}_by_chance"), chance));
        [self.named(""), baseline.named(BASELINE), chance.into_iter().collect()].concat()
    }
}

fn positions(recovered: &Recovered<3>) -> Vec<Option<[f64; 3]>> {
    (0..recovered.n_slots()).map(|slot| recovered.position(slot)).collect()
}

/// Returns the descriptors, which pictures need.
///
/// # Errors
/// If there are none.
pub fn needed(descriptors: Option<&Descriptors>) -> Result<&Descriptors, Error> {
    descriptors.ok_or_else(|| Error::new("pictures", "descriptors", "none"))
}

/// Returns the descriptors of recovered points, in their order. Lists made from descriptors have their order, so no assignment is needed.
fn assigned<'a, const D: usize>(
    released: &'a Released<D>,
    recovered: &Recovered<D>,
) -> Result<Cow<'a, Descriptors>, Error> {
    let descriptors = needed(released.descriptors())?;
    let own = recovered.about().order == RowOrder::DescriptorRows;
    Ok(match recovered.descriptor_row().filter(|_| !own) {
        Some(rows) => Cow::Owned(descriptors.select(rows)),
        None => Cow::Borrowed(descriptors),
    })
}

/// Returns the trusted points inside a view's image and their weights: 0 for hidden points. A point with weight 0 does not hide others.
fn in_sight(
    view: &View,
    positions: &[Option<[f64; 3]>],
    weight: impl Fn(usize, f32) -> f32,
) -> Result<(Projection, Vec<f32>), Error> {
    let weight = |(slot, depth): (&u32, &f32)| weight(*slot as usize, *depth);
    let all = view.project(positions)?;
    let mut weights: Vec<f32> = all.points.iter().zip(&all.depths).map(weight).collect();
    let kept = all.only(|at| weights[at] > 0.0);
    weights.retain(|weight| *weight > 0.0);
    for (weight, is_visible) in weights.iter_mut().zip(kept.visible(view.size)) {
        if !is_visible {
            *weight = 0.0;
        }
    }
    Ok((kept, weights))
}

/// Returns width and height of a released image in pixels.
///
/// # Errors
/// If they were not released.
pub fn size(released: &Released<2>) -> Result<[usize; 2], Error> {
    let bounds = released.bounds();
    let bounds = bounds.ok_or_else(|| Error::new("image size", "known", "none"))?;
    Ok([0, 1].map(|c| (bounds.high[c] - bounds.low[c]).round() as usize))
}

/// Returns where every recovered keypoint is `shown`, and its weight.
pub fn trusted(
    recovered: &Recovered<2>,
    shown: impl Fn([f64; 2]) -> [f32; 2],
) -> (Vec<[f32; 2]>, Vec<f32>) {
    let place = |slot| recovered.position(slot).map_or([f32::NAN; 2], &shown);
    let point = |slot| (place(slot), weight(recovered, slot, NEAR_PX));
    (0..recovered.n_slots()).map(point).unzip()
}

/// Returns the probability that a recovered point is within `near` of its place; 0 below [`LEAST`],
/// and 1 if the attack estimates no probability.
fn weight<const D: usize>(recovered: &Recovered<D>, slot: usize, near: f64) -> f32 {
    match recovered.probability_within(slot, near) {
        Some(sure) if sure < LEAST => 0.0,
        Some(sure) => sure as f32,
        None if recovered.position(slot).is_some() => 1.0,
        None => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use unlift::descriptors::Values;
    use unlift::geometry::camera::Pose;
    use unlift::recover::{Estimate, Status};
    use unlift::released::{Lines, Obfuscation};
    use unlift::{About, Unit};

    use super::*;
    use crate::pictures::Lens;

    fn view() -> View {
        View {
            pose: Pose::IDENTITY,
            lens: Lens::try_new("SIMPLE_PINHOLE", &[100.0, 32.0, 32.0]).unwrap(),
            size: [64, 64],
        }
    }

    #[test]
    fn points_that_nobody_trusts_hide_nothing() {
        // Three points in front of a fourth.
        let positions = [1.0, 1.1, 1.2, 2.0].map(|depth| Some([0.0, 0.0, depth]));
        let weights = |distrusted: f32| {
            let of = |slot: usize, _: f32| if slot < 3 { distrusted } else { 0.9 };
            in_sight(&view(), &positions, of).unwrap()
        };
        assert_eq!(weights(0.5).1, [0.5, 0.5, 0.5, 0.0]);
        let (kept, weights) = weights(0.0);
        assert_eq!((kept.points, weights), (vec![3], vec![0.9]));
    }

    #[test]
    fn lists_counted_by_descriptors_leave_nothing_to_guess() {
        let lines = Lines::through(&[[0.0; 2]], &[[1.0, 0.0]]).unwrap();
        let bytes = (0..256).map(|at| (at / 128) as u8 + 1).collect();
        let descriptors = Descriptors::try_new(Values::U8(bytes), 128).unwrap();
        let released = Released::<2>::try_new(
            Obfuscation::Lines(lines),
            2,
            [0.0; 2],
            Unit::Pixel,
            Some(descriptors.clone()),
        )
        .unwrap();
        let lost = Estimate::lost(Status::NoSupport);
        let recovered = |order: RowOrder| {
            Recovered::try_new(&[lost, lost], false, Some(vec![1, 0]), [0.0; 2], Unit::Pixel, 1.0)
                .unwrap()
                .with_about(About { order, ..About::default() })
        };
        let of = |order| assigned(&released, &recovered(order)).unwrap().into_owned();
        assert_eq!(of(RowOrder::Slots), descriptors.select(&[1, 0]));
        assert_eq!(of(RowOrder::DescriptorRows), descriptors);
    }
}
