//! Laws of recovery from a sequence of queries, on exact synthetic tracks.

use unlift_attack::descriptors::Values;
use unlift_attack::geometry::frame::Bounds;
use unlift_attack::released::{AxisCandidates, Lines, Obfuscation, Rays, Released};
use unlift_attack::seed::{Draws, Stage};
use unlift_attack::sequence::{Camera, Links, Query, Solved, recover};
use unlift_attack::{Descriptors, Unit};

const SIZE: [f64; 2] = [640.0, 480.0];
const N_POINTS: usize = 150;
const DIM: usize = 32;

fn image() -> Bounds<2> {
    Bounds { low: [-0.5; 2], high: SIZE.map(|x| x - 0.5) }
}

/// Points in a box in front of cameras near the origin.
fn points() -> Vec<[f64; 3]> {
    let mut draws = Draws::new(1, Stage::Synthetic, 0);
    let mut between = |a: f64, b: f64| draws.between(a, b);
    (0..N_POINTS).map(|_| [between(-1.2, 1.2), between(-0.8, 0.8), between(3.0, 6.0)]).collect()
}

/// A camera at `center`, turned by `yaw` about the vertical and by `roll` about its axis.
fn camera(center: [f64; 3], yaw: f64, roll: f64) -> Camera {
    let ((s, c), (sr, cr)) = (yaw.sin_cos(), roll.sin_cos());
    let turned = [[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]];
    let row = |a: f64, b: f64| [0, 1, 2].map(|i| a * turned[0][i] + b * turned[1][i]);
    let rotation = [row(cr, -sr), row(sr, cr), turned[2]];
    let translation = rotation.map(|row| -(0..3).map(|i| row[i] * center[i]).sum::<f64>());
    Camera { focal: [500.0; 2], center: [319.5, 239.5], rotation, translation }
}

/// Cameras on a curve, as of a person who walks and turns.
fn cameras(n: usize) -> Vec<Camera> {
    let one = |at: usize| {
        let t = at as f64;
        let center = [0.25 * t - 0.8, 0.15 * (1.7 * t).sin(), 0.1 * (2.3 * t).cos()];
        camera(center, 0.03 * t - 0.1, 0.2 * (3.1 * t).sin())
    };
    (0..n).map(one).collect()
}

fn project(camera: &Camera, x: &[f64; 3]) -> [f64; 2] {
    let of = |row: usize| {
        let [a, b, c] = camera.rotation[row];
        a * x[0] + b * x[1] + c * x[2] + camera.translation[row]
    };
    [0, 1].map(|c| camera.focal[c] * of(c) / of(2) + camera.center[c])
}

fn descriptors() -> Descriptors {
    let mut draws = Draws::new(2, Stage::Synthetic, 0);
    let values = (0..N_POINTS * DIM).map(|_| draws.between(-1.0, 1.0) as f32).collect();
    Descriptors::try_new(Values::F32(values), DIM).unwrap()
}

/// Hides the projections of all points; record `i` hides point `i`.
fn query(scheme: &str, camera: Camera, places: &[[f64; 2]], at: u64) -> Query {
    let mut draws = Draws::new(3, Stage::Synthetic, at);
    let origin = image().center();
    let local: Vec<[f64; 2]> =
        places.iter().map(|p| [p[0] - origin[0], p[1] - origin[1]]).collect();
    let obfuscation = match scheme {
        "lines2d" => {
            let mut direction = || {
                let (sin, cos) = draws.between(0.0, std::f64::consts::PI).sin_cos();
                [cos, sin]
            };
            let directions: Vec<_> = local.iter().map(|_| direction()).collect();
            Obfuscation::Lines(Lines::through(&local, &directions).unwrap())
        }
        "cp2d" => {
            let mut swapped = local.clone();
            // Other pairs in each query: partners that stay would agree everywhere, too.
            for pair in draws.permutation(local.len()).chunks_exact(2) {
                let [a, b] = [pair[0] as usize, pair[1] as usize];
                let axis = usize::from(draws.between(0.0, 1.0) < 0.5);
                (swapped[a][axis], swapped[b][axis]) = (local[b][axis], local[a][axis]);
            }
            Obfuscation::AxisCandidates(AxisCandidates::try_new(&swapped).unwrap())
        }
        _ => {
            let half = [SIZE[0] / 2.0, SIZE[1] / 2.0];
            let anchors = [[0.0, -half[1]], [0.0, half[1]]];
            let center: Vec<u8> = local.iter().map(|p| u8::from(p[0] >= 0.0)).collect();
            let toward = |(p, &c): (&[f64; 2], &u8)| {
                let anchor = anchors[usize::from(c)];
                [p[0] - anchor[0], p[1] - anchor[1]]
            };
            let directions: Vec<_> = local.iter().zip(&center).map(toward).collect();
            let left = Bounds { low: [-half[0], -half[1]], high: [0.0, half[1]] };
            let right = Bounds { low: [0.0, -half[1]], high: half };
            let rays = Rays::try_new(&anchors, center, &directions).unwrap();
            Obfuscation::Rays(rays.with_regions(vec![left, right]).unwrap())
        }
    };
    let released = Released::try_new(obfuscation, 1, origin, Unit::Pixel, Some(descriptors()));
    Query { released: released.unwrap().with_bounds(Some(image())), camera }
}

/// The queries, the true places in each, and which points all cameras see.
struct Scene {
    queries: Vec<Query>,
    places: Vec<Vec<[f64; 2]>>,
    seen: Vec<bool>,
}

fn scene(scheme: &str, cameras: Vec<Camera>) -> Scene {
    let points = points();
    let places: Vec<Vec<[f64; 2]>> =
        cameras.iter().map(|camera| points.iter().map(|x| project(camera, x)).collect()).collect();
    let seen = (0..N_POINTS).map(|at| places.iter().all(|of| image().contains(&of[at]))).collect();
    let zipped = cameras.into_iter().zip(&places).enumerate();
    let queries = zipped.map(|(at, (camera, of))| query(scheme, camera, of, at as u64)).collect();
    Scene { queries, places, seen }
}

fn solve(scene: &Scene) -> Solved {
    let n = scene.queries.len();
    let links = Links::by_descriptors(&scene.queries, n).unwrap();
    recover(&scene.queries, &links, 1, 0..n).unwrap()
}

/// Returns (error, condition) of the points that all cameras see.
fn errors(scene: &Scene, solved: &Solved) -> Vec<(f64, f64)> {
    let error = |at: usize| {
        let [x, y] = solved.recovered.position(at).unwrap_or([f64::INFINITY; 2]);
        let [u, v] = scene.places[1][at];
        (x - u).hypot(y - v)
    };
    let seen = (0..N_POINTS).filter(|&at| scene.seen[at]);
    let errors: Vec<_> = seen.map(|at| (error(at), solved.condition[at])).collect();
    assert!(errors.len() > N_POINTS / 2, "{}", errors.len());
    errors
}

#[test]
fn three_lines_give_every_keypoint_back() {
    for n in [3, 5, 10] {
        let scene = scene("lines2d", cameras(n));
        for (error, condition) in errors(&scene, &solve(&scene)) {
            assert!(error < 0.1, "{n} queries: {error} px, condition {condition}");
        }
    }
}

#[test]
fn four_permuted_views_give_every_keypoint_back() {
    for n in [4, 6, 10] {
        let scene = scene("cp2d", cameras(n));
        let solved = solve(&scene);
        let wrong = errors(&scene, &solved).iter().filter(|(error, _)| *error >= 0.1).count();
        assert_eq!(wrong, 0, "{n} queries");
    }
}

#[test]
fn convergent_lines_give_back_what_their_condition_says() {
    for n in [3, 5, 10] {
        let scene = scene("dcl2d", cameras(n));
        let errors = errors(&scene, &solve(&scene));
        let (fixed, open): (Vec<_>, Vec<_>) = errors.iter().partition(|(_, by)| *by < 1000.0);
        assert!(fixed.len() > 9 * open.len(), "{} of {} are fixed", fixed.len(), errors.len());
        for (error, condition) in fixed {
            assert!(error < 0.1, "{n} queries: {error} px, condition {condition}");
        }
    }
}

#[test]
fn two_queries_give_nothing_back() {
    let scene = scene("lines2d", cameras(2));
    assert!((0..N_POINTS).all(|at| solve(&scene).recovered.position(at).is_none()));
}

#[test]
fn a_wrong_link_among_six_is_outvoted() {
    let scene = scene("lines2d", cameras(6));
    // Each query but the first links every sixth point to the next such point.
    let slot = |query: u32, at: u32| match query > 0 && (at + query).is_multiple_of(6) {
        true => (at + 6) % N_POINTS as u32,
        false => at,
    };
    let track = |at: u32| (0..6).map(|query| (query, slot(query, at))).collect();
    let links = Links::of_tracks([N_POINTS; 6], (0..N_POINTS as u32).map(track));
    let solved = recover(&scene.queries, &links, 0, 0..6).unwrap();
    assert!(solved.noise_px < 1.5, "{}", solved.noise_px);
    for at in (0..N_POINTS).filter(|&at| scene.seen[at]) {
        let [x, y] = solved.recovered.position(at).unwrap();
        let [u, v] = scene.places[0][at];
        // A wrong line that passes nearby still pulls a little.
        assert!((x - u).hypot(y - v) < 2.0, "point {at}");
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let scene = scene("cp2d", cameras(6));
    let with = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| solve(&scene).recovered)
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn queries_without_descriptors_are_refused() {
    let mut scene = scene("lines2d", cameras(3));
    let bare = &scene.queries[2].released;
    let lines = bare.obfuscation().clone();
    let bare = Released::try_new(lines, 1, bare.origin(), Unit::Pixel, None).unwrap();
    scene.queries[2].released = bare;
    let error = Links::by_descriptors(&scene.queries, 3).unwrap_err().to_string();
    assert_eq!(error, "query 2: expected descriptors, found none");
    let error = recover(&scene.queries, &Links::default(), 0, 0..4).unwrap_err().to_string();
    assert_eq!(error, "sequence: expected 3 queries, found query 0, window 0..4");
}
