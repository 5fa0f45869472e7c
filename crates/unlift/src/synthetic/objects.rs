//! Small objects on furniture. The origin of an object is the middle of its foot.

use super::surfaces::{Faces, Place, Scene};
use super::texture::Texture;
use super::vectors::turn;
use crate::seed::Draws;

/// Places up to `count` random objects on the rectangle from `low` to `high` (at `z = 0` of
/// `place`), at most one per grid cell, so that they do not overlap.
pub(super) fn scatter(
    scene: &mut Scene,
    place: &Place,
    low: [f64; 2],
    high: [f64; 2],
    count: usize,
    draws: &mut Draws,
) {
    /// Side of a cell, and largest width of an object, in meters.
    const CELL: f64 = 0.22;
    let fits = |c: usize| ((high[c] - low[c]) / CELL) as usize;
    let (columns, rows) = (fits(0), fits(1));
    let cells = draws.permutation(columns * rows);
    for &cell in cells.iter().take(count) {
        let (column, row) = (cell as usize % columns, cell as usize / columns);
        let pitch = |c: usize, n: usize| (high[c] - low[c]) / n as f64;
        let at = [
            low[0] + (column as f64 + 0.5) * pitch(0, columns),
            low[1] + (row as f64 + 0.5) * pitch(1, rows),
            0.0,
        ];
        let small = turn(draws.between(-0.3, 0.3));
        thing(scene, &place.then(at, small), draws);
    }
}

/// Adds a random object within a square of 20 cm.
fn thing(scene: &mut Scene, place: &Place, draws: &mut Draws) {
    match draws.below(7) {
        0 => {
            let height = draws.between(0.08, 0.11);
            scene.tube(place, [0.0; 3], 0.04, 0.042, height, Texture::PRINT);
        }
        1 => {
            let height = draws.between(0.15, 0.28);
            scene.tube(place, [0.0; 3], 0.045, 0.075, height, Texture::PATTERN);
            flowers(scene, place, height, draws);
        }
        2 => pile_of_books(scene, place, draws),
        3 => {
            scene.tube(place, [0.0; 3], 0.05, 0.095, 0.07, Texture::PATTERN);
        }
        4 => {
            let (x, y) = (draws.between(0.05, 0.09), draws.between(0.03, 0.08));
            let high = [x, y, draws.between(0.1, 0.26)];
            scene.block(place, [-x, -y, 0.0], high, Faces::Standing, Texture::PRINT);
        }
        5 => {
            // Framed photo that leans back.
            let (w, h) = (draws.between(0.1, 0.18), draws.between(0.12, 0.2));
            let lean = [0.0, -0.25 * h, h];
            let corner = [-0.5 * w, 0.02, 0.0];
            scene.sheet(place, corner, lean, [w, 0.0, 0.0], Texture::PRINT);
        }
        _ => {
            // Open magazine.
            let high = [0.1, 0.08, 0.01];
            scene.block(place, [-0.1, -0.08, 0.0], high, Faces::Standing, Texture::PRINT);
        }
    }
}

fn pile_of_books(scene: &mut Scene, place: &Place, draws: &mut Draws) {
    let mut z = 0.0;
    for _ in 0..2 + draws.below(4) {
        let high =
            [draws.between(0.07, 0.1), draws.between(0.05, 0.08), z + draws.between(0.015, 0.04)];
        scene.block(place, [-high[0], -high[1], z], high, Faces::Standing, Texture::PRINT);
        z = high[2];
    }
}

fn flowers(scene: &mut Scene, place: &Place, height: f64, draws: &mut Draws) {
    for _ in 0..10 {
        let out: [f64; 3] = draws.direction();
        let at = [0.07 * out[0], 0.07 * out[1], height + 0.1 + 0.07 * out[2]];
        leaf(scene, place, at, 0.045, draws);
    }
}

/// Adds a leaf of side `size` around `at`, in random direction, visible from both sides.
pub(super) fn leaf(scene: &mut Scene, place: &Place, at: [f64; 3], size: f64, draws: &mut Draws) {
    let u: [f64; 3] = draws.direction();
    let other: [f64; 3] = draws.direction();
    let (u, v) = (u.map(|x| x * size), other.map(|x| 0.5 * x * size));
    let corner = std::array::from_fn(|c| at[c] - 0.5 * (u[c] + v[c]));
    scene.sheet(place, corner, u, v, Texture::LEAVES);
    scene.sheet(place, corner, v, u, Texture::LEAVES);
}

/// Adds a computer screen with its foot, 53 cm wide.
pub(super) fn screen(scene: &mut Scene, place: &Place) {
    let foot = ([0.0, -0.05, 0.0], [0.25, 0.1, 0.015]);
    scene.block(place, foot.0, foot.1, Faces::Standing, Texture::SMOOTH);
    let neck = ([0.1, 0.0, 0.015], [0.15, 0.03, 0.15]);
    scene.block(place, neck.0, neck.1, Faces::Standing, Texture::SMOOTH);
    let panel = ([-0.14, 0.03, 0.12], [0.39, 0.06, 0.45]);
    scene.block(place, panel.0, panel.1, Faces::All, Texture::SMOOTH);
    let (u, v) = ([0.0, 0.0, 0.31], [0.51, 0.0, 0.0]);
    // Windows and text on the screen.
    scene.sheet(place, [-0.13, 0.061, 0.13], u, v, Texture::PATTERN);
}

/// Adds a row of books, boxes and vases, `width` wide, below height `clear`, with fronts near
/// `depth`.
pub(super) fn shelf_row(
    scene: &mut Scene,
    place: &Place,
    width: f64,
    clear: f64,
    depth: f64,
    draws: &mut Draws,
) {
    let mut x = draws.between(0.0, 0.04);
    loop {
        let kind = draws.below(20);
        let w = match kind {
            0 => draws.between(0.05, 0.15),
            1 => draws.between(0.18, 0.3),
            2 => 0.14,
            _ => draws.between(0.018, 0.05),
        };
        if x + w > width {
            break;
        }
        match kind {
            // Gap.
            0 => {}
            // Storage box.
            1 => {
                let high = [x + w, depth - 0.02, clear * draws.between(0.5, 0.8)];
                scene.block(place, [x, 0.08, 0.0], high, Faces::Standing, Texture::PATTERN);
            }
            2 => {
                let height = clear * draws.between(0.4, 0.75);
                let middle = [x + 0.07, depth - 0.1, 0.0];
                scene.tube(place, middle, 0.045, 0.06, height, Texture::PATTERN);
            }
            // Book; its neighbors hide the covers.
            _ => {
                let front = depth - draws.between(0.015, 0.06);
                let high = [x + w - 0.001, front, clear * draws.between(0.62, 0.93)];
                scene.shell(place, [x, 0.08, 0.0], high, Faces::FrontAndTop, Texture::PRINT);
            }
        }
        x += w;
    }
}
