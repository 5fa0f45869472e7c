//! Released data is independent of the hidden value: if pairs, centers, planes and grids are fixed,
//! moving an original along its own record changes no stored byte. Axis candidates are exempt,
//! because the partner publishes the hidden value.

use crate::maps::*;

/// Moves random points along a line and along a ray through them.
fn records_forget_their_points<const D: usize>(seed: u64) {
    let mut draws = Draws::new(seed, Stage::Synthetic, 7);
    for _ in 0..400 {
        let mut place = || -> [f64; D] { std::array::from_fn(|_| draws.between(-5.0, 5.0)) };
        // Centers are stored as `f32`.
        let (point, center) = (place(), place().map(|x| f64::from(x as f32)));
        let direction = draws.direction();
        let line = |from: &[f64; D], t: f64| {
            let lines = Lines::through(&[along(from, t, &direction)], &[direction]).unwrap();
            fingerprint(Obfuscation::Lines(lines))
        };
        // Near the foot, too, where a shortcut of the normal form could reveal the point.
        let foot = along(&point, -dot(&point, &direction), &direction);
        let near = 1e-6 * dot(&foot, &foot).sqrt();
        for (from, start, reach) in [(point, 0.0, 9.0), (foot, 1.0, near)] {
            let t = draws.between(-reach, reach);
            assert_eq!(line(&from, start), line(&from, t), "{from:?} along {direction:?} by {t}");
        }
        let ray = |range: f64| {
            let moved = along(&center, range, &sub(&point, &center));
            let rays = Rays::try_new(&[center], vec![0], &[sub(&moved, &center)]).unwrap();
            fingerprint(Obfuscation::Rays(rays))
        };
        // Lengths near 1, too, which a shortcut of normalization could reveal.
        let near_one = 1.0 + draws.between(-3e-7, 3e-7);
        for range in [draws.between(0.05, 9.0), near_one / distance(&point, &center)] {
            assert_eq!(ray(1.0), ray(range), "{point:?} from {center:?} to {range}");
        }
    }
}

#[test]
fn records_forget_where_on_them_the_point_was() {
    for seed in seeds(8) {
        records_forget_their_points::<3>(seed);
        records_forget_their_points::<2>(seed);
    }
}

/// Returns two clouds whose means stay if opposite points move by the same factor.
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
    let center_of = |rays: &Rays<D>, slot: usize| {
        along(&origin, 1.0, &widen(&rays.centers()[usize::from(rays.center()[slot])]))
    };
    let mut draws = Draws::new(seed, Stage::Synthetic, 12);
    let mut tried = 0;
    for slot in 0..before.secret.n_slots() {
        let id = original_of(slot);
        let mut moved = points.clone();
        let by = draws.between(0.6, 1.4);
        match before.released.obfuscation() {
            Obfuscation::Lines(_) if before.released.slots_per_record() == 1 => {
                // The exact direction that a scheme of single lines draws for the point.
                let direction = Key::from_seed(seed).draws(Stage::Scheme, id as u64).direction();
                moved[id] = along(&points[id], by - 1.0, &direction);
            }
            Obfuscation::Lines(_) => {
                let partner = points[original_of(slot ^ 1)];
                moved[id] = along(&partner, by, &sub(&points[id], &partner));
            }
            Obfuscation::Rays(rays) => {
                let center = center_of(rays, slot);
                let is_on = |id: usize| slot_of(id).is_some_and(|of| center_of(rays, of) == center);
                // Anchors do not depend on the points.
                let opposite = rays.regions().is_none().then_some(id ^ 1);
                if !opposite.is_none_or(is_on) {
                    continue;
                }
                for id in opposite.into_iter().chain([id]) {
                    moved[id] = along(&center, by, &sub(&points[id], &center));
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
            let is_same = after.released.fingerprint() == before.released.fingerprint();
            assert!(is_same, "{name}: the move of point {id} changed a stored byte");
        }
    }
    assert!(tried >= 20, "{name}: only {tried} moves kept pairing and centers fixed");
}

#[test]
fn gauge_end_to_end() {
    over_schemes!(moving_along_the_record_changes_no_byte, 21);
}
