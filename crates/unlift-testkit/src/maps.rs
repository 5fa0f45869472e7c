//! Points and maps for tests.

use unlift::descriptors::Values;
use unlift::geometry::frame::Bounds;
use unlift::obfuscate::{Scheme, obfuscate};
use unlift::released::Released;
use unlift::seed::{Draws, Key, Stage};
use unlift::truth::{Original, Secret};
use unlift::{Descriptors, Error, PointSet, Unit};

/// Returns points of a room: walls, uneven clusters, scatter, and 3 % coincident ones.
pub fn room<const D: usize>(seed: u64, n: usize) -> Vec<[f64; D]> {
    let mut draws = Draws::new(seed, Stage::Synthetic, 1);
    let size: [f64; D] = std::array::from_fn(|c| [6.0, 4.0, 2.5][c]);
    let anywhere = |draws: &mut Draws| std::array::from_fn(|c| draws.between(0.0, size[c]));
    let clusters: Vec<[f64; D]> = (0..6).map(|_| anywhere(&mut draws)).collect();
    let mut points: Vec<[f64; D]> = Vec::with_capacity(n);
    while points.len() < n {
        let kind = draws.below(100);
        let point = if kind < 3 && !points.is_empty() {
            points[draws.below(points.len() as u64) as usize]
        } else if kind < 45 {
            let mut point = anywhere(&mut draws);
            let wall = draws.below(D as u64) as usize;
            point[wall] = size[wall] * draws.below(2) as f64;
            point
        } else if kind < 85 {
            let center = clusters[draws.below(6) as usize];
            center.map(|x| x + 0.25 * draws.normal())
        } else {
            anywhere(&mut draws)
        };
        points.push(point);
    }
    points
}

/// Returns uniform points in a box.
pub fn uniform<const D: usize>(seed: u64, n: usize) -> Vec<[f64; D]> {
    let mut draws = Draws::new(seed, Stage::Synthetic, 2);
    (0..n).map(|_| std::array::from_fn(|c| draws.between(0.0, [6.0, 4.0, 3.0][c]))).collect()
}

/// Returns `copies` points at each of `places` random places, each moved by up to `spread`.
pub fn piles<const D: usize>(
    seed: u64,
    places: usize,
    copies: usize,
    spread: f64,
) -> Vec<[f64; D]> {
    let mut draws = Draws::new(seed, Stage::Synthetic, 3);
    let centers: Vec<[f64; D]> = uniform(seed, places);
    (0..places * copies)
        .map(|i| centers[i / copies].map(|x| x + spread * draws.between(-1.0, 1.0)))
        .collect()
}

/// Returns image bounds around `points`, in whole units of `step`.
fn image_around<const D: usize>(points: &[[f64; D]], step: f64) -> Bounds<D> {
    let Some(Bounds { low, high }) = Bounds::quantiles(points, 0.0) else {
        return Bounds { low: [0.0; D], high: [step; D] };
    };
    Bounds {
        low: low.map(|x| ((x / step).floor() - 1.0) * step),
        high: high.map(|x| ((x / step).ceil() + 1.0) * step),
    }
}

/// Hides `points`. In 2D they are keypoints of an image, whose sides are multiples of `step`.
///
/// # Errors
/// When the scheme cannot hide these points.
pub fn hide<const D: usize>(
    scheme: &dyn Scheme<D>,
    points: &[[f64; D]],
    step: f64,
    seed: u64,
) -> Result<(Original<D>, Released<D>, Secret), Error> {
    let set = PointSet::try_new(points.to_vec(), Unit::Meter)?;
    let original = match D {
        2 => Original::within(set, image_around(points, step))?,
        _ => Original::new(set),
    };
    let (released, secret) = obfuscate(scheme, &original, None, &Key::from_seed(seed))?;
    Ok((original, released, secret))
}

/// Returns a room hidden by `scheme`, with SIFT-like descriptors (128 bytes) that change slowly
/// over the room, and the secret, with which you can measure lists.
///
/// # Panics
/// When the scheme cannot hide a room of `n` points.
pub fn described_map(scheme: &dyn Scheme<3>, n: usize) -> (Original<3>, Released<3>, Secret) {
    let points: Vec<[f64; 3]> = room(4, n);
    let value = |point: &[f64; 3], bin: usize| {
        let mut draws = Draws::new(99, Stage::Synthetic, bin as u64);
        let phase: f64 = point.iter().map(|x| draws.between(-3.0, 3.0) * x).sum();
        (60.0 + 55.0 * (phase + draws.between(0.0, 6.0)).sin()) as u8
    };
    let bytes = points.iter().flat_map(|point| (0..128).map(|bin| value(point, bin))).collect();
    let descriptors = Descriptors::try_new(Values::U8(bytes), 128).expect("128 bytes a point");
    let original = Original::new(PointSet::try_new(points, Unit::Meter).expect("finite points"));
    let (released, secret) = obfuscate(scheme, &original, Some(&descriptors), &Key::from_seed(1))
        .unwrap_or_else(|error| panic!("{} cannot hide a room: {error}", scheme.name()));
    (original, released, secret)
}
