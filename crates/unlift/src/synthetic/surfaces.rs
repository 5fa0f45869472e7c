//! Textured surfaces of a scene, and boxes that occlude them.

use crate::geometry::frame::Bounds;
use crate::geometry::vector::{along, cross, dot, sub};

/// Position and rotation of a piece. Its axes are: right along a wall (x), into the room (y), up
/// (z).
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

#[derive(Clone, Copy, Debug)]
struct Blocker {
    place: Place,
    bounds: Bounds<3>,
}

impl Blocker {
    /// Returns true if the segment from `from` to `to` intersects the box.
    fn blocks(&self, from: &[f64; 3], to: &[f64; 3]) -> bool {
        let back = [self.place.turn[0], -self.place.turn[1]];
        let start = rotate(back, sub(from, &self.place.origin));
        let range = self.bounds.clip(&start, &rotate(back, sub(to, from)));
        range.is_some_and(|(enter, leave)| enter.max(0.0) <= leave.min(1.0))
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Faces {
    /// All but the bottom.
    Standing,
    /// All six.
    All,
    /// Front and top, for objects side by side.
    FrontAndTop,
}

/// Surfaces and occluding boxes of a room. Its corner is the origin, and its walls are parallel to
/// the axes.
#[derive(Clone, Debug)]
pub(super) struct Scene {
    /// Length, width and height in meters.
    pub(super) size: [f64; 3],
    pub(super) surfaces: Vec<Surface>,
    blockers: Vec<Blocker>,
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
        self.blockers.iter().any(|b| b.blocks(camera, &to))
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
        self.face([corner, u, v], Outline::Full, texture);
    }

    pub(super) fn face(
        &mut self,
        [corner, u, v]: [[f64; 3]; 3],
        outline: Outline,
        texture: Texture,
    ) {
        let place = &self.place;
        let (corner, u, v) = (place.point(corner), rotate(place.turn, u), rotate(place.turn, v));
        self.scene.surfaces.push(Surface { corner, u, v, outline, texture });
    }

    /// Adds a solid box between two corners that occludes what is behind it.
    pub(super) fn block(&mut self, low: [f64; 3], high: [f64; 3], faces: Faces, texture: Texture) {
        self.shell(low, high, faces, texture);
        self.occlude(low, high);
    }

    fn occlude(&mut self, low: [f64; 3], high: [f64; 3]) {
        self.scene.blockers.push(Blocker { place: self.place, bounds: Bounds { low, high } });
    }

    /// Adds the faces of a box that occludes almost nothing.
    pub(super) fn shell(&mut self, low: [f64; 3], high: [f64; 3], faces: Faces, texture: Texture) {
        let [w, d, h] = sub(&high, &low);
        let (x, y, z) = ([w, 0.0, 0.0], [0.0, d, 0.0], [0.0, 0.0, h]);
        let (right, front, top) = (add(low, x), add(low, y), add(low, z));
        self.sheet(front, z, x, texture);
        self.sheet(top, x, y, texture);
        if faces != Faces::FrontAndTop {
            self.sheet(low, x, z, texture);
            self.sheet(low, z, y, texture);
            self.sheet(right, y, z, texture);
        }
        if faces == Faces::All {
            self.sheet(low, y, x, texture);
        }
    }

    /// Adds an upright tube of twelve sides around `middle` (of its foot), with two radii, at the
    /// foot and at the top.
    pub(super) fn tube(
        &mut self,
        middle: [f64; 3],
        [radius, top_radius]: [f64; 2],
        height: f64,
        texture: Texture,
    ) {
        let mut on_circle = [[1.0, 0.0]; 13];
        // 2 - sqrt(3) is the tangent of 15 degrees, half of a twelfth of a turn.
        let step = turn(2.0 - 3.0f64.sqrt());
        for i in 1..13 {
            let [x, y, _] = rotate(step, [on_circle[i - 1][0], on_circle[i - 1][1], 0.0]);
            on_circle[i] = [x, y];
        }
        // Edges between the twelve sides are not visible edges of the object.
        let side = Texture { outline: texture.outline / 8.0, ..texture };
        for pair in on_circle.windows(2) {
            let foot = |p: [f64; 2]| add(middle, [radius * p[0], radius * p[1], 0.0]);
            let lean = [
                (top_radius - radius) * 0.5 * (pair[0][0] + pair[1][0]),
                (top_radius - radius) * 0.5 * (pair[0][1] + pair[1][1]),
                height,
            ];
            let (from, to) = (foot(pair[0]), foot(pair[1]));
            self.sheet(from, sub(&to, &from), lean, side);
        }
        let corner = add(middle, [-top_radius, -top_radius, height]);
        let (u, v) = ([2.0 * top_radius, 0.0, 0.0], [0.0, 2.0 * top_radius, 0.0]);
        self.face([corner, u, v], Outline::Ellipse, texture);
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

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Outline {
    /// Whole parallelogram.
    Full,
    /// Ellipse that touches the middle of each edge.
    Ellipse,
}

/// Flat surface, visible from the side of its normal `u x v`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    pub(super) corner: [f64; 3],
    pub(super) u: [f64; 3],
    pub(super) v: [f64; 3],
    pub(super) outline: Outline,
    pub(super) texture: Texture,
}

impl Surface {
    /// Returns the point at `(s, t)`, both 0 to 1.
    pub(super) fn at(&self, s: f64, t: f64) -> [f64; 3] {
        add(self.corner, along(&scale(self.u, s), t, &self.v))
    }

    /// Returns true if `(s, t)` lies on the surface.
    pub(super) fn holds(&self, s: f64, t: f64) -> bool {
        let within = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
        match self.outline {
            Outline::Full => within,
            Outline::Ellipse => {
                let (x, y) = (2.0 * s - 1.0, 2.0 * t - 1.0);
                x * x + y * y <= 1.0
            }
        }
    }

    pub(super) fn normal(&self) -> [f64; 3] {
        let n = cross(&self.u, &self.v);
        scale(n, 1.0 / norm(&n))
    }

    /// Returns the area in square meters.
    pub(super) fn area(&self) -> f64 {
        let full = norm(&cross(&self.u, &self.v));
        match self.outline {
            Outline::Full => full,
            // pi / 4; three digits are enough for a density.
            Outline::Ellipse => 0.785 * full,
        }
    }
}

/// Cosine and sine of a rotation about `z`.
pub(super) type Turn = [f64; 2];

/// Returns the rotation whose half angle has the tangent `t`. `sin` and `cos` differ between
/// platforms, this does not.
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
