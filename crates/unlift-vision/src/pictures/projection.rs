//! Projection of a map into a camera, with an occlusion test.

use unlift::Error;

use crate::pictures::feature_image::check_size;
use crate::pictures::lens::Lens;

/// A camera with its pose.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Camera center, in units of the map.
    pub center: [f64; 3],
    /// Rotation from the map to the camera: `rotation (x - center)` is a point `x` in the frame
    /// right, down, forward.
    pub rotation: [[f64; 3]; 3],
    /// The lens.
    pub lens: Lens,
    /// Width and height of the image in pixels.
    pub size: [usize; 2],
}

/// The points of a map that project into an image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Projection {
    /// Indices of the points, ascending.
    pub points: Vec<u32>,
    /// Positions `(n, 2)` in pixels, the middle of the first pixel at (0, 0).
    pub places: Vec<[f32; 2]>,
    /// Distances from the camera, `(n,)`, in units of the map.
    pub depths: Vec<f32>,
}

/// Side of a window of the occlusion test in pixels.
const WINDOW: usize = 16;
/// A point is hidden if it is farther than others by this factor.
const BEHIND: f32 = 1.15;
/// Number of nearer points that hide a point; fewer may be outliers.
const ENOUGH: usize = 3;

impl View {
    /// Projects points into the image, hidden or not. Skips positions that are `None` or not
    /// finite.
    ///
    /// # Errors
    /// If there are more points than 32 bits can count, or the image is too large for a feature
    /// image.
    pub fn project(&self, points: &[Option<[f64; 3]>]) -> Result<Projection, Error> {
        check_size(self.size)?;
        u32::try_from(points.len()).map_err(|_| {
            Error::new("points", "at most 4294967295 of them", points.len().to_string())
        })?;
        let mut found = Projection::default();
        for (at, point) in points.iter().enumerate() {
            let Some(point) = point else { continue };
            let away = [0, 1, 2].map(|c| point[c] - self.center[c]);
            let x = self.rotation.map(|row| (0..3).map(|c| row[c] * away[c]).sum::<f64>());
            let Some(place) = self.lens.project(x) else { continue };
            let inside = (0..2).all(|c| place[c] >= -0.5 && place[c] < self.size[c] as f64 - 0.5);
            if inside {
                found.points.push(at as u32);
                found.places.push(place.map(|x| x as f32));
                found.depths.push(libm::sqrt(x.iter().map(|x| x * x).sum::<f64>()) as f32);
            }
        }
        Ok(found)
    }
}

impl Projection {
    /// Keeps the points for whose row `keep` is true.
    #[must_use]
    pub fn only(&self, keep: impl Fn(usize) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.points.len()).filter(|&at| keep(at)).collect();
        Self {
            points: kept.iter().map(|&at| self.points[at]).collect(),
            places: kept.iter().map(|&at| self.places[at]).collect(),
            depths: kept.iter().map(|&at| self.depths[at]).collect(),
        }
    }

    /// Returns which points are visible. A point is hidden if at least three points in the window
    /// around it, 16 pixels wide, are clearly nearer. Where points are sparse, some hidden ones
    /// pass.
    pub fn visible(&self, size: [usize; 2]) -> Vec<bool> {
        let [width, height] = size.map(|side| side.div_ceil(WINDOW / 2));
        // Windows overlap by half: cells have half the side, and each point checks the four nearest
        // cells.
        let cell = |place: [f32; 2]| place.map(|x| (x + 0.5).max(0.0) / (WINDOW / 2) as f32);
        let mut depths: Vec<Vec<f32>> = vec![Vec::new(); width * height];
        for (place, depth) in self.places.iter().zip(&self.depths) {
            let [x, y] = cell(*place).map(|x| x as usize);
            depths[y.min(height - 1) * width + x.min(width - 1)].push(*depth);
        }
        let hidden = |(place, depth): (&[f32; 2], &f32)| {
            let [x, y] = cell(*place);
            let around = |x: f32, most: usize| {
                let low = (x - 0.5).floor().max(0.0) as usize;
                low..=(low + 1).min(most - 1)
            };
            let before = around(y, height)
                .flat_map(|y| around(x, width).map(move |x| y * width + x))
                .flat_map(|cell| &depths[cell])
                .filter(|other| **other * BEHIND < *depth);
            before.take(ENOUGH).count() == ENOUGH
        };
        self.places.iter().zip(&self.depths).map(|point| !hidden(point)).collect()
    }
}
