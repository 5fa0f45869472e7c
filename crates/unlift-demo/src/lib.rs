//! Data of the demo: two CC0 photos, and the map of a synthetic room.
//!
//! The map is made like one from structure from motion, from rendered photos of the room:
//!
//! ```text
//! sheets ──> raster ──> material x light ──> photos ──> SIFT ──> tracks ──> points with descriptors
//! ```
//!
//! Only `+ - * /` and `sqrt` are used for the photos, so they are byte-identical on all platforms.

mod color;
mod light;
mod map;
mod material;
mod noise;
mod photo;
mod pinhole;
mod prints;
mod raster;

use std::fs;
use std::io;
use std::path::Path;

use rayon::prelude::*;
use unlift::synthetic::vectors::{add, scale};
use unlift::synthetic::{self, Sheet};
use unlift::{Descriptors, Error};
use unlift_vision::features::Sift;

use crate::light::Lights;
use crate::pinhole::Pinhole;

/// File names and bytes of the two photos: JPEG, CC0. photos/README.md lists the authors.
pub static PHOTOS: [(&str, &[u8]); 2] = [
    ("cat.jpg", include_bytes!("../photos/cat.jpg")),
    ("coffee.jpg", include_bytes!("../photos/coffee.jpg")),
];

/// Writes the two photos into `folder`, which must exist.
///
/// # Errors
/// When a file cannot be written.
pub fn write_photos(folder: &Path) -> io::Result<()> {
    PHOTOS.iter().try_for_each(|(name, bytes)| fs::write(folder.join(name), bytes))
}

/// Width and height of the rendered photos in pixels.
const SIZE: [usize; 2] = [480, 360];

/// A map like one from structure from motion, in meters.
pub struct Mapped {
    /// Positions, `(n, 3)`.
    pub points: Vec<[f64; 3]>,
    /// SIFT descriptors, `(n, 128)`: the mean over each point's track, as in real maps.
    pub descriptors: Descriptors,
    /// Centers of the cameras, `(m, 3)`.
    pub cameras: Vec<[f64; 3]>,
}

/// Creates the map of the furnished room of `seed`.
///
/// # Errors
/// Only if this crate has a bug.
pub fn room(seed: u64) -> Result<Mapped, Error> {
    // Neighboring photos on the walk are similar, and each takes half a second.
    mapped(seed, SIZE, |at| at % 3 == 0)
}

/// Creates the map from those photos of the walk that `wanted` selects by number.
fn mapped(seed: u64, size: [usize; 2], wanted: impl Fn(usize) -> bool) -> Result<Mapped, Error> {
    let room = synthetic::room(seed, 0);
    let cameras: Vec<Pinhole> = (room.cameras.iter().enumerate())
        .filter(|(at, _)| wanted(*at))
        .map(|(_, camera)| Pinhole::handheld(camera, size))
        .collect();
    let lights = Lights::of(&room.sheets);
    let sift = Sift::default();
    let sighted: Vec<_> = (cameras.par_iter().enumerate())
        .map(|(at, camera)| {
            let seen = raster::seen(camera, &room.sheets);
            let image = photo::photo(camera, &room.sheets, &lights, seed ^ ((at as u64) << 32))?;
            let features = sift.extract(&image.gray()?);
            Ok(map::Sighted::new(camera, &room.sheets, &seen, features))
        })
        .collect::<Result<_, Error>>()?;
    let (points, descriptors) = map::triangulated(&cameras, &sighted)?;
    let cameras = cameras.iter().map(|camera| camera.center).collect();
    Ok(Mapped { points, descriptors, cameras })
}

fn middle(sheet: &Sheet) -> [f64; 3] {
    let half = scale(add(sheet.u, sheet.v), 0.5);
    add(sheet.corner, half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::{Facing, NONE};
    use unlift::synthetic::vectors::{norm, sub};

    fn few() -> Mapped {
        mapped(3, [320, 240], |at| at < 12 && at % 3 < 2).unwrap()
    }

    #[test]
    fn same_seed_same_bytes_for_any_number_of_threads() {
        let made = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(few)
        };
        let (one, three) = (made(1), made(3));
        assert!(one.points.len() > 100, "{}", one.points.len());
        assert_eq!((one.points, one.descriptors), (three.points, three.descriptors));
    }

    #[test]
    fn points_lie_on_what_the_photos_show() {
        let mapped = few();
        let room = synthetic::room(3, 0);
        let camera = Pinhole::handheld(&room.cameras[0], [320, 240]);
        let seen = raster::seen(&camera, &room.sheets);
        let (mut n, mut near) = (0, 0);
        for &point in &mapped.points {
            let Some((place, depth)) = camera.project(point) else { continue };
            let (sheet, before) = seen.at(place);
            assert_ne!(sheet, NONE, "a closed room");
            // Points behind another surface are skipped.
            if depth < f64::from(before) * 1.02 {
                let ray = camera.ray(place);
                let (far, _) = Facing::new(&camera, &room.sheets[sheet as usize]).hit(ray);
                let hit = camera.in_world(unlift::synthetic::vectors::scale(ray, far));
                let apart = norm(sub(hit, sub(point, camera.center)));
                (n, near) = (n + 1, near + usize::from(apart < 0.02 * depth));
            }
        }
        assert!(n > 50 && near * 10 > n * 8, "{near} of {n}");
    }
}
