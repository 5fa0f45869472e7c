//! Views from the center of bearings, such as a sphere cloud. Directions are released, so nothing needs to be recovered.

use unlift::Error;
use unlift::geometry::camera::Pose;
use unlift::neighbors::{REAL, Similarity, Source, support};
use unlift::recover::Recovered;
use unlift::released::{Obfuscation, Rays, Released};

use super::{Lens, View};

/// Names of the views, with the camera axes right, down and forward.
const SIX: [(&str, [[f64; 3]; 3]); 6] = [
    ("front", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    ("right", [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    ("back", [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]),
    ("left", [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
    ("up", [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    ("down", [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
];
/// Side of a view in pixels. Its angle is 90 degrees.
const SIDE: usize = 640;

/// Returns six views, by name, that together cover all directions from the center of `released`.
///
/// # Errors
/// If its records are no bearings.
pub fn six_views(released: &Released<3>) -> Result<Vec<(&'static str, View)>, Error> {
    let (_, center) = bearings(released)?;
    let center = std::array::from_fn(|c| released.origin()[c] + f64::from(center[c]));
    let (half, middle) = (SIDE as f64 / 2.0, (SIDE as f64 - 1.0) / 2.0);
    let lens = Lens::try_new("SIMPLE_PINHOLE", &[half, middle, middle])?;
    let view =
        |rotation| View { pose: Pose { rotation, center }, lens: lens.clone(), size: [SIDE; 2] };
    Ok(SIX.into_iter().map(|(name, rotation)| (name, view(rotation))).collect())
}

/// Returns a place on every bearing of `released`, at distance 1 from the center. Bearings that look like decoys have none.
///
/// # Errors
/// If records are no bearings, or have no descriptors.
pub fn on_bearings(released: &Released<3>) -> Result<Recovered<3>, Error> {
    let (rays, center) = bearings(released)?;
    let source: &dyn Source<3> = &Similarity;
    let lists = source.lists(released, source.k(released), 0)?;
    let support = support(released, &lists).unwrap_or_else(|| vec![REAL; rays.center().len()]);
    let place = |(direction, support): (&[f32; 3], f64)| match support < REAL {
        true => [f32::NAN; 3],
        false => std::array::from_fn(|c| center[c] + direction[c]),
    };
    let places: Vec<[f32; 3]> = rays.direction().iter().zip(support).map(place).collect();
    Recovered::from_positions(released, &lists, &places)
}

fn bearings(released: &Released<3>) -> Result<(&Rays<3>, [f32; 3]), Error> {
    let obfuscation = released.obfuscation();
    match obfuscation {
        Obfuscation::Rays(rays) if obfuscation.is_bearings() => Ok((rays, rays.centers()[0])),
        _ => Err(Error::new("records", "bearings from one center", obfuscation.family())),
    }
}

#[cfg(test)]
mod tests {
    use unlift::geometry::vector::cross;

    use super::SIX;

    #[test]
    fn views_are_not_mirrored() {
        for (name, [right, down, forward]) in SIX {
            assert_eq!(cross(&right, &down), forward, "{name}");
        }
    }
}
