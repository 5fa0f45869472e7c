//! Released data is independent of the hidden value: if pairs, centers, planes and grids are fixed,
//! moving an original along its own record changes no stored byte. Axis candidates are exempt,
//! because the partner publishes the hidden value.

use proptest::prelude::*;
use unlift::Error;
use unlift::geometry::frame::Bounds;
use unlift::obfuscate::plane::Plane;
use unlift::obfuscate::{Entry, Lifted, Scheme};
use unlift::released::{AxisPlanes, Lines, Obfuscation, Rays};
use unlift::seed::{Draws, Key, Stage};

use crate::maps::*;

fn along<const D: usize>(point: &[f64; D], t: f64, direction: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|c| point[c] + t * direction[c])
}

fn sub<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|c| a[c] - b[c])
}

fn a_line_forgets_its_point<const D: usize>(seed: u64, n: usize) {
    let mut draws = Draws::new(seed, Stage::Synthetic, 7);
    for _ in 0..n {
        let point: [f64; D] = std::array::from_fn(|_| draws.between(-5.0, 5.0));
        let direction = draws.direction();
        let stored = |t: f64| {
            let lines = Lines::through(&[along(&point, t, &direction)], &[direction]).unwrap();
            record_bytes(&Obfuscation::Lines(lines))
        };
        let t = draws.between(-9.0, 9.0);
        assert_eq!(stored(0.0), stored(t), "{point:?} along {direction:?} by {t}");
    }
}

fn a_ray_forgets_its_range<const D: usize>(seed: u64, n: usize) {
    let mut draws = Draws::new(seed, Stage::Synthetic, 8);
    for _ in 0..n {
        let center: [f64; D] = std::array::from_fn(|_| f64::from(draws.between(-5.0, 5.0) as f32));
        let point: [f64; D] = std::array::from_fn(|_| draws.between(-5.0, 5.0));
        let stored = |range: f64| {
            let moved = along(&center, range, &sub(&point, &center));
            let rays = Rays::try_new(&[center], vec![0], &[sub(&moved, &center)]).unwrap();
            record_bytes(&Obfuscation::Rays(rays))
        };
        let range = draws.between(0.05, 9.0);
        assert_eq!(stored(1.0), stored(range), "{point:?} from {center:?} to {range}");
    }
}

/// Returns true if the result of `scheme` does not change when every point keeps only the
/// coordinate of its plane.
fn keeps_one_coordinate(scheme: &dyn Scheme<3>, seed: u64) -> bool {
    let (points, others) = (uniform::<3>(seed, 60), uniform::<3>(seed ^ 1, 60));
    let lift = |points: &[[f64; 3]]| {
        let lifted = scheme.lift(points, None, &Key::from_seed(seed)).unwrap();
        // The debug output contains all fields, including those added later.
        (format!("{lifted:?}"), lifted.obfuscation)
    };
    let (said, Obfuscation::AxisPlanes(planes)) = lift(&points) else { panic!("planes") };
    let moved = |(at, &axis): (usize, &u8)| {
        let mut moved = others[at];
        moved[usize::from(axis)] = points[at][usize::from(axis)];
        moved
    };
    let moved: Vec<[f64; 3]> = planes.axis().iter().enumerate().map(moved).collect();
    assert!(moved.iter().zip(&points).all(|(a, b)| a != b), "every point moves");
    lift(&moved).0 == said
}

/// `plane` with a leak: the order of two coordinates decides the axis.
#[derive(Debug)]
struct Telling;

impl Scheme<3> for Telling {
    fn name(&self) -> &str {
        "telling"
    }

    fn lift(
        &self,
        points: &[[f64; 3]],
        _: Option<&Bounds<3>>,
        _: &Key,
    ) -> Result<Lifted<3>, Error> {
        let axis: Vec<u8> = points.iter().map(|p| u8::from(p[0] < p[1])).collect();
        let offset: Vec<f64> = points.iter().zip(&axis).map(|(p, &a)| p[usize::from(a)]).collect();
        Ok(Lifted::one_each(Obfuscation::AxisPlanes(AxisPlanes::try_new(axis, &offset)?)))
    }
}

#[test]
fn planes_that_tell_more_are_found() {
    assert!((0..8).all(|seed| !keeps_one_coordinate(&Telling, seed)));
}

proptest! {
    #![proptest_config(cases(8))]

    #[test]
    fn lines_forget_where_on_them_the_point_was(seed: u64) {
        a_line_forgets_its_point::<3>(seed, 400);
        a_line_forgets_its_point::<2>(seed, 400);
    }

    #[test]
    fn rays_forget_the_range(seed: u64) {
        a_ray_forgets_its_range::<3>(seed, 400);
        a_ray_forgets_its_range::<2>(seed, 400);
    }

    #[test]
    fn planes_keep_one_coordinate(seed: u64) {
        prop_assert!(keeps_one_coordinate(&Plane, seed));
    }
}

/// Points close to their own foot, where a shortcut of the normal form could leak.
#[test]
fn lines_forget_points_near_the_foot() {
    let mut draws = Draws::new(1, Stage::Synthetic, 9);
    for _ in 0..2000 {
        let direction: [f64; 3] = draws.direction();
        let point: [f64; 3] = std::array::from_fn(|_| draws.between(-5.0, 5.0));
        let foot = along(&point, -dot(&point, &direction), &direction);
        let stored = |t: f64| {
            let lines = Lines::through(&[along(&foot, t, &direction)], &[direction]).unwrap();
            record_bytes(&Obfuscation::Lines(lines))
        };
        let t = norm(&foot) * draws.between(-1e-6, 1e-6);
        assert_eq!(stored(1.0), stored(t), "{foot:?} along {direction:?} by {t}");
    }
}

/// Points nearly one unit apart, where a shortcut of normalization could leak.
#[test]
fn directions_forget_lengths_near_one() {
    let mut draws = Draws::new(1, Stage::Synthetic, 10);
    for _ in 0..2000 {
        let direction: [f64; 3] = draws.direction();
        let point: [f64; 3] = std::array::from_fn(|_| draws.between(-5.0, 5.0));
        let length = 1.0 + draws.between(-3e-7, 3e-7);
        let stored = |length: f64| {
            let lines = Lines::through(&[point], &[direction.map(|x| x * length)]).unwrap();
            let rays = Rays::try_new(&[point], vec![0], &[direction.map(|x| x * length)]).unwrap();
            let mut bytes = record_bytes(&Obfuscation::Lines(lines));
            bytes.extend(record_bytes(&Obfuscation::Rays(rays)));
            bytes
        };
        assert_eq!(stored(2.0), stored(length), "{direction:?} of length {length}");
    }
}

/// Returns two clouds, each symmetric about its middle. If opposite points move by the same factor,
/// the mean and the centers of a ray cloud do not change.
fn symmetric_clouds<const D: usize>(seed: u64) -> Vec<[f64; D]> {
    let mut draws = Draws::new(seed, Stage::Synthetic, 11);
    let mut points = Vec::new();
    for middle in [-4.0, 4.0] {
        for _ in 0..60 {
            let offset: [f64; D] = std::array::from_fn(|_| draws.between(-1.0, 1.0));
            points.push(offset.map(|x| middle + x));
            points.push(offset.map(|x| middle - x));
        }
    }
    points
}

/// Obfuscates, moves one original (or an opposite pair) along its record, and obfuscates again.
fn moving_along_the_record_changes_no_byte<const D: usize>(name: &str, scheme: &Entry, seed: u64) {
    let points = symmetric_clouds::<D>(seed);
    // One voxel contains all points, so the grid is fixed.
    let voxel = 1e3;
    let before = try_hide::<D>(scheme, &points, voxel, seed).unwrap();
    let origin = before.released.origin();
    let original_of = |slot: usize| before.secret.hidden()[slot].index();
    let slot_of = |id: usize| (0..before.secret.n_slots()).find(|&slot| original_of(slot) == id);
    let mut draws = Draws::new(seed, Stage::Synthetic, 12);
    let (mut tried, mut changed) = (0, 0);
    for slot in 0..before.secret.n_slots() {
        let id = original_of(slot);
        let mut moved = points.clone();
        let by = draws.between(0.6, 1.4);
        match before.released.obfuscation() {
            Obfuscation::Lines(lines) if before.released.slots_per_record() == 1 => {
                // The exact direction that a scheme of single lines draws for the point.
                let direction =
                    Key::from_seed(seed).draws(Stage::Scheme, id as u64).direction::<D>();
                let stored = lines.direction()[slot].map(f64::from);
                assert!(
                    (dot(&direction, &stored).abs() - 1.0).abs() < 1e-6,
                    "{name}: another draw"
                );
                moved[id] = along(&points[id], by - 1.0, &direction);
            }
            Obfuscation::Lines(_) => {
                let partner = points[original_of(slot ^ 1)];
                moved[id] = along(&partner, by, &sub(&points[id], &partner));
            }
            Obfuscation::Rays(rays) if rays.regions().is_some() => {
                // Anchors do not depend on the points.
                let center = rays.centers()[usize::from(rays.center()[slot])].map(f64::from);
                let center = std::array::from_fn(|c| center[c] + origin[c]);
                moved[id] = along(&center, by, &sub(&points[id], &center));
            }
            Obfuscation::Rays(rays) => {
                let Some(other) = slot_of(id ^ 1) else { continue };
                let center_of = |slot: usize| rays.center()[slot];
                let center = rays.centers()[usize::from(center_of(slot))].map(f64::from);
                let center: [f64; D] = std::array::from_fn(|c| center[c] + origin[c]);
                let middle = if id < points.len() / 2 { [-4.0; D] } else { [4.0; D] };
                if center_of(slot) != center_of(other) || center != middle {
                    continue;
                }
                for id in [id, id ^ 1] {
                    moved[id] = along(&middle, by, &sub(&points[id], &middle));
                }
            }
            Obfuscation::AxisPlanes(planes) => {
                for c in (0..D).filter(|&c| c != usize::from(planes.axis()[slot])) {
                    moved[id][c] += by - 1.0;
                }
            }
            Obfuscation::AxisCandidates(_) => return,
        }
        let after = try_hide::<D>(scheme, &moved, voxel, seed).unwrap();
        let fixed = after.secret == before.secret && after.released.origin() == origin;
        let centers_fixed = match (before.released.obfuscation(), after.released.obfuscation()) {
            (Obfuscation::Rays(a), Obfuscation::Rays(b)) => a.centers() == b.centers(),
            _ => true,
        };
        if fixed && centers_fixed {
            tried += 1;
            changed +=
                usize::from(released_bytes(&after.released) != released_bytes(&before.released));
        }
    }
    assert!(tried >= 20, "{name}: only {tried} moves kept pairing and centers fixed");
    assert_eq!(changed, 0, "{name}: {changed} of {tried} moves changed a stored byte");
}

#[test]
fn gauge_end_to_end() {
    over_schemes!(moving_along_the_record_changes_no_byte, 21);
}
