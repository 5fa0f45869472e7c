//! Simple shapes as maps, for tests beyond rooms.
//!
//! A room consists of surfaces in all directions. A line has one dimension, a cube three; clusters
//! leave most of space empty; a lattice has neighbors at equal distances; two densities have no
//! common length scale.

use super::room;
use super::sampling::COINCIDENT_SHARE;
use crate::seed::{Draws, Stage};

/// Shape of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shape {
    /// Straight line with a little noise.
    Line,
    /// Flat square with a little noise, not parallel to the axes.
    Plane,
    /// Surface of a ball.
    Sphere,
    /// Uniform in a cube.
    Cube,
    /// Twenty clusters in a cube.
    Clusters,
    /// Two clusters with equally many points, one ten times as wide as the other.
    TwoDensities,
    /// The first points of a cubic lattice.
    Lattice,
    /// Room with 30 % of the points anywhere in a box twice as large.
    RoomWithOutliers,
    /// Room stretched to ten times its length.
    LongRoom,
    /// Room whose density falls with distance, as outdoors.
    Outdoors,
    /// Furnished room.
    Room,
}

impl Shape {
    /// All shapes.
    pub const ALL: [Self; 11] = [
        Self::Line,
        Self::Plane,
        Self::Sphere,
        Self::Cube,
        Self::Clusters,
        Self::TwoDensities,
        Self::Lattice,
        Self::RoomWithOutliers,
        Self::LongRoom,
        Self::Outdoors,
        Self::Room,
    ];

    /// Returns the name used on command lines.
    pub fn name(self) -> &'static str {
        match self {
            Self::Line => "line",
            Self::Plane => "plane",
            Self::Sphere => "sphere",
            Self::Cube => "cube",
            Self::Clusters => "clusters",
            Self::TwoDensities => "two-densities",
            Self::Lattice => "lattice",
            Self::RoomWithOutliers => "room-with-outliers",
            Self::LongRoom => "long-room",
            Self::Outdoors => "outdoors",
            Self::Room => "room",
        }
    }
}

/// Noise as a fraction of the size.
const NOISE: f64 = 0.005;

/// Returns `n` points of `shape`, with a size from about one unit to some meters.
///
/// ```
/// use unlift::synthetic::{Shape, shape};
/// assert_eq!(shape(Shape::Sphere, 0, 100).len(), 100);
/// ```
pub fn shape(shape: Shape, seed: u64, n: usize) -> Vec<[f64; 3]> {
    let of_item = |item: usize| Draws::new(seed, Stage::Shapes, item as u64);
    let points = |place: &dyn Fn(&mut Draws) -> [f64; 3]| -> Vec<[f64; 3]> {
        (0..n).map(|i| place(&mut of_item(1 + i))).collect()
    };
    match shape {
        Shape::Line => points(&|d| {
            let t = d.between(0.0, 1.0);
            noisy([t, 0.6 * t, 0.3 * t], NOISE, d)
        }),
        Shape::Plane => points(&|d| {
            let (s, t) = (d.between(0.0, 1.0), d.between(0.0, 1.0));
            noisy([s, 0.8 * t - 0.2 * s, 0.6 * t + 0.3 * s], NOISE, d)
        }),
        Shape::Sphere => points(&|d| d.direction()),
        Shape::Cube => points(&|d| std::array::from_fn(|_| d.between(0.0, 1.0))),
        Shape::Clusters => {
            let mut d = of_item(0);
            let centers: Vec<[f64; 3]> =
                (0..20).map(|_| std::array::from_fn(|_| d.between(0.0, 1.0))).collect();
            points(&|d| noisy(centers[d.below(20) as usize], 0.03, d))
        }
        Shape::TwoDensities => points(&|d| match d.below(2) {
            0 => noisy([0.0; 3], 0.03, d),
            _ => noisy([1.5, 0.5, 0.2], 0.3, d),
        }),
        Shape::Lattice => {
            let side = (1..).find(|side| side * side * side >= n).unwrap_or(1);
            let at = |i: usize| {
                [i % side, i / side % side, i / (side * side)].map(|c| c as f64 / side as f64)
            };
            (0..n).map(at).collect()
        }
        Shape::RoomWithOutliers => {
            let mut points = room(seed, n).points;
            for (i, point) in points.iter_mut().enumerate() {
                let mut d = of_item(1 + i);
                if d.unit() < 0.3 {
                    *point = [d.between(-5.0, 5.0), d.between(-4.0, 4.0), d.between(-1.3, 3.9)];
                }
            }
            points
        }
        Shape::LongRoom => {
            room(seed, n).points.into_iter().map(|[x, y, z]| [10.0 * x, y, z]).collect()
        }
        Shape::Outdoors => {
            let outward = |p: [f64; 3]| {
                let r2: f64 = p.iter().map(|x| x * x).sum();
                p.map(|x| x * (1.0 + r2))
            };
            room(seed, n).points.into_iter().map(outward).collect()
        }
        Shape::Room => room(seed, n).points,
    }
}

fn noisy(center: [f64; 3], sigma: f64, draws: &mut Draws) -> [f64; 3] {
    center.map(|x| x + sigma * draws.normal())
}

/// Returns `n` keypoints of an image of `size` pixels: some uniform, most in clusters, a few at the
/// place of another keypoint.
///
/// ```
/// let keypoints = unlift::synthetic::keypoints(0, 200, [640.0, 480.0]);
/// assert!(keypoints.iter().all(|[x, y]| (0.0..640.0).contains(x) && (0.0..480.0).contains(y)));
/// ```
pub fn keypoints(seed: u64, n: usize, size: [f64; 2]) -> Vec<[f64; 2]> {
    let mut draws = Draws::new(seed, Stage::Shapes, 0);
    let anywhere = |d: &mut Draws| size.map(|s| d.between(0.0, s));
    let clumps: Vec<([f64; 2], f64)> =
        (0..12).map(|_| (anywhere(&mut draws), draws.between(0.02, 0.12))).collect();
    let mut keypoints: Vec<[f64; 2]> = Vec::with_capacity(n);
    while keypoints.len() < n {
        let point = match draws.unit() {
            // Second keypoint at the same place.
            u if u < 4.0 * COINCIDENT_SHARE && !keypoints.is_empty() => {
                keypoints[draws.below(keypoints.len() as u64) as usize]
            }
            u if u < 0.4 => anywhere(&mut draws),
            _ => {
                let (center, width) = clumps[draws.below(12) as usize];
                center.map(|x| x + width * size[0] * draws.normal())
            }
        };
        if (0..2).all(|c| (0.0..size[c]).contains(&point[c])) {
            keypoints.push(point);
        }
    }
    keypoints
}
