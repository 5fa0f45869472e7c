//! Laws of several releases of the same points: two maps, and queries whose poses are known.

use unlift::again::{Solved, by_descriptors, by_geometry};
use unlift::evaluate::Accuracy;
use unlift::geometry::camera::{Camera, Intrinsics, Pose};
use unlift::obfuscate::SCHEMES;
use unlift::sequence::{self, Links, Query};

use crate::maps::*;

const N: usize = 900;
/// Largest side of the room, in meters.
const EXTENT: f64 = 6.0;

fn points() -> Vec<[f64; 3]> {
    uniform(5, N)
}

/// Releases points with the first rows of the same descriptors.
fn release<const D: usize>(name: &str, original: &Original<D>, seed: u64) -> Hidden<D> {
    let descriptors = random_descriptors(6, original.len(), 16);
    let (scheme, key) = (entry(name), Key::from_seed(seed));
    let (released, secret) = obfuscate(scheme, original, Some(&descriptors), &key).unwrap();
    Hidden { original: original.clone(), released, secret }
}

type Attack = fn(&Released<3>, &Released<3>) -> Result<Solved, Error>;

/// Returns what an attack gives, its accuracy, and the numbers of right links and of links.
fn attack((a, b): (&str, &str), attack: Attack) -> (Solved, Accuracy, usize, usize) {
    let original = original(points());
    let (first, second) = (release(a, &original, 1), release(b, &original, 2));
    let solved = attack(&first.released, &second.released).unwrap();
    let accuracy = evaluate(&solved.recovered, &original, &first.secret).unwrap();
    let own = unlift::evaluate::joined(&solved.recovered, &original, &first.secret);
    let links = solved.links.iter().enumerate().filter_map(|(row, link)| Some((row, (*link)?)));
    let is_right = |&(row, record): &(usize, u32)| {
        let (per, record) = (second.secret.slots_per_record(), record as usize);
        second.secret.hidden()[record * per..(record + 1) * per].contains(&own.hidden()[row])
    };
    let (n_links, n_right) = (links.clone().count(), links.filter(is_right).count());
    (solved, accuracy, n_right, n_links)
}

/// Returns the percentage that two releases fix.
fn fixed(a: &str, b: &str) -> std::ops::RangeInclusive<f64> {
    match (a, b) {
        // Planes of two axes leave a line, those of one axis the plane.
        ("plane", "plane") => 0.0..=0.0,
        // A third of the points are swapped along the axis of their plane.
        ("plane", "cp") | ("cp", "plane") => 25.0..=42.0,
        // Both releases compute the same two centers, so that half of the rays are the same; the grid chooses the same center again.
        ("ray", "ray") | ("ray", "ray-voxel") | ("ray-voxel", "ray") => 42.0..=58.0,
        ("ray-voxel", "ray-voxel") => 0.0..=0.0,
        _ => 99.0..=100.0,
    }
}

#[test]
fn two_releases_give_back_every_point_that_their_records_fix() {
    let names = || SCHEMES.iter().filter(|entry| entry.dimensions() == 3).map(|entry| entry.name);
    for (a, b) in names().flat_map(|a| names().map(move |b| (a, b))) {
        let (solved, accuracy, n_right, n_links) = attack((a, b), by_descriptors);
        assert_eq!(n_right, n_links, "{a}/{b}");
        // A scheme may drop points.
        assert!(n_links as f64 > 0.95 * accuracy.n_points() as f64, "{a}/{b}");
        let n_fixed = n_links - solved.n_open;
        let percent = 100.0 * n_fixed as f64 / n_links as f64;
        assert!(fixed(a, b).contains(&percent), "{a}/{b}: {percent} %");
        // Records that cross at a small angle magnify rounding.
        for (within, least) in [(1e-6, 0.9), (1e-3, 0.999)] {
            let near = accuracy.n_within(within * EXTENT) as f64;
            assert!(near >= least * n_fixed as f64, "{a}/{b}: {near} of {n_fixed}");
        }
    }
}

#[test]
fn lines_that_meet_need_no_descriptors() {
    for (a, b) in [("olc", "olc"), ("ppl", "ppl+"), ("olc", "ppl"), ("cp", "olc"), ("ray", "olc")] {
        let (_, accuracy, n_right, n_links) = attack((a, b), by_geometry);
        let near = accuracy.percent_within(1e-4 * EXTENT);
        assert!(near > 97.0, "{a}/{b}: {near} %");
        assert!(n_right as f64 > 0.98 * n_links as f64, "{a}/{b}");
    }
    let original = original(points());
    for (a, b, why) in [
        ("plane", "olc", "a plane meets every record"),
        ("cp", "cp", "every value of a coordinate is in both releases"),
    ] {
        let [a, b] = [(a, 1), (b, 2)].map(|(name, seed)| release(name, &original, seed).released);
        assert!(by_geometry(&a, &b).unwrap_err().to_string().contains(why));
    }
}

#[test]
fn a_changed_map_gives_back_what_did_not_change() {
    // The second map lacks the last tenth of the points, and another tenth has moved.
    let mut draws = Draws::new(7, Stage::Synthetic, 0);
    let mut changed = points();
    changed.truncate(N - N / 10);
    let moved = changed[..N / 10].iter_mut();
    moved.for_each(|p| p.iter_mut().for_each(|x| *x += draws.between(0.5, 1.0)));
    let (first, second) = (original(points()), original(changed));
    // A point whose partner changed may stay open.
    for (name, least) in [("olc", 78.0), ("ppl", 74.0), ("cp", 65.0)] {
        let (a, b) = (release(name, &first, 1), release(name, &second, 2));
        let solved = by_descriptors(&a.released, &b.released).unwrap();
        let accuracy = evaluate(&solved.recovered, &first, &a.secret).unwrap();
        let near = accuracy.percent_within(1e-4 * EXTENT);
        assert!((least..=80.5).contains(&near), "{name}: {near} %");
        let sure: Vec<bool> = (0..accuracy.n_points())
            .filter(|&slot| solved.recovered.probability_within(slot, 0.01) >= Some(0.9))
            .map(|slot| accuracy.errors()[slot] <= 0.01)
            .collect();
        let right = sure.iter().filter(|right| **right).count();
        // Rows of paired lines are in another order than slots.
        assert!(name == "ppl" || right as f64 > 0.9 * sure.len() as f64, "{name}: {right}");
        assert!(sure.len() > N / 2, "{name}: {}", sure.len());
    }
}

const SIZE: [f64; 2] = [640.0, 480.0];

/// A camera of a person who walks and turns: on a curve, turned about the vertical and about its axis.
fn camera(at: usize) -> Camera {
    let t = at as f64;
    let center = [0.25 * t - 0.8, 0.15 * (1.7 * t).sin(), 0.1 * (2.3 * t).cos()];
    let ((s, c), (sr, cr)) = ((0.03 * t - 0.1).sin_cos(), (0.2 * (3.1 * t).sin()).sin_cos());
    let turned = [[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]];
    let row = |a: f64, b: f64| [0, 1, 2].map(|i| a * turned[0][i] + b * turned[1][i]);
    let rotation = [row(cr, -sr), row(sr, cr), turned[2]];
    let intrinsics = Intrinsics { focal: [500.0; 2], principal: [319.5, 239.5] };
    Camera { intrinsics, pose: Pose { rotation, center } }
}

/// Queries of the points that all cameras see.
struct Sequence {
    queries: Vec<Query>,
    views: Vec<Hidden<2>>,
}

fn sequence(scheme: &str, n: usize) -> Sequence {
    let image = Bounds { low: [-0.5; 2], high: SIZE.map(|x| x - 0.5) };
    let mut draws = Draws::new(1, Stage::Synthetic, 0);
    let mut point = || [(-1.2, 1.2), (-0.8, 0.8), (3.0, 6.0)].map(|(a, b)| draws.between(a, b));
    let mut points: Vec<[f64; 3]> = (0..150).map(|_| point()).collect();
    points.retain(|x| {
        (0..n).all(|at| camera(at).project(x).is_some_and(|place| image.contains(&place)))
    });
    assert!(points.len() > 75, "{}", points.len());
    let view = |at: usize| {
        let places = points.iter().filter_map(|x| camera(at).project(x)).collect();
        let places = PointSet::try_new(places, Unit::Pixel).unwrap();
        release(scheme, &Original::within(places, image).unwrap(), at as u64)
    };
    let views: Vec<Hidden<2>> = (0..n).map(view).collect();
    let query = |(at, view): (usize, &Hidden<2>)| Query {
        released: view.released.clone(),
        camera: camera(at),
    };
    Sequence { queries: views.iter().enumerate().map(query).collect(), views }
}

impl Sequence {
    fn solve(&self, links: &Links, query: usize) -> (sequence::Solved, Vec<f64>) {
        let solved = sequence::recover(&self.queries, links, query, 0..self.queries.len()).unwrap();
        let Hidden { original, secret, .. } = &self.views[query];
        let errors = evaluate(&solved.recovered, original, secret).unwrap().errors().to_vec();
        (solved, errors)
    }

    fn links(&self) -> Links {
        Links::by_descriptors(&self.queries, self.queries.len()).unwrap()
    }
}

#[test]
fn views_with_known_poses_give_keypoints_back() {
    // Three planes meet in a point. Of permuted keypoints a fourth view tells which.
    for (name, views) in [("lines2d", [3, 5, 10]), ("cp2d", [4, 6, 10]), ("dcl2d", [3, 5, 10])] {
        for n in views {
            let sequence = sequence(name, n);
            let (solved, errors) = sequence.solve(&sequence.links(), 1);
            // Convergent lines give back what their condition says.
            let is_fixed = |(_, by): &(f64, f64)| name != "dcl2d" || *by < 1000.0;
            let all = errors.into_iter().zip(solved.condition);
            let (fixed, open): (Vec<_>, Vec<_>) = all.partition(is_fixed);
            assert!(fixed.len() > 9 * open.len(), "{name}, {n} queries: {}", open.len());
            for (error, condition) in fixed {
                assert!(error < 0.1, "{name}, {n} queries: {error} px, condition {condition}");
            }
        }
    }
    let two = sequence("lines2d", 2);
    let (_, errors) = two.solve(&two.links(), 1);
    assert!(errors.iter().all(|error| error.is_infinite()), "two queries give nothing back");
}

#[test]
fn a_wrong_link_among_six_is_outvoted() {
    let sequence = sequence("lines2d", 6);
    let n = sequence.views[0].original.len();
    // Each query but the first links every sixth point to the next such point.
    let linked = |query: usize, at: usize| match query > 0 && (at + query).is_multiple_of(6) {
        true => (at + 6) % n,
        false => at,
    };
    let slot = |query: usize, point: usize| {
        let hidden = sequence.views[query].secret.hidden();
        hidden.iter().position(|id| id.index() == point).unwrap()
    };
    let link = |query, at| (query as u32, slot(query, linked(query, at)) as u32);
    let track = |at: usize| (0..6).map(|query| link(query, at)).collect();
    let (solved, errors) = sequence.solve(&Links::of_tracks((0..n).map(track)), 0);
    assert!(solved.noise_px < 1.5, "{}", solved.noise_px);
    // A wrong line that passes nearby still pulls a little.
    assert!(errors.iter().all(|error| *error < 2.0), "{errors:?}");
}

#[test]
fn queries_without_descriptors_are_refused() {
    let mut three = sequence("lines2d", 3).queries;
    three[2].released = released_of(&three[2].released, three[2].released.obfuscation().clone());
    let error = Links::by_descriptors(&three, 3).unwrap_err().to_string();
    assert_eq!(error, "query 2: expected descriptors, found none");
    let error = sequence::recover(&three, &Links::default(), 0, 0..4).unwrap_err().to_string();
    assert_eq!(error, "sequence: expected 3 queries, found query 0, window 0..4");
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let original = original(points());
    let [a, b] = [("ppl", 1), ("olc", 2)].map(|(name, at)| release(name, &original, at).released);
    let queries = sequence("cp2d", 6);
    let with = |n: usize| {
        let work = || {
            let maps = [by_descriptors, by_geometry].map(|by| by(&a, &b).unwrap().recovered);
            (maps, queries.solve(&queries.links(), 1).0.recovered)
        };
        on_threads(n, work)
    };
    assert!(with(1) == with(3));
}
