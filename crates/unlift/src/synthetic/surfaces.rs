//! Textured surfaces of a scene, and boxes that occlude them.

use crate::geometry::frame::Bounds;
use crate::geometry::vector::{along, cross, dot, sub};

/// Position and rotation of a piece: right along a wall (x), into the room (y), up (z).
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) origin: [f64; 3],
    pub(super) turn: Turn,
}

impl Place {
    /// Converts a point of the piece to the room's frame.
    fn point(&self, p: [f64; 3]) -> [f64; 3] {
        add(self.origin, rotate(self.turn, p))
    }
}

/// Visible faces of a box; the number is that of the first faces in the order of [`Piece::shell`].
#[derive(Clone, Copy, Debug)]
pub(super) enum Faces {
    /// Front and top, for objects side by side.
    FrontAndTop = 2,
    /// All but the bottom.
    Standing = 5,
    All = 6,
}

/// Surfaces and occluding boxes of a room with a corner at the origin, parallel to the axes.
#[derive(Clone, Debug)]
pub(super) struct Scene {
    /// Length, width and height in meters.
    pub(super) size: [f64; 3],
    pub(super) surfaces: Vec<Surface>,
    /// Occluding boxes, each in the frame of its place.
    blockers: Vec<(Place, Bounds<3>)>,
}

impl Scene {
    pub(super) fn new(size: [f64; 3]) -> Self {
        Self { size, surfaces: Vec::new(), blockers: Vec::new() }
    }

    pub(super) fn at(&mut self, place: Place) -> Piece<'_> {
        Piece { scene: self, place }
    }

    /// Returns true if a box occludes `point` from `camera`.
    pub(super) fn hides(&self, camera: &[f64; 3], point: &[f64; 3]) -> bool {
        // The segment ends 1 cm before the point, so that a surface does not occlude itself.
        let ray = sub(camera, point);
        let to = along(point, 0.01 / norm(&ray), &ray);
        self.blockers.iter().any(|(place, bounds)| {
            let back = [place.turn[0], -place.turn[1]];
            let start = rotate(back, sub(camera, &place.origin));
            let range = bounds.clip(&start, &rotate(back, sub(&to, camera)));
            range.is_some_and(|(enter, leave)| enter.max(0.0) <= leave.min(1.0))
        })
    }
}

/// A place in a scene, at which surfaces are added.
pub(super) struct Piece<'a> {
    scene: &'a mut Scene,
    place: Place,
}

impl Piece<'_> {
    /// Returns the piece at `offset` in this one, rotated further by `turn`.
    pub(super) fn turned(&mut self, offset: [f64; 3], turn: Turn) -> Piece<'_> {
        let ([a, b], [c, d]) = (self.place.turn, turn);
        let turn = [a * c - b * d, b * c + a * d];
        Piece { place: Place { origin: self.place.point(offset), turn }, scene: self.scene }
    }

    /// Returns the piece at `offset` in this one.
    pub(super) fn at(&mut self, offset: [f64; 3]) -> Piece<'_> {
        self.turned(offset, [1.0, 0.0])
    }

    /// Adds a parallelogram with a corner and two sides, visible from the side of `u x v`.
    pub(super) fn sheet(&mut self, corner: [f64; 3], u: [f64; 3], v: [f64; 3], texture: Texture) {
        let place = &self.place;
        let (corner, u, v) = (place.point(corner), rotate(place.turn, u), rotate(place.turn, v));
        self.scene.surfaces.push(Surface { corner, u, v, is_ellipse: false, texture });
    }

    /// Adds a level square of half side `radius` around `middle`, of which only the inscribed circle is there.
    pub(super) fn disc(&mut self, middle: [f64; 3], radius: f64, texture: Texture) {
        let (u, v) = ([2.0 * radius, 0.0, 0.0], [0.0, 2.0 * radius, 0.0]);
        self.sheet(add(middle, [-radius, -radius, 0.0]), u, v, texture);
        self.scene.surfaces.last_mut().expect("a sheet").is_ellipse = true;
    }

    /// Adds a solid box between two corners that occludes what is behind it.
    pub(super) fn block(&mut self, low: [f64; 3], high: [f64; 3], faces: Faces, texture: Texture) {
        self.shell(low, high, faces, texture);
        self.occlude(low, high);
    }

    fn occlude(&mut self, low: [f64; 3], high: [f64; 3]) {
        self.scene.blockers.push((self.place, Bounds { low, high }));
    }

    /// Adds the faces of a box that occludes almost nothing.
    pub(super) fn shell(&mut self, low: [f64; 3], high: [f64; 3], faces: Faces, texture: Texture) {
        let [w, d, h] = sub(&high, &low);
        let (x, y, z) = ([w, 0.0, 0.0], [0.0, d, 0.0], [0.0, 0.0, h]);
        let (right, front, top) = (add(low, x), add(low, y), add(low, z));
        let all =
            [(front, z, x), (top, x, y), (low, x, z), (low, z, y), (right, y, z), (low, y, x)];
        for &(corner, u, v) in &all[..faces as usize] {
            self.sheet(corner, u, v, texture);
        }
    }

    /// Adds an upright tube of twelve sides with radii at the foot (`middle`) and at the top.
    pub(super) fn tube(
        &mut self,
        middle: [f64; 3],
        [radius, top_radius]: [f64; 2],
        height: f64,
        texture: Texture,
    ) {
        // 2 - sqrt(3) is the tangent of 15 degrees, half of a twelfth of a turn.
        let step = turn(2.0 - 3.0f64.sqrt());
        // Edges between the twelve sides are not visible edges of the object.
        let side = Texture { outline: texture.outline / 8.0, ..texture };
        let widening = (top_radius - radius) * 0.5;
        let mut from = [1.0, 0.0, 0.0];
        for _ in 0..12 {
            let to = rotate(step, from);
            let [foot, next] = [from, to].map(|p| add(middle, scale(p, radius)));
            let lean = [widening * (from[0] + to[0]), widening * (from[1] + to[1]), height];
            self.sheet(foot, sub(&next, &foot), lean, side);
            from = to;
        }
        self.disc(add(middle, [0.0, 0.0, height]), top_radius, texture);
        // A box inside the tube is a sufficient occluder.
        let inner = 0.7 * radius.max(top_radius);
        self.occlude(add(middle, [-inner, -inner, 0.0]), add(middle, [inner, inner, height]));
    }
}

/// Relative density of the features that a detector finds on a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texture {
    /// Points per square meter, everywhere.
    pub(super) even: f64,
    /// Points per meter of outline.
    pub(super) outline: f64,
    /// Patches (stains, prints, knots) per square meter.
    pub(super) patches: f64,
    /// Points per patch.
    pub(super) per_patch: f64,
    /// Standard deviation of a patch, in meters.
    pub(super) patch_radius: f64,
}

const fn texture([even, outline, patches, per_patch, patch_radius]: [f64; 5]) -> Texture {
    Texture { even, outline, patches, per_patch, patch_radius }
}

pub(super) const PAINT: Texture = texture([1.5, 2.5, 0.4, 16.0, 0.03]);
pub(super) const SMOOTH: Texture = texture([10.0, 18.0, 1.5, 22.0, 0.025]);
pub(super) const WOOD: Texture = texture([22.0, 24.0, 7.0, 36.0, 0.03]);
pub(super) const FLOOR: Texture = texture([5.0, 3.0, 1.5, 24.0, 0.04]);
pub(super) const FABRIC: Texture = texture([45.0, 14.0, 8.0, 50.0, 0.035]);
pub(super) const PATTERN: Texture = texture([150.0, 50.0, 26.0, 80.0, 0.035]);
pub(super) const PRINT: Texture = texture([2_100.0, 70.0, 150.0, 26.0, 0.016]);
pub(super) const LEAVES: Texture = texture([2_000.0, 150.0, 0.0, 0.0, 0.02]);
pub(super) const GLASS: Texture = texture([6.0, 60.0, 0.0, 0.0, 0.02]);

/// Flat surface, visible from the side of its normal `u x v`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    pub(super) corner: [f64; 3],
    pub(super) u: [f64; 3],
    pub(super) v: [f64; 3],
    /// True if only the ellipse is there that touches the middle of each edge.
    is_ellipse: bool,
    pub(super) texture: Texture,
}

impl Surface {
    /// Returns the point at `(s, t)`, both 0 to 1.
    pub(super) fn at(&self, s: f64, t: f64) -> [f64; 3] {
        add(self.corner, along(&scale(self.u, s), t, &self.v))
    }

    /// Returns true if `(s, t)` lies on the surface.
    pub(super) fn holds(&self, s: f64, t: f64) -> bool {
        let (x, y) = (2.0 * s - 1.0, 2.0 * t - 1.0);
        let within = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
        if self.is_ellipse { x * x + y * y <= 1.0 } else { within }
    }

    pub(super) fn normal(&self) -> [f64; 3] {
        let n = cross(&self.u, &self.v);
        scale(n, 1.0 / norm(&n))
    }

    /// Returns the area in square meters.
    pub(super) fn area(&self) -> f64 {
        let full = norm(&cross(&self.u, &self.v));
        // pi / 4; three digits are enough for a density.
        if self.is_ellipse { 0.785 * full } else { full }
    }
}

/// Cosine and sine of a rotation about `z`.
pub(super) type Turn = [f64; 2];

/// Returns the rotation whose half angle has the tangent `t`: the same bits on all platforms.
pub(super) fn turn(t: f64) -> Turn {
    let norm = 1.0 + t * t;
    [(1.0 - t * t) / norm, 2.0 * t / norm]
}

pub(super) fn rotate([cos, sin]: Turn, v: [f64; 3]) -> [f64; 3] {
    [cos * v[0] - sin * v[1], sin * v[0] + cos * v[1], v[2]]
}

pub(super) fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    along(&a, 1.0, &b)
}

pub(super) fn scale(a: [f64; 3], s: f64) -> [f64; 3] {
    a.map(|x| x * s)
}

/// Returns the length.
pub(super) fn norm(a: &[f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
