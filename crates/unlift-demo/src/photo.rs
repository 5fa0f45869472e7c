//! Rendering of photos: visible surfaces with color and light.

use unlift::Error;
use unlift::synthetic::Sheet;
use unlift_vision::features::ColorImage;

use crate::light::Lights;
use crate::material::{Shade, shade};
use crate::noise::unit as random;
use crate::pinhole::Pinhole;
use crate::raster::{Facing, NONE, seen};
use unlift::synthetic::vectors::{add, cross, scale, unit};

/// Samples per pixel and axis.
const FINER: usize = 2;
/// Amplitude of sensor noise, of 255.
const GRAIN: f64 = 4.0;

/// Renders `sheets` as seen by `camera`, with noise that depends on `seed`.
pub(crate) fn photo(
    camera: &Pinhole,
    sheets: &[Sheet],
    lights: &Lights,
    seed: u64,
) -> Result<ColorImage, Error> {
    let fine = camera.finer(FINER);
    let seen = seen(&fine, sheets);
    let facing: Vec<Facing> = sheets.iter().map(|sheet| Facing::new(&fine, sheet)).collect();
    let light = |[x, y]: [usize; 2]| {
        let index = seen.sheets[y * fine.size[0] + x];
        if index == NONE {
            return [0.0; 3];
        }
        let sheet = &sheets[index as usize];
        let ray = fine.ray([x as f64 + 0.5, y as f64 + 0.5]);
        let (far, on) = facing[index as usize].hit(ray);
        let Shade { color, glows } = shade(sheet, index, on);
        if glows {
            return color;
        }
        let point = add(fine.center, fine.in_world(scale(ray, far)));
        let reaching = lights.reaching(point, unit(cross(sheet.u, sheet.v)));
        std::array::from_fn(|c| color[c] * reaching[c])
    };
    let [width, height] = camera.size;
    let mut pixels = Vec::with_capacity(3 * width * height);
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let looks =
            (0..FINER * FINER).map(|at| light([FINER * x + at % FINER, FINER * y + at / FINER]));
        let sum = looks.fold([0.0; 3], add);
        for (c, sum) in sum.into_iter().enumerate() {
            let grain = random([seed, (y * width + x) as u64, c as u64]) - 0.5;
            // The square root approximates the gamma of screens.
            let value = (sum / (FINER * FINER) as f64).min(1.0).sqrt() * 255.0;
            pixels.push((value + grain * GRAIN + 0.5) as u8);
        }
    }
    ColorImage::try_new(width, height, pixels)
}
