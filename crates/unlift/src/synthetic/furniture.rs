//! Pieces of furniture. The origin of a piece is the left end of its back if it stands along a wall
//! (`x` along the wall, `y` into the room), otherwise its middle.

use super::surfaces::{Faces, Outline, Place, Scene, Texture, turn};
use crate::seed::Draws;

/// Adds a bookshelf, 1.8 to 2.1 m high, filled with books and boxes.
pub(super) fn bookshelf(scene: &mut Scene, place: &Place, width: f64, draws: &mut Draws) {
    const BOARD: f64 = 0.022;
    const DEPTH: f64 = 0.3;
    let height = draws.between(1.8, 2.1);
    let n_levels = 5 + draws.below(2) as usize;
    let pitch = (height - 0.1) / n_levels as f64;
    let n_bays = 2;
    let bay = (width - BOARD) / n_bays as f64;
    // Only the panel's front is visible; its depth hides the space behind the books.
    let panel = [width, 0.08, height];
    scene.block(place, [0.0; 3], panel, Faces::FrontAndTop, Texture::SMOOTH);
    for i in 0..=n_bays {
        let x = i as f64 * bay;
        let (low, high) = ([x, 0.0, 0.0], [x + BOARD, DEPTH, height]);
        scene.block(place, low, high, Faces::Standing, Texture::WOOD);
    }
    for level in 0..=n_levels {
        let z = 0.08 + level as f64 * pitch;
        let (low, high) = ([0.0, 0.08, z], [width, DEPTH, z + BOARD]);
        scene.block(place, low, high, Faces::All, Texture::WOOD);
        if level < n_levels {
            for i in 0..n_bays {
                let x = i as f64 * bay + BOARD;
                let shelf = place.then([x, 0.0, z + BOARD], [1.0, 0.0]);
                shelf_row(scene, &shelf, bay - BOARD, pitch - BOARD, DEPTH, draws);
            }
        }
    }
    let top = place.then([0.0, 0.0, 0.08 + height - 0.1 + BOARD], [1.0, 0.0]);
    let count = 1 + draws.below(3) as usize;
    scatter(scene, &top, [0.1, 0.06], [width - 0.1, DEPTH], count, draws);
}

/// Adds a cabinet with two doors, up to 2 m high.
pub(super) fn tall_cabinet(scene: &mut Scene, place: &Place, width: f64, draws: &mut Draws) {
    let (depth, height) = (draws.between(0.42, 0.55), draws.between(1.5, 2.0));
    let body = [width, depth, height];
    scene.block(place, [0.0; 3], body, Faces::Standing, Texture::WOOD);
    for i in 0..2 {
        let x = 0.02 + i as f64 * 0.5 * width;
        let (low, high) =
            ([x, depth, 0.08], [x + 0.5 * width - 0.04, depth + 0.015, height - 0.03]);
        scene.shell(place, low, high, Faces::Standing, Texture::WOOD);
        let handle = [0.5 * width - 0.06 + i as f64 * 0.09, depth + 0.015, 0.9];
        let end = [handle[0] + 0.02, handle[1] + 0.03, 1.05];
        scene.shell(place, handle, end, Faces::All, Texture::PRINT);
    }
    let top = place.then([0.0, 0.0, height], [1.0, 0.0]);
    let count = 1 + draws.below(3) as usize;
    scatter(scene, &top, [0.05, 0.05], [width - 0.05, depth - 0.05], count, draws);
}

/// Adds a low cabinet with drawers, and objects on top.
pub(super) fn sideboard(scene: &mut Scene, place: &Place, width: f64, draws: &mut Draws) {
    let (depth, height) = (draws.between(0.38, 0.48), draws.between(0.7, 0.9));
    let body = [width, depth, height];
    scene.block(place, [0.0, 0.0, 0.1], body, Faces::Standing, Texture::WOOD);
    for row in 0..3 {
        for column in 0..2 {
            let x = 0.02 + column as f64 * 0.5 * width;
            let step = (height - 0.16) / 3.0;
            let z = 0.13 + row as f64 * step;
            let low = [x, depth, z];
            let high = [x + 0.5 * width - 0.04, depth + 0.012, z + step - 0.02];
            scene.shell(place, low, high, Faces::Standing, Texture::WOOD);
            let knob = [x + 0.25 * width - 0.03, depth + 0.012, z + 0.5 * step];
            let end = [knob[0] + 0.05, knob[1] + 0.025, knob[2] + 0.02];
            scene.shell(place, knob, end, Faces::All, Texture::PRINT);
        }
    }
    let top = place.then([0.0, 0.0, height], [1.0, 0.0]);
    let count = 4 + draws.below(3) as usize;
    scatter(scene, &top, [0.05, 0.05], [width - 0.05, depth - 0.03], count, draws);
}

/// Adds a desk with a screen, a keyboard and objects.
pub(super) fn desk(scene: &mut Scene, place: &Place, width: f64, draws: &mut Draws) {
    let (depth, height) = (draws.between(0.6, 0.7), 0.74);
    let top = [width, depth, height];
    scene.block(place, [0.0, 0.02, height - 0.03], top, Faces::All, Texture::WOOD);
    for x in [0.0, width - 0.04] {
        let (low, high) = ([x, 0.04, 0.0], [x + 0.04, depth - 0.02, height - 0.03]);
        scene.block(place, low, high, Faces::All, Texture::WOOD);
    }
    let drawers = [0.42, depth - 0.06, height - 0.05];
    scene.block(place, [0.04, 0.05, 0.3], drawers, Faces::All, Texture::WOOD);
    let surface = place.then([0.0, 0.0, height], [1.0, 0.0]);
    let x = draws.between(0.35, width - 0.65);
    screen(scene, &surface.then([x, 0.14, 0.0], [1.0, 0.0]));
    let keyboard = ([x - 0.1, 0.36, 0.0], [x + 0.33, 0.5, 0.02]);
    scene.block(&surface, keyboard.0, keyboard.1, Faces::Standing, Texture::PRINT);
    scatter(scene, &surface, [0.02, 0.05], [x - 0.12, depth - 0.05], 2, draws);
    scatter(scene, &surface, [x + 0.48, 0.05], [width - 0.02, depth - 0.05], 2, draws);
}

pub(super) fn sofa(scene: &mut Scene, place: &Place, width: f64, draws: &mut Draws) {
    let depth = 0.85;
    let parts = [
        ([0.0, 0.03, 0.1], [width, depth - 0.02, 0.42]),
        ([0.0, 0.03, 0.42], [width, 0.25, 0.82]),
        ([0.0, 0.25, 0.42], [0.18, depth, 0.6]),
        ([width - 0.18, 0.25, 0.42], [width, depth, 0.6]),
    ];
    for (low, high) in parts {
        scene.block(place, low, high, Faces::All, Texture::FABRIC);
    }
    for _ in 0..3 {
        let side = draws.between(0.36, 0.46);
        let x = draws.between(0.2, width - 0.2 - side);
        let y = draws.between(0.26, 0.34);
        let (low, high) = ([x, y, 0.43], [x + side, y + 0.13, 0.42 + side]);
        scene.block(place, low, high, Faces::Standing, Texture::PATTERN);
    }
    // Blanket over an armrest.
    let blanket = ([width - 0.2, 0.4, 0.45], [width + 0.01, 0.72, 0.612]);
    scene.shell(place, blanket.0, blanket.1, Faces::Standing, Texture::PATTERN);
}

/// Adds a chair that faces `y`.
pub(super) fn chair(scene: &mut Scene, place: &Place, draws: &mut Draws) {
    let (half, seat) = (0.21, 0.45);
    let back = draws.between(0.85, 0.98);
    for x in [-half, half - 0.035] {
        for y in [-half, half - 0.035] {
            let top = if y < 0.0 { back } else { seat - 0.03 };
            let (low, high) = ([x, y, 0.0], [x + 0.035, y + 0.035, top]);
            scene.block(place, low, high, Faces::Standing, Texture::WOOD);
        }
    }
    let board = ([-half, -half, seat - 0.03], [half, half, seat]);
    scene.block(place, board.0, board.1, Faces::All, Texture::WOOD);
    let cushion = ([-half + 0.03, -half + 0.05, seat], [half - 0.03, half - 0.02, seat + 0.03]);
    scene.shell(place, cushion.0, cushion.1, Faces::Standing, Texture::FABRIC);
    for z in [0.58, 0.7, 0.82] {
        let (low, high) = ([-half, -half, z], [half, -half + 0.025, (z + 0.07).min(back)]);
        scene.block(place, low, high, Faces::All, Texture::WOOD);
    }
}

/// Adds a table with a runner and objects on it.
pub(super) fn table(scene: &mut Scene, place: &Place, length: f64, depth: f64, draws: &mut Draws) {
    let height = 0.75;
    let (x, y) = (0.5 * length, 0.5 * depth);
    let top = ([-x, -y, height - 0.035], [x, y, height]);
    scene.block(place, top.0, top.1, Faces::All, Texture::WOOD);
    for (sx, sy) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let (cx, cy) = (sx * (x - 0.06), sy * (y - 0.06));
        let low = [cx - 0.03, cy - 0.03, 0.0];
        let high = [cx + 0.03, cy + 0.03, height - 0.035];
        scene.block(place, low, high, Faces::Standing, Texture::WOOD);
    }
    let runner = ([-x + 0.1, -0.17, height], [x - 0.1, 0.17, height + 0.003]);
    scene.shell(place, runner.0, runner.1, Faces::FrontAndTop, Texture::PATTERN);
    let surface = place.then([0.0, 0.0, height + 0.003], [1.0, 0.0]);
    let count = 6 + draws.below(4) as usize;
    scatter(scene, &surface, [0.06 - x, 0.05 - y], [x - 0.06, y - 0.05], count, draws);
}

pub(super) fn rug(scene: &mut Scene, place: &Place, draws: &mut Draws) {
    let (x, y) = (draws.between(1.0, 1.25), draws.between(0.75, 0.95));
    let (low, high) = ([-x, -y, 0.0], [x, y, 0.008]);
    scene.shell(place, low, high, Faces::Standing, Texture::PATTERN);
}

pub(super) fn floor_lamp(scene: &mut Scene, place: &Place, draws: &mut Draws) {
    let height = draws.between(1.35, 1.6);
    scene.tube(place, [0.0; 3], 0.15, 0.15, 0.025, Texture::SMOOTH);
    scene.tube(place, [0.0, 0.0, 0.025], 0.015, 0.015, height, Texture::SMOOTH);
    scene.tube(place, [0.0, 0.0, height], 0.21, 0.14, 0.28, Texture::FABRIC);
}

/// Adds a lamp that hangs over the table.
pub(super) fn pendant(scene: &mut Scene, place: &Place, ceiling: f64) {
    let foot = ceiling - 0.95;
    scene.tube(place, [0.0, 0.0, foot], 0.22, 0.06, 0.2, Texture::PATTERN);
    let cord = ceiling - foot - 0.2;
    scene.tube(place, [0.0, 0.0, foot + 0.2], 0.008, 0.008, cord, Texture::SMOOTH);
}

pub(super) fn plant(scene: &mut Scene, place: &Place, draws: &mut Draws) {
    scene.tube(place, [0.0; 3], 0.13, 0.17, 0.3, Texture::SMOOTH);
    let soil = ([-0.15, -0.15, 0.29], [0.3, 0.0, 0.0], [0.0, 0.3, 0.0]);
    scene.outlined(place, soil.0, soil.1, soil.2, Outline::Ellipse, Texture::PRINT);
    for _ in 0..50 {
        let out: [f64; 3] = draws.direction();
        let reach = draws.between(0.06, 0.26);
        let place_of_leaf = [out[0] * reach, out[1] * reach, 0.68 + out[2] * 1.6 * reach];
        leaf(scene, place, place_of_leaf, draws.between(0.06, 0.13), draws);
    }
}

/// Adds two to four framed prints of different sizes, about `height` m above the floor.
pub(super) fn pictures(
    scene: &mut Scene,
    place: &Place,
    width: f64,
    height: f64,
    draws: &mut Draws,
) {
    let count = 2 + draws.below(3) as usize;
    let pitch = width / count as f64;
    for i in 0..count {
        let w = draws.between(0.55, 0.88) * pitch;
        let h = draws.between(0.3, 0.6);
        let x = i as f64 * pitch + 0.5 * (pitch - w);
        let z = height + draws.between(-0.06, 0.1);
        let (low, high) = ([x, 0.0, z], [x + w, 0.02, z + h]);
        scene.shell(place, low, high, Faces::Standing, Texture::SMOOTH);
        let corner = [x + 0.03, 0.021, z + 0.03];
        let (u, v) = ([0.0, 0.0, h - 0.06], [w - 0.06, 0.0, 0.0]);
        scene.sheet(place, corner, u, v, Texture::PRINT);
    }
}

pub(super) fn door(scene: &mut Scene, place: &Place, width: f64) {
    let leaf = ([0.05, 0.0, 0.0], [width - 0.05, 0.03, 2.02]);
    scene.shell(place, leaf.0, leaf.1, Faces::FrontAndTop, Texture::SMOOTH);
    for (low, high) in [(0.15, 0.95), (1.1, 1.9)] {
        let (low, high) = ([0.17, 0.03, low], [width - 0.17, 0.035, high]);
        scene.shell(place, low, high, Faces::Standing, Texture::SMOOTH);
    }
    for x in [0.0, width - 0.05] {
        let (low, high) = ([x, 0.0, 0.0], [x + 0.05, 0.04, 2.07]);
        scene.shell(place, low, high, Faces::Standing, Texture::SMOOTH);
    }
    let handle = ([width - 0.2, 0.03, 1.03], [width - 0.08, 0.08, 1.05]);
    scene.shell(place, handle.0, handle.1, Faces::All, Texture::PRINT);
}

/// Adds a window with cross bars and curtains, centered at `middle` along the wall.
pub(super) fn window(scene: &mut Scene, wall: &Place, middle: f64, draws: &mut Draws) {
    let (half, foot, height) = (draws.between(0.55, 0.75), 0.95, 1.25);
    let place = wall.then([middle - half, 0.0, foot], [1.0, 0.0]);
    let (u, v) = ([0.0, 0.0, height], [2.0 * half, 0.0, 0.0]);
    scene.sheet(&place, [0.0, 0.005, 0.0], u, v, Texture::GLASS);
    for x in [0.0, half - 0.03, 2.0 * half - 0.06] {
        let (low, high) = ([x, 0.0, 0.0], [x + 0.06, 0.04, height]);
        scene.shell(&place, low, high, Faces::Standing, Texture::SMOOTH);
    }
    for z in [0.0, height - 0.06] {
        let (low, high) = ([0.0, 0.0, z], [2.0 * half, 0.04, z + 0.06]);
        scene.shell(&place, low, high, Faces::All, Texture::SMOOTH);
    }
    let sill = ([-0.05, 0.0, -0.03], [2.0 * half + 0.05, 0.16, 0.0]);
    scene.block(&place, sill.0, sill.1, Faces::All, Texture::SMOOTH);
    for x in [-0.38, 2.0 * half + 0.02] {
        let (low, high) = ([x, 0.03, -0.75], [x + 0.36, 0.1, height + 0.1]);
        scene.block(&place, low, high, Faces::Standing, Texture::FABRIC);
    }
}

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
