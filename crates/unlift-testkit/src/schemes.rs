//! Property tests of schemes.

use unlift::evaluate::Truth;
use unlift::obfuscate::{Scheme, obfuscate};
use unlift::released::Released;
use unlift::seed::Key;
use unlift::truth::{Original, Secret};
use unlift::{Error, PointSet, Unit};

use crate::points::image_around;
use crate::{check_name, on_threads, piles, room, uniform};

/// Records are stored in `f32`: a few units in the last place of the largest coordinate, in meters.
const TOLERANCE: f64 = 4e-6;
/// Maximum share of originals that keep their row.
const MAX_IN_PLACE: f64 = 0.05;
const IMAGE_STEP: f64 = 1.0;

/// Checks all properties of a scheme:
///
/// 1. Its name is one plain word.
/// 2. Every original has one slot or is dropped with a reason: in rooms, piles of coincident points
///    and maps of few points. A map that cannot be hidden gives an error.
/// 3. Every hidden point lies on its record, near the origin and 1000 km away. Bearings from one
///    center may have decoys.
/// 4. The same key gives the same records for any number of threads; another key gives others.
/// 5. The order of records does not reveal the order of the originals.
///
/// In 2D, points are keypoints of an image.
///
/// # Panics
/// When a property does not hold.
pub fn scheme_laws<const D: usize>(scheme: &dyn Scheme<D>) {
    let name = scheme.name();
    check_name(name);
    // Obfuscation itself counts the originals in slots and the dropped ones. A map may be refused, but not for a wrong count.
    let few = [0, 1, 2, 3, 7].into_iter().flat_map(|n| [uniform(9, n), piles(9, 1, n, 0.0)]);
    for points in few.chain([room(5, 300), piles(9, 40, 3, 0.0), uniform(8, 301)]) {
        let error = hide(scheme, &points, IMAGE_STEP, 5).err().map(|error| error.to_string());
        let is_counted = |error: &String| {
            !error.contains("in one slot or dropped once") && !error.contains("originals below")
        };
        assert!(error.iter().all(is_counted), "{name}, {} points: {error:?}", points.len());
    }
    for shift in [0.0, 1e6] {
        let points: Vec<[f64; D]> = room(6, 200).iter().map(|p| p.map(|x| x + shift)).collect();
        points_lie_on_their_records(scheme, &points, TOLERANCE + 8.0 * shift * f64::EPSILON);
    }
    keys_decide_alone(scheme);
    order_tells_nothing(scheme);
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

fn points_lie_on_their_records<const D: usize>(
    scheme: &dyn Scheme<D>,
    points: &[[f64; D]],
    tolerance: f64,
) {
    let name = scheme.name();
    let (original, released, secret) = hide(scheme, points, IMAGE_STEP, 3)
        .unwrap_or_else(|e| panic!("{name} cannot hide a room: {e}"));
    if released.obfuscation().is_bearings() {
        return;
    }
    let truth = Truth { original: &original, released: &released, secret: &secret };
    for (slot, off) in truth.away_from_own().into_iter().enumerate() {
        assert!(off <= tolerance, "{name}: the point of slot {slot} is {off} off its record");
    }
}

fn keys_decide_alone<const D: usize>(scheme: &dyn Scheme<D>) {
    let points = room(11, 700);
    let on = |threads: usize, seed: u64| {
        let hidden = on_threads(threads, || hide(scheme, &points, IMAGE_STEP, seed));
        let (_, released, secret) = hidden.expect("a room");
        (released, secret)
    };
    let (name, one) = (scheme.name(), on(1, 7));
    assert!(one == on(1, 7), "{name}: the same key gives different maps");
    assert!(one == on(3, 7), "{name}: the number of threads changes the map");
    assert!(one.0 != on(1, 8).0, "{name}: different keys give the same map");
}

fn order_tells_nothing<const D: usize>(scheme: &dyn Scheme<D>) {
    let (_, _, secret) = hide(scheme, &room(12, 600), IMAGE_STEP, 2).expect("a room");
    let in_place = secret.hidden().iter().enumerate().filter(|(slot, id)| id.index() == *slot);
    let share = in_place.count() as f64 / secret.n_slots().max(1) as f64;
    let name = scheme.name();
    assert!(share <= MAX_IN_PLACE, "{name}: {share:.2} of the points keep their row");
}
