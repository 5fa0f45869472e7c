//! A room that nobody lives in: photos of it, and the map that structure from motion would make of them.
//!
//! ```text
//! sheets ──> raster ──> material x light ──> photos ──> SIFT ──> tracks ──> points with descriptors
//! ```
//!
//! Only `+ - * /` and `sqrt` make the photos, so a seed gives the same bytes on every platform.

mod color;
mod light;
mod map;
mod material;
mod noise;
mod photo;
mod pinhole;
mod prints;
mod raster;

use std::collections::BTreeSet;

use rayon::prelude::*;
use unlift::synthetic::vectors::{add, scale};
use unlift::synthetic::{self, Sheet};
use unlift::{Descriptors, Error};
use unlift_features::{ColorImage, Sift};
use unlift_invert::View;

use crate::light::Lights;
use crate::pinhole::Pinhole;

/// Width and height of the photos in pixels.
pub const SIZE: [usize; 2] = [640, 480];

/// A map and the photos that it was made of, in meters.
pub struct Mapped {
    /// `(n, 3)`.
    pub points: Vec<[f64; 3]>,
    /// `(n, 128)`: of every point the mean over its track, as maps have them.
    pub descriptors: Descriptors,
    /// The photos, in the order of the walk.
    pub photos: Vec<Photo>,
}

/// One photo, and from where it was taken.
pub struct Photo {
    /// The name of its file, if it had one.
    pub name: String,
    /// The camera.
    pub view: View,
    /// What it saw.
    pub image: ColorImage,
}

/// The part of a photo, 32 pixels wide, that a coordinate lies in.
fn part(x: f32) -> i32 {
    (x / 32.0).floor() as i32
}

impl Mapped {
    /// `n` photos that show much: of every `n`-th part of the walk the one with points in most of its parts.
    ///
    /// # Errors
    /// Never, unless this crate is wrong.
    pub fn telling(&self, n: usize) -> Result<Vec<&Photo>, Error> {
        let points: Vec<_> = self.points.iter().copied().map(Some).collect();
        let shown = |photo: &Photo| {
            let all = photo.view.project(&points)?;
            let seen = all.places.iter().zip(all.visible(photo.view.size));
            let parts = seen.filter(|(_, seen)| *seen).map(|(place, _)| place.map(part));
            Ok(parts.collect::<BTreeSet<_>>().len())
        };
        let shown = self.photos.iter().map(shown).collect::<Result<Vec<_>, Error>>()?;
        let of_part = |part: usize| {
            let part = part * shown.len() / n..(part + 1) * shown.len() / n;
            part.max_by_key(|&at| shown[at])
        };
        Ok((0..n).filter_map(of_part).map(|at| &self.photos[at]).collect())
    }
}

/// The furnished room of `seed`, photographed and mapped.
///
/// # Errors
/// Never, unless this crate is wrong.
pub fn room(seed: u64) -> Result<Mapped, Error> {
    // Neighbors on the walk see much the same.
    mapped(seed, SIZE, |at| at % 2 == 0)
}

/// The map of those photos of the walk that are `wanted`.
fn mapped(seed: u64, size: [usize; 2], wanted: impl Fn(usize) -> bool) -> Result<Mapped, Error> {
    let room = synthetic::room(seed, 0);
    let cameras: Vec<Pinhole> = (room.cameras.iter().enumerate())
        .filter(|(at, _)| wanted(*at))
        .map(|(_, camera)| Pinhole::handheld(camera, size))
        .collect();
    let lights = Lights::of(&room.sheets);
    let sift = Sift::default();
    let taken: Vec<_> = (cameras.par_iter().enumerate())
        .map(|(at, camera)| {
            let seen = raster::seen(camera, &room.sheets);
            let image = photo::photo(camera, &room.sheets, &lights, seed ^ ((at as u64) << 32))?;
            let features = sift.extract(&image.gray()?);
            Ok((image, map::Sighted::new(camera, &room.sheets, &seen, features)))
        })
        .collect::<Result<_, Error>>()?;
    let (images, sighted): (Vec<_>, Vec<_>) = taken.into_iter().unzip();
    let (points, descriptors) = map::triangulated(&cameras, &sighted)?;
    let photo = |(at, (camera, image)): (usize, (&Pinhole, ColorImage))| {
        Ok(Photo { name: format!("room-{at:02}.jpg"), view: camera.view()?, image })
    };
    let photos = cameras.iter().zip(images).enumerate().map(photo);
    let photos = photos.collect::<Result<_, Error>>()?;
    Ok(Mapped { points, descriptors, photos })
}

/// The middle of a sheet.
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
        let images = |photos: Vec<Photo>| photos.into_iter().map(|photo| photo.image).collect();
        let (one, three): (Vec<_>, Vec<_>) = (images(one.photos), images(three.photos));
        assert_eq!(one, three);
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
            // Those behind something are for other cameras.
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

    #[test]
    fn telling_photos_come_from_all_parts_of_the_walk() {
        let mapped = few();
        let names: Vec<&str> =
            mapped.telling(2).unwrap().iter().map(|photo| photo.name.as_str()).collect();
        let half = |part: usize| (4 * part..4 * part + 4).map(|at| format!("room-{at:02}.jpg"));
        assert!(half(0).any(|name| name == names[0]), "{names:?}");
        assert!(half(1).any(|name| name == names[1]), "{names:?}");
    }
}
