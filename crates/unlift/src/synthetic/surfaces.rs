//! Textured surfaces of a scene, and boxes that occlude them.

use super::texture::{Outline, Surface, Texture};
use super::vectors::{Turn, add, norm, rotate, scale, sub, turn};

/// Position and rotation of a piece. Its axes are: right along a wall (x), into the room (y), up
/// (z).
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) origin: [f64; 3],
    pub(super) turn: Turn,
}

impl Place {
    /// Returns the place at `offset` in this one, rotated further by `turn`.
    pub(super) fn then(&self, offset: [f64; 3], turn: Turn) -> Self {
        let ([a, b], [c, d]) = (self.turn, turn);
        Self { origin: self.point(offset), turn: [a * c - b * d, b * c + a * d] }
    }

    /// Converts a point of the piece to the room's frame.
    pub(super) fn point(&self, p: [f64; 3]) -> [f64; 3] {
        add(self.origin, rotate(self.turn, p))
    }

    /// Converts a direction of the piece to the room's frame.
    pub(super) fn direction(&self, v: [f64; 3]) -> [f64; 3] {
        rotate(self.turn, v)
    }
}

#[derive(Clone, Copy, Debug)]
struct Blocker {
    place: Place,
    low: [f64; 3],
    high: [f64; 3],
}

impl Blocker {
    /// Returns true if the segment from `from` to `to` intersects the box.
    fn blocks(&self, from: [f64; 3], to: [f64; 3]) -> bool {
        let back = [self.place.turn[0], -self.place.turn[1]];
        let start = rotate(back, sub(from, self.place.origin));
        let along = rotate(back, sub(to, from));
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for c in 0..3 {
            if along[c] == 0.0 {
                if start[c] < self.low[c] || start[c] > self.high[c] {
                    return false;
                }
                continue;
            }
            let one = (self.low[c] - start[c]) / along[c];
            let other = (self.high[c] - start[c]) / along[c];
            enter = enter.max(one.min(other));
            leave = leave.min(one.max(other));
        }
        enter <= leave
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

    /// Returns true if a box occludes `point` from `camera`.
    pub(super) fn hides(&self, camera: [f64; 3], point: [f64; 3]) -> bool {
        // The segment ends 1 cm before the point, so that a surface does not occlude itself.
        let ray = sub(camera, point);
        let to = add(point, scale(ray, 0.01 / norm(ray)));
        self.blockers.iter().any(|b| b.blocks(camera, to))
    }

    /// Adds a parallelogram at `corner` of `place`, visible from the side of `u x v`.
    pub(super) fn sheet(
        &mut self,
        place: &Place,
        corner: [f64; 3],
        u: [f64; 3],
        v: [f64; 3],
        texture: Texture,
    ) {
        self.outlined(place, corner, u, v, Outline::Full, texture);
    }

    pub(super) fn outlined(
        &mut self,
        place: &Place,
        corner: [f64; 3],
        u: [f64; 3],
        v: [f64; 3],
        outline: Outline,
        texture: Texture,
    ) {
        self.face(place, [corner, u, v], outline, texture);
    }

    /// Adds a surface with a corner and two sides.
    fn face(
        &mut self,
        place: &Place,
        [corner, u, v]: [[f64; 3]; 3],
        outline: Outline,
        texture: Texture,
    ) {
        self.surfaces.push(Surface {
            corner: place.point(corner),
            u: place.direction(u),
            v: place.direction(v),
            outline,
            texture,
        });
    }

    /// Adds a solid box between two corners that occludes what is behind it.
    pub(super) fn block(
        &mut self,
        place: &Place,
        low: [f64; 3],
        high: [f64; 3],
        faces: Faces,
        texture: Texture,
    ) {
        self.shell(place, low, high, faces, texture);
        self.blockers.push(Blocker { place: *place, low, high });
    }

    /// Adds the faces of a box that occludes almost nothing.
    pub(super) fn shell(
        &mut self,
        place: &Place,
        low: [f64; 3],
        high: [f64; 3],
        faces: Faces,
        texture: Texture,
    ) {
        let [w, d, h] = sub(high, low);
        let (x, y, z) = ([w, 0.0, 0.0], [0.0, d, 0.0], [0.0, 0.0, h]);
        let (right, front, top) = (add(low, x), add(low, y), add(low, z));
        let mut add = |sides| self.face(place, sides, Outline::Full, texture);
        add([front, z, x]);
        add([top, x, y]);
        if faces != Faces::FrontAndTop {
            add([low, x, z]);
            add([low, z, y]);
            add([right, y, z]);
        }
        if faces == Faces::All {
            add([low, y, x]);
        }
    }

    /// Adds an upright tube of twelve sides around `middle` (of its foot), with `radius` at the
    /// foot and `top_radius` at the top.
    pub(super) fn tube(
        &mut self,
        place: &Place,
        middle: [f64; 3],
        radius: f64,
        top_radius: f64,
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
            let u = sub(foot(pair[1]), foot(pair[0]));
            self.face(place, [foot(pair[0]), u, lean], Outline::Full, side);
        }
        let corner = add(middle, [-top_radius, -top_radius, height]);
        let (u, v) = ([2.0 * top_radius, 0.0, 0.0], [0.0, 2.0 * top_radius, 0.0]);
        self.face(place, [corner, u, v], Outline::Ellipse, texture);
        // A box inside the tube is a sufficient occluder.
        let inner = 0.7 * radius.max(top_radius);
        self.blockers.push(Blocker {
            place: *place,
            low: sub(middle, [inner, inner, 0.0]),
            high: add(middle, [inner, inner, height]),
        });
    }
}
