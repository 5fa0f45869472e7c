//! Illumination by a lamp below the ceiling and by daylight from the window.

use unlift::synthetic::{Material, Sheet};

use crate::middle;
use crate::pinhole::Pinhole;
use crate::raster::{Seen, in_the_way};
use unlift::synthetic::vectors::{add, cross, dot, norm, scale, sub, unit};

/// Width and height in pixels of a lamp's depth image in one of six directions.
const SIDE: usize = 384;
/// Distance in meters in front of a surface at which shadows are looked up, so that it does not
/// shade itself.
const SLACK: f64 = 0.03;
/// Ambient light on surfaces that face down and up.
const AMBIENT: [f64; 2] = [0.28, 0.42];

/// Point light that shines in all directions.
struct Lamp {
    at: [f64; 3],
    color: [f64; 3],
    /// Distance in meters within which surfaces are clearly brighter.
    reach: f64,
    /// Depth images along `x`, `y`, `z` and against them.
    around: Vec<(Pinhole, Seen)>,
}

pub(crate) struct Lights(Vec<Lamp>);

impl Lights {
    pub(crate) fn of(sheets: &[Sheet]) -> Self {
        let top = sheets.iter().map(|sheet| middle(sheet)[2]).fold(0.0, f64::max);
        let mut lamps = vec![Lamp::new([-0.7, 0.45, top - 0.25], [0.95, 0.86, 0.72], 1.6, sheets)];
        lamps.extend(sheets.iter().filter(|sheet| sheet.material == Material::Glass).map(|pane| {
            let inside = scale(unit(cross(pane.u, pane.v)), 0.3);
            Lamp::new(add(middle(pane), inside), [0.62, 0.7, 0.8], 2.0, sheets)
        }));
        Self(lamps)
    }

    pub(crate) fn reaching(&self, point: [f64; 3], normal: [f64; 3]) -> [f64; 3] {
        let up = 0.5 + 0.5 * normal[2];
        let ambient = AMBIENT[0] * (1.0 - up) + AMBIENT[1] * up;
        let mut sum = [ambient; 3];
        for lamp in &self.0 {
            let much = lamp.reaching(point, normal);
            sum = add(sum, scale(lamp.color, much));
        }
        sum
    }
}

impl Lamp {
    fn new(at: [f64; 3], color: [f64; 3], reach: f64, sheets: &[Sheet]) -> Self {
        let around = (0..6).map(|side| {
            let [x, y, z] = [0, 1, 2].map(|c| {
                let mut axis = [0.0; 3];
                axis[(side + c) % 3] = if side < 3 { 1.0 } else { -1.0 };
                axis
            });
            // These axes may be mirrored, which does not matter for depth images.
            let camera = Pinhole {
                center: at,
                rotation: [y, z, x],
                focal: 0.5 * SIDE as f64,
                size: [SIDE; 2],
            };
            let seen = in_the_way(&camera, sheets);
            (camera, seen)
        });
        let around = around.collect();
        Self { at, color, reach, around }
    }

    fn reaching(&self, point: [f64; 3], normal: [f64; 3]) -> f64 {
        let towards = sub(self.at, point);
        let far = norm(towards);
        let slope = dot(towards, normal) / far;
        if slope <= 0.0 {
            return 0.0;
        }
        let near = far / self.reach;
        slope / (1.0 + near * near) * self.unshaded(add(point, scale(normal, SLACK))) * 2.0
    }

    /// Returns the visible share of the lamp from `point`, from nine pixels around it in the depth
    /// image.
    fn unshaded(&self, point: [f64; 3]) -> f64 {
        let found = self.around.iter().find_map(|(camera, seen)| {
            let (place, depth) = camera.project(point)?;
            Some((seen, place, depth - SLACK))
        });
        let Some((seen, place, depth)) = found else { return 1.0 };
        let steps = [-1.5, 0.0, 1.5];
        let places = steps.iter().flat_map(|y| steps.map(|x| [place[0] + x, place[1] + y]));
        let free = places.filter(|&place| f64::from(seen.at(place).1) >= depth);
        free.count() as f64 / 9.0
    }
}
