//! Cameras on a walk through the room, and their views of surface points.

use super::purpose::{Purpose, draws};
use super::surfaces::Scene;
use super::texture::Surface;
use super::vectors::{dot, norm, scale, sub};

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
pub(super) const MANY_VIEWS: usize = 6;

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
            let look = [aim[0], aim[1], aim[2] * norm([aim[0], aim[1], 0.0])];
            Camera { center, look: scale(look, 1.0 / norm(look)) }
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

/// Views of a point: their number, and the center of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Track {
    /// Number of photos among the candidates that see the point, at most [`MANY_VIEWS`].
    pub(super) n_views: usize,
    /// Center of the first photo that sees the point.
    pub(super) center: [f64; 3],
}

/// Finds the views of `point` on `surface`. Candidates start at photo `first` and follow the walk.
pub(super) fn track(
    scene: &Scene,
    cameras: &[Camera],
    surface: &Surface,
    point: [f64; 3],
    first: usize,
) -> Option<Track> {
    let normal = surface.normal();
    let mut track: Option<Track> = None;
    let mut candidates = 0;
    for i in 0..cameras.len() {
        let camera = &cameras[(first + i) % cameras.len()];
        let ray = sub(point, camera.center);
        let distance = norm(ray);
        if dot(ray, camera.look) < HALF_FIELD_COSINE * distance
            || -dot(ray, normal) < FLATTEST_COSINE * distance
        {
            continue;
        }
        candidates += 1;
        if candidates > MOST_CANDIDATES {
            break;
        }
        if !scene.hides(camera.center, point) {
            let n_views = track.map_or(0, |t| t.n_views) + 1;
            let center = track.map_or(camera.center, |t| t.center);
            track = Some(Track { n_views, center });
            if n_views == MANY_VIEWS {
                break;
            }
        }
    }
    track
}
