//! Re-identification: which photo of an audit does a picture show?

use image::imageops::thumbnail;
use unlift::Error;

use crate::features::ColorImage;
use crate::pictures::Lpips;

/// Side of the photos of a gallery in pixels: enough to tell photos apart, small enough to compare a picture with all of them.
const SIDE: u32 = 64;

/// Small photos by name, among which a picture is assigned to the most similar one.
#[derive(Clone, Debug)]
pub struct Gallery {
    photos: Vec<(String, ColorImage)>,
}

impl Gallery {
    /// The largest number of photos for which a comparison of each picture with all of them takes little time.
    pub const MAX: usize = 100;

    /// Creates a gallery of photos by name, which [`reduced`](Self::reduced) made small.
    pub fn new(photos: Vec<(String, ColorImage)>) -> Self {
        Self { photos }
    }

    /// Returns a picture of 64 x 64 pixels.
    pub fn reduced(picture: &ColorImage) -> ColorImage {
        thumbnail(picture, SIDE, SIDE)
    }

    /// Returns the probability that a picture is assigned to its photo by chance, for a photo of the gallery; `None` if there are no others.
    pub fn chance(&self) -> Option<f64> {
        (self.photos.len() > 1).then(|| 1.0 / self.photos.len() as f64)
    }

    /// Returns whether the photo `name` is nearer by LPIPS than every other; `None` if the gallery lacks it, or others.
    ///
    /// # Errors
    /// If the network fails.
    pub fn assigns(
        &self,
        picture: &ColorImage,
        name: &str,
        lpips: &Lpips,
    ) -> Result<Option<bool>, Error> {
        let Some((_, own)) = self.photos.iter().find(|(of, _)| of == name) else { return Ok(None) };
        if self.chance().is_none() {
            return Ok(None);
        }
        let picture = Self::reduced(picture);
        let distance = lpips.distance(&picture, own)?;
        for (_, other) in self.photos.iter().filter(|(of, _)| of != name) {
            if lpips.distance(&picture, other)? <= distance {
                return Ok(Some(false));
            }
        }
        Ok(Some(true))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_assigned_to_the_photo_that_it_resembles() {
        let stripes = |of: fn(u32, u32) -> u32| {
            ColorImage::from_fn(96, 80, |x, y| image::Rgb([(of(x, y) / 8 % 2 * 200) as u8; 3]))
        };
        let (upright, flat) = (stripes(|x, _| x), stripes(|_, y| y));
        let lpips = Lpips::try_new().unwrap();
        let gallery = |photos: &[(&str, &ColorImage)]| {
            Gallery::new(
                photos.iter().map(|(n, of)| (n.to_string(), Gallery::reduced(of))).collect(),
            )
        };
        let assigned =
            |gallery: &Gallery, picture, name| gallery.assigns(picture, name, &lpips).unwrap();
        let one = gallery(&[("upright", &upright)]);
        assert_eq!((one.chance(), assigned(&one, &upright, "upright")), (None, None));
        let two = gallery(&[("upright", &upright), ("flat", &flat)]);
        assert_eq!(two.chance(), Some(0.5));
        assert_eq!(assigned(&two, &upright, "upright"), Some(true));
        assert_eq!(assigned(&two, &upright, "flat"), Some(false));
        assert_eq!(assigned(&two, &upright, "absent"), None);
        // Of photos that look alike, none is identified.
        let alike = gallery(&[("flat", &flat), ("again", &flat)]);
        assert_eq!(assigned(&alike, &flat, "flat"), Some(false));
    }
}
