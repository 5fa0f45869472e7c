//! Visible surface of each pixel of a photo.

use unlift::synthetic::Sheet;

use crate::pinhole::Pinhole;
use unlift::synthetic::vectors::{add, cross, dot, scale, sub};

/// Minimum depth in meters.
const NEAREST: f64 = 0.02;

/// Value of a pixel without a sheet.
pub(crate) const NONE: u32 = u32::MAX;

pub(crate) struct Seen {
    /// Sheet of each pixel or [`NONE`], `(height, width)`, row-major.
    pub(crate) sheets: Vec<u32>,
    /// Depth of each pixel in meters; infinite without a sheet.
    pub(crate) depths: Vec<f32>,
    pub(crate) size: [usize; 2],
}

impl Seen {
    /// Returns sheet and depth at a place in pixels. The corner of the photo is (0, 0).
    pub(crate) fn at(&self, place: [f64; 2]) -> (u32, f32) {
        let [x, y] = [0, 1].map(|c| (place[c].max(0.0) as usize).min(self.size[c] - 1));
        let at = y * self.size[0] + x;
        (self.sheets[at], self.depths[at])
    }
}

/// A sheet in the camera frame.
pub(crate) struct Facing {
    corner: [f64; 3],
    normal: [f64; 3],
    /// Vector whose dot product with a point, relative to the corner, is the point's first
    /// coordinate on the sheet.
    along_u: [f64; 3],
    along_v: [f64; 3],
    u: [f64; 3],
    v: [f64; 3],
    round: bool,
}

impl Facing {
    pub(crate) fn new(camera: &Pinhole, sheet: &Sheet) -> Self {
        let corner = camera.turned(sub(sheet.corner, camera.center));
        let [u, v] = [sheet.u, sheet.v].map(|side| camera.turned(side));
        let normal = cross(u, v);
        let (of_u, of_v) = (cross(v, normal), cross(normal, u));
        Self {
            corner,
            normal,
            along_u: scale(of_u, 1.0 / dot(u, of_u)),
            along_v: scale(of_v, 1.0 / dot(v, of_v)),
            u,
            v,
            round: sheet.round,
        }
    }

    /// Returns true if the camera is on the sheet's visible side.
    fn is_front(&self) -> bool {
        dot(self.normal, self.corner) < 0.0
    }

    /// Returns the distance along `ray` to the sheet's plane, and the coordinates on the sheet (0
    /// to 1 within it).
    pub(crate) fn hit(&self, ray: [f64; 3]) -> (f64, [f64; 2]) {
        let far = dot(self.normal, self.corner) / dot(self.normal, ray);
        let from_corner = sub(scale(ray, far), self.corner);
        (far, [dot(from_corner, self.along_u), dot(from_corner, self.along_v)])
    }

    fn holds(&self, [s, t]: [f64; 2]) -> bool {
        let within = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
        let (x, y) = (2.0 * s - 1.0, 2.0 * t - 1.0);
        within && (!self.round || x * x + y * y <= 1.0)
    }

    /// Returns the first and last column and row that the sheet may cover, if any.
    fn bounds(&self, camera: &Pinhole) -> Option<[(usize, usize); 2]> {
        let corners = [
            self.corner,
            add(self.corner, self.u),
            add(self.corner, add(self.u, self.v)),
            add(self.corner, self.v),
        ];
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut reach = |p: [f64; 3]| {
            for c in 0..2 {
                let at = p[c] / p[2] * camera.focal + 0.5 * camera.size[c] as f64;
                low[c] = low[c].min(at);
                high[c] = high[c].max(at);
            }
        };
        for (at, &corner) in corners.iter().enumerate() {
            let next = corners[(at + 1) % 4];
            if corner[2] >= NEAREST {
                reach(corner);
            }
            if (corner[2] >= NEAREST) != (next[2] >= NEAREST) {
                let share = (NEAREST - corner[2]) / (next[2] - corner[2]);
                reach(add(corner, scale(sub(next, corner), share)));
            }
        }
        let of = |c: usize| {
            let last = camera.size[c] as f64 - 1.0;
            let (low, high) = ((low[c] - 0.5).max(0.0), (high[c] + 0.5).min(last));
            (low <= high).then_some((low as usize, high as usize))
        };
        Some([of(0)?, of(1)?])
    }
}

/// Renders the sheets whose visible side faces `camera`.
pub(crate) fn seen(camera: &Pinhole, sheets: &[Sheet]) -> Seen {
    drawn(camera, sheets, Facing::is_front)
}

/// Renders all sheets, because the back of a sheet blocks light, too.
pub(crate) fn in_the_way(camera: &Pinhole, sheets: &[Sheet]) -> Seen {
    drawn(camera, sheets, |_| true)
}

fn drawn(camera: &Pinhole, sheets: &[Sheet], shown: impl Fn(&Facing) -> bool) -> Seen {
    let [width, height] = camera.size;
    let mut seen = Seen {
        sheets: vec![NONE; width * height],
        depths: vec![f32::INFINITY; width * height],
        size: camera.size,
    };
    for (index, sheet) in sheets.iter().enumerate() {
        let facing = Facing::new(camera, sheet);
        if !shown(&facing) {
            continue;
        }
        let Some([columns, rows]) = facing.bounds(camera) else { continue };
        for y in rows.0..=rows.1 {
            for x in columns.0..=columns.1 {
                let ray = camera.ray([x as f64 + 0.5, y as f64 + 0.5]);
                let (far, on) = facing.hit(ray);
                let at = y * width + x;
                if far >= NEAREST && far < f64::from(seen.depths[at]) && facing.holds(on) {
                    seen.depths[at] = far as f32;
                    seen.sheets[at] = index as u32;
                }
            }
        }
    }
    seen
}

#[cfg(test)]
mod tests {
    use unlift::synthetic::{Camera, Material};

    use super::*;

    fn sheet(x: f64, side: f64) -> Sheet {
        // A square perpendicular to x, visible from a camera that looks along x.
        let corner = [x, -0.5 * side, -0.5 * side];
        let (u, v) = ([0.0, 0.0, side], [0.0, side, 0.0]);
        Sheet { corner, u, v, round: false, material: Material::Paint, piece: 0, part: 0 }
    }

    fn camera() -> Pinhole {
        let camera = Camera { center: [0.0; 3], look: [1.0, 0.0, 0.0] };
        Pinhole::handheld(&camera, [100, 80])
    }

    #[test]
    fn the_nearest_front_is_seen() {
        // A wall, a tile before it, and the back of a tile before that.
        let mut back = sheet(1.0, 0.2);
        (back.u, back.v) = (back.v, back.u);
        let sheets = [sheet(4.0, 20.0), sheet(2.0, 0.42), back];
        let all = seen(&camera(), &sheets);
        assert!(all.sheets.iter().all(|&sheet| sheet == 0 || sheet == 1));
        assert_eq!(all.at([50.0, 40.0]), (1, 2.0));
        assert_eq!(all.at([5.0, 5.0]), (0, 4.0));
        // 0.42 m at 2 m with a focal length of 85 pixels: 17.85 pixels around the middle of the
        // photo.
        assert_eq!(all.sheets.iter().filter(|&&sheet| sheet == 1).count(), 18 * 18);
        assert_eq!(in_the_way(&camera(), &sheets).at([50.0, 40.0]).0, 2);
    }

    #[test]
    fn what_is_beside_and_behind_is_clipped() {
        // The floor reaches from far behind the camera to far ahead.
        let floor = Sheet {
            corner: [-5.0, -5.0, -1.0],
            u: [10.0, 0.0, 0.0],
            v: [0.0, 10.0, 0.0],
            ..sheet(0.0, 1.0)
        };
        let all = seen(&camera(), &[floor, sheet(-1.0, 1.0)]);
        // The floor begins below the line that is 5 m away: 40 + 85 / 5.
        assert_eq!(all.at([50.0, 56.5]).0, NONE);
        assert_eq!(all.at([50.0, 57.5]).0, 0);
        assert!(all.sheets.iter().all(|&sheet| sheet == 0 || sheet == NONE));
    }
}
