//! Sampling of surface points with the noise and the outliers of structure from motion.

use super::surfaces::{Scene, Surface, add, norm, scale};
use super::{Purpose, draws};
use crate::geometry::vector::{along, dot, sub};
use crate::seed::Draws;

/// Share of points that are exact copies of another point.
const COINCIDENT_SHARE: f64 = 0.03;

/// Share of points that lie far from any surface.
const OUTLIER_SHARE: f64 = 0.015;

/// Minimum number of photos that see a point.
const MIN_VIEWS: usize = 2;

/// Maximum number of tries per point. If all fail, the scene has a bug.
const MOST_TRIES: usize = 10_000;

/// Returns `n` points in random order: copies, outliers, and points on surfaces.
pub(super) fn points(seed: u64, n: usize, scene: &Scene, cameras: &[Camera]) -> Vec<[f64; 3]> {
    let share = |share: f64| (n as f64 * share).round() as usize;
    let (n_copies, n_outliers) = (share(COINCIDENT_SHARE), share(OUTLIER_SHARE));
    let sources = sources(seed, scene);
    let mut points: Vec<[f64; 3]> = (0..n - n_copies)
        .map(|i| {
            let mut draws = draws(seed, Purpose::FirstPoint, i);
            let seen = seen_point(&sources, scene, cameras, &mut draws);
            if i < n_outliers { outlier(seen, scene, &mut draws) } else { noisy(seen, &mut draws) }
        })
        .collect();
    let order = draws(seed, Purpose::Copies, 0).permutation(points.len());
    order[..n_copies].iter().for_each(|&of| points.push(points[of as usize]));
    draws(seed, Purpose::Order, 0).shuffle(&mut points);
    points
}

/// A true surface point, and the center of a photo that sees it.
struct Seen {
    point: [f64; 3],
    camera: [f64; 3],
}

/// Adds triangulation error, quadratic in the distance along the viewing ray, linear across it.
fn noisy(seen: Seen, draws: &mut Draws) -> [f64; 3] {
    let ray = sub(&seen.point, &seen.camera);
    let distance = norm(&ray);
    let bad = if draws.unit() < 0.1 { 3.5 } else { 1.0 };
    let across = bad * (0.0006 + 0.0005 * distance);
    let in_depth = bad * (0.0008 + 0.0010 * distance * distance);
    let depth = scale(ray, draws.normal() * in_depth / distance);
    let jitter = std::array::from_fn(|_| draws.normal() * across);
    add(seen.point, add(depth, jitter))
}

/// Returns a wrong match: beyond the room on a viewing ray, or anywhere within several rooms.
fn outlier(seen: Seen, scene: &Scene, draws: &mut Draws) -> [f64; 3] {
    if draws.unit() < 0.6 {
        let ray = sub(&seen.point, &seen.camera);
        // 1 / u has a heavy tail, like depths from nearly parallel rays.
        let stretch = 1.8 / draws.between(0.3, 1.0);
        let reach = 1.0 + scene.size[0] * (0.3 + stretch) / norm(&ray);
        return along(&seen.camera, reach, &ray);
    }
    std::array::from_fn(|c| scene.size[c] * (0.5 + draws.between(-2.5, 2.5)))
}

/// A source of points: a surface, its outline, or a textured patch.
struct Source<'a> {
    surface: &'a Surface,
    kind: Kind,
    /// Sum of weights up to and including this source.
    cumulated: f64,
}

enum Kind {
    Even,
    Outline,
    Patch { s: f64, t: f64, radius: f64 },
}

fn sources(seed: u64, scene: &Scene) -> Vec<Source<'_>> {
    let (mut sources, mut cumulated) = (Vec::new(), 0.0);
    let mut draws = draws(seed, Purpose::Texture, 0);
    for surface in &scene.surfaces {
        let mut push = |kind, weight| {
            cumulated += weight;
            sources.push(Source { surface, kind, cumulated });
        };
        let (texture, area) = (surface.texture, surface.area());
        let around = 2.0 * (norm(&surface.u) + norm(&surface.v));
        // Contrast varies between surfaces.
        let contrast = 0.3 + 2.0 * draws.unit() * draws.unit();
        push(Kind::Even, contrast * texture.even * area);
        push(Kind::Outline, contrast * texture.outline * around);
        let n_patches = texture.patches * area + draws.unit();
        for _ in 0..n_patches as usize {
            let weight = contrast * texture.per_patch * draws.between(0.3, 1.7);
            let radius = texture.patch_radius * draws.between(0.5, 1.5);
            push(Kind::Patch { s: draws.unit(), t: draws.unit(), radius }, weight);
        }
    }
    sources
}

/// Returns a visible surface point. The probability grows with the number of photos that see it.
fn seen_point(
    sources: &[Source<'_>],
    scene: &Scene,
    cameras: &[Camera],
    draws: &mut Draws,
) -> Seen {
    let total = sources.last().map_or(0.0, |s| s.cumulated);
    for _ in 0..MOST_TRIES {
        let at = draws.unit() * total;
        let Source { surface, kind, .. } = &sources[sources.partition_point(|s| s.cumulated <= at)];
        let (s, t) = match kind {
            Kind::Even => (draws.unit(), draws.unit()),
            Kind::Outline => on_outline(norm(&surface.u), norm(&surface.v), draws),
            Kind::Patch { s, t, radius } => (
                s + draws.normal() * radius / norm(&surface.u),
                t + draws.normal() * radius / norm(&surface.v),
            ),
        };
        if !surface.holds(s, t) {
            continue;
        }
        let point = surface.at(s, t);
        let first = draws.below(cameras.len() as u64) as usize;
        if let Some((n_views, camera)) = views(scene, cameras, surface, &point, first)
            && n_views >= MIN_VIEWS
            && draws.unit() * (MANY_VIEWS as f64) < n_views as f64
        {
            return Seen { point, camera };
        }
    }
    panic!("a furnished room has surfaces that are seen");
}

/// Returns a random `(s, t)` within some millimeters of the outline of sides `u` and `v`.
fn on_outline(u: f64, v: f64, draws: &mut Draws) -> (f64, f64) {
    let inset = draws.unit() * draws.unit() * 0.012;
    let far = draws.unit() < 0.5;
    let edge = |side: f64| {
        let share = (inset / side).min(0.5);
        if far { 1.0 - share } else { share }
    };
    if draws.unit() * (u + v) < u { (draws.unit(), edge(v)) } else { (edge(u), draws.unit()) }
}

/// Camera of a photo, in meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Center of projection.
    pub center: [f64; 3],
    /// Viewing direction, of unit length.
    pub look: [f64; 3],
}

const N_CAMERAS: usize = 72;

/// Cosine of half the field of view (about 35 degrees).
const HALF_FIELD_COSINE: f64 = 0.82;

/// Minimum cosine between viewing ray and normal for features to be found.
const FLATTEST_COSINE: f64 = 0.22;

/// Maximum number of candidate photos that are tested per point.
const MOST_CANDIDATES: usize = 16;

/// Number of views from which on more make no difference.
const MANY_VIEWS: usize = 6;

/// Returns a closed walk around the middle of the room.
pub(super) fn walk(seed: u64, scene: &Scene) -> Vec<Camera> {
    let mut draws = draws(seed, Purpose::Walk, 0);
    let [length, width, _] = scene.size;
    let middle = [0.5 * length, 0.5 * width];
    let (along, across) = (0.5 * length - 1.0, 0.5 * width - 0.75);
    (0..N_CAMERAS)
        .map(|i| {
            let [x, y] = on_square(i as f64 / N_CAMERAS as f64);
            let center = [
                middle[0] + along * x + draws.between(-0.12, 0.12),
                middle[1] + across * y + draws.between(-0.12, 0.12),
                draws.between(1.25, 1.75),
            ];
            // Two of three photos look across the room, the third at the nearest wall.
            let sign = if i % 3 == 2 { 1.0 } else { -1.0 };
            let aim = [
                sign * x * length + draws.between(-1.5, 1.5),
                sign * y * width + draws.between(-1.5, 1.5),
                draws.between(-0.9, 0.35),
            ];
            let look = [aim[0], aim[1], aim[2] * norm(&[aim[0], aim[1], 0.0])];
            Camera { center, look: scale(look, 1.0 / norm(&look)) }
        })
        .collect()
}

/// Returns the point at share `t` of the way around the square of half side 1.
fn on_square(t: f64) -> [f64; 2] {
    let side = t * 4.0;
    let at = 2.0 * (side - side.floor()) - 1.0;
    match side as usize {
        0 => [at, -1.0],
        1 => [1.0, at],
        2 => [-at, 1.0],
        _ => [-1.0, -at],
    }
}

/// Returns the number of photos that see `point` on `surface`, at most [`MANY_VIEWS`], and the center
/// of the first one. Candidates start at photo `first` and follow the walk.
fn views(
    scene: &Scene,
    cameras: &[Camera],
    surface: &Surface,
    point: &[f64; 3],
    first: usize,
) -> Option<(usize, [f64; 3])> {
    let normal = surface.normal();
    let faces = |camera: &&Camera| {
        let ray = sub(point, &camera.center);
        let distance = norm(&ray);
        dot(&ray, &camera.look) >= HALF_FIELD_COSINE * distance
            && -dot(&ray, &normal) >= FLATTEST_COSINE * distance
    };
    let in_order = cameras[first..].iter().chain(&cameras[..first]);
    let candidates = in_order.filter(faces).take(MOST_CANDIDATES);
    let mut views =
        candidates.filter(|camera| !scene.hides(&camera.center, point)).take(MANY_VIEWS);
    let center = views.next()?.center;
    Some((1 + views.count(), center))
}
