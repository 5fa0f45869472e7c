//! Pieces of furniture. The origin is the left end of the back along a wall, or else the middle.

use super::surfaces::Faces::{All, FrontAndTop, Standing};
use super::surfaces::{FABRIC, GLASS, LEAVES, PATTERN, PRINT, Piece, SMOOTH, WOOD, turn};
use crate::geometry::vector::sub;
use crate::seed::Draws;

/// Adds a bookshelf, 1.8 to 2.1 m high, filled with books and boxes.
pub(super) fn bookshelf(mut piece: Piece<'_>, width: f64, draws: &mut Draws) {
    const BOARD: f64 = 0.022;
    const DEPTH: f64 = 0.3;
    let height = draws.between(1.8, 2.1);
    let n_levels = 5 + draws.below(2) as usize;
    let pitch = (height - 0.1) / n_levels as f64;
    let n_bays = 2;
    let bay = (width - BOARD) / n_bays as f64;
    // Only the panel's front is visible; its depth hides the space behind the books.
    piece.block([0.0; 3], [width, 0.08, height], FrontAndTop, SMOOTH);
    for i in 0..=n_bays {
        let x = i as f64 * bay;
        piece.block([x, 0.0, 0.0], [x + BOARD, DEPTH, height], Standing, WOOD);
    }
    for level in 0..=n_levels {
        let z = 0.08 + level as f64 * pitch;
        piece.block([0.0, 0.08, z], [width, DEPTH, z + BOARD], All, WOOD);
        for i in (0..n_bays).filter(|_| level < n_levels) {
            let x = i as f64 * bay + BOARD;
            let shelf = piece.at([x, 0.0, z + BOARD]);
            shelf_row(shelf, [bay - BOARD, DEPTH, pitch - BOARD], draws);
        }
    }
    let top = piece.at([0.0, 0.0, 0.08 + height - 0.1 + BOARD]);
    scatter(top, [0.1, 0.06], [width - 0.1, DEPTH], 1 + draws.below(3), draws);
}

/// Adds a cabinet with two doors, up to 2 m high.
pub(super) fn tall_cabinet(mut piece: Piece<'_>, width: f64, draws: &mut Draws) {
    let (depth, height) = (draws.between(0.42, 0.55), draws.between(1.5, 2.0));
    piece.block([0.0; 3], [width, depth, height], Standing, WOOD);
    for i in 0..2 {
        let x = 0.02 + i as f64 * 0.5 * width;
        let door = [x + 0.5 * width - 0.04, depth + 0.015, height - 0.03];
        piece.shell([x, depth, 0.08], door, Standing, WOOD);
        let handle = [0.5 * width - 0.06 + i as f64 * 0.09, depth + 0.015, 0.9];
        piece.shell(handle, [handle[0] + 0.02, handle[1] + 0.03, 1.05], All, PRINT);
    }
    let top = piece.at([0.0, 0.0, height]);
    scatter(top, [0.05, 0.05], [width - 0.05, depth - 0.05], 1 + draws.below(3), draws);
}

/// Adds a low cabinet with drawers, and objects on top.
pub(super) fn sideboard(mut piece: Piece<'_>, width: f64, draws: &mut Draws) {
    let (depth, height) = (draws.between(0.38, 0.48), draws.between(0.7, 0.9));
    piece.block([0.0, 0.0, 0.1], [width, depth, height], Standing, WOOD);
    for row in 0..3 {
        for column in 0..2 {
            let x = 0.02 + column as f64 * 0.5 * width;
            let step = (height - 0.16) / 3.0;
            let z = 0.13 + row as f64 * step;
            let high = [x + 0.5 * width - 0.04, depth + 0.012, z + step - 0.02];
            piece.shell([x, depth, z], high, Standing, WOOD);
            let knob = [x + 0.25 * width - 0.03, depth + 0.012, z + 0.5 * step];
            piece.shell(knob, [knob[0] + 0.05, knob[1] + 0.025, knob[2] + 0.02], All, PRINT);
        }
    }
    let top = piece.at([0.0, 0.0, height]);
    scatter(top, [0.05, 0.05], [width - 0.05, depth - 0.03], 4 + draws.below(3), draws);
}

/// Adds a desk with a screen, a keyboard and objects.
pub(super) fn desk(mut piece: Piece<'_>, width: f64, draws: &mut Draws) {
    let (depth, height) = (draws.between(0.6, 0.7), 0.74);
    piece.block([0.0, 0.02, height - 0.03], [width, depth, height], All, WOOD);
    for x in [0.0, width - 0.04] {
        piece.block([x, 0.04, 0.0], [x + 0.04, depth - 0.02, height - 0.03], All, WOOD);
    }
    piece.block([0.04, 0.05, 0.3], [0.42, depth - 0.06, height - 0.05], All, WOOD);
    let mut surface = piece.at([0.0, 0.0, height]);
    let x = draws.between(0.35, width - 0.65);
    screen(surface.at([x, 0.14, 0.0]));
    surface.block([x - 0.1, 0.36, 0.0], [x + 0.33, 0.5, 0.02], Standing, PRINT);
    scatter(surface.at([0.0; 3]), [0.02, 0.05], [x - 0.12, depth - 0.05], 2, draws);
    scatter(surface, [x + 0.48, 0.05], [width - 0.02, depth - 0.05], 2, draws);
}

pub(super) fn sofa(mut piece: Piece<'_>, width: f64, draws: &mut Draws) {
    let depth = 0.85;
    piece.block([0.0, 0.03, 0.1], [width, depth - 0.02, 0.42], All, FABRIC);
    piece.block([0.0, 0.03, 0.42], [width, 0.25, 0.82], All, FABRIC);
    piece.block([0.0, 0.25, 0.42], [0.18, depth, 0.6], All, FABRIC);
    piece.block([width - 0.18, 0.25, 0.42], [width, depth, 0.6], All, FABRIC);
    for _ in 0..3 {
        let side = draws.between(0.36, 0.46);
        let x = draws.between(0.2, width - 0.2 - side);
        let y = draws.between(0.26, 0.34);
        piece.block([x, y, 0.43], [x + side, y + 0.13, 0.42 + side], Standing, PATTERN);
    }
    // Blanket over an armrest.
    piece.shell([width - 0.2, 0.4, 0.45], [width + 0.01, 0.72, 0.612], Standing, PATTERN);
}

/// Adds a chair that faces `y`.
pub(super) fn chair(mut piece: Piece<'_>, draws: &mut Draws) {
    let (half, seat) = (0.21, 0.45);
    let back = draws.between(0.85, 0.98);
    for x in [-half, half - 0.035] {
        for y in [-half, half - 0.035] {
            let top = if y < 0.0 { back } else { seat - 0.03 };
            piece.block([x, y, 0.0], [x + 0.035, y + 0.035, top], Standing, WOOD);
        }
    }
    piece.block([-half, -half, seat - 0.03], [half, half, seat], All, WOOD);
    let cushion = [half - 0.03, half - 0.02, seat + 0.03];
    piece.shell([-half + 0.03, -half + 0.05, seat], cushion, Standing, FABRIC);
    for z in [0.58, 0.7, 0.82] {
        piece.block([-half, -half, z], [half, -half + 0.025, (z + 0.07).min(back)], All, WOOD);
    }
}

/// Adds a table with a runner and objects on it.
pub(super) fn table(mut piece: Piece<'_>, length: f64, depth: f64, draws: &mut Draws) {
    let height = 0.75;
    let (x, y) = (0.5 * length, 0.5 * depth);
    piece.block([-x, -y, height - 0.035], [x, y, height], All, WOOD);
    for (sx, sy) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let (cx, cy) = (sx * (x - 0.06), sy * (y - 0.06));
        let high = [cx + 0.03, cy + 0.03, height - 0.035];
        piece.block([cx - 0.03, cy - 0.03, 0.0], high, Standing, WOOD);
    }
    let runner = [x - 0.1, 0.17, height + 0.003];
    piece.shell([-x + 0.1, -0.17, height], runner, FrontAndTop, PATTERN);
    let surface = piece.at([0.0, 0.0, height + 0.003]);
    scatter(surface, [0.06 - x, 0.05 - y], [x - 0.06, y - 0.05], 6 + draws.below(4), draws);
}

pub(super) fn rug(mut piece: Piece<'_>, draws: &mut Draws) {
    let (x, y) = (draws.between(1.0, 1.25), draws.between(0.75, 0.95));
    piece.shell([-x, -y, 0.0], [x, y, 0.008], Standing, PATTERN);
}

pub(super) fn floor_lamp(mut piece: Piece<'_>, draws: &mut Draws) {
    let height = draws.between(1.35, 1.6);
    piece.tube([0.0; 3], [0.15; 2], 0.025, SMOOTH);
    piece.tube([0.0, 0.0, 0.025], [0.015; 2], height, SMOOTH);
    piece.tube([0.0, 0.0, height], [0.21, 0.14], 0.28, FABRIC);
}

/// Adds a lamp that hangs over the table.
pub(super) fn pendant(mut piece: Piece<'_>, ceiling: f64) {
    let foot = ceiling - 0.95;
    piece.tube([0.0, 0.0, foot], [0.22, 0.06], 0.2, PATTERN);
    piece.tube([0.0, 0.0, foot + 0.2], [0.008; 2], ceiling - foot - 0.2, SMOOTH);
}

pub(super) fn plant(mut piece: Piece<'_>, draws: &mut Draws) {
    piece.tube([0.0; 3], [0.13, 0.17], 0.3, SMOOTH);
    piece.disc([0.0, 0.0, 0.29], 0.15, PRINT);
    for _ in 0..50 {
        let out: [f64; 3] = draws.direction();
        let reach = draws.between(0.06, 0.26);
        let middle = [out[0] * reach, out[1] * reach, 0.68 + out[2] * 1.6 * reach];
        leaf(&mut piece, middle, draws.between(0.06, 0.13), draws);
    }
}

/// Adds two to four framed prints of different sizes, about `height` m above the floor.
pub(super) fn pictures(mut piece: Piece<'_>, width: f64, height: f64, draws: &mut Draws) {
    let count = 2 + draws.below(3) as usize;
    let pitch = width / count as f64;
    for i in 0..count {
        let w = draws.between(0.55, 0.88) * pitch;
        let h = draws.between(0.3, 0.6);
        let x = i as f64 * pitch + 0.5 * (pitch - w);
        let z = height + draws.between(-0.06, 0.1);
        piece.shell([x, 0.0, z], [x + w, 0.02, z + h], Standing, SMOOTH);
        let (u, v) = ([0.0, 0.0, h - 0.06], [w - 0.06, 0.0, 0.0]);
        piece.sheet([x + 0.03, 0.021, z + 0.03], u, v, PRINT);
    }
}

pub(super) fn door(mut piece: Piece<'_>, width: f64) {
    piece.shell([0.05, 0.0, 0.0], [width - 0.05, 0.03, 2.02], FrontAndTop, SMOOTH);
    for (low, high) in [(0.15, 0.95), (1.1, 1.9)] {
        piece.shell([0.17, 0.03, low], [width - 0.17, 0.035, high], Standing, SMOOTH);
    }
    for x in [0.0, width - 0.05] {
        piece.shell([x, 0.0, 0.0], [x + 0.05, 0.04, 2.07], Standing, SMOOTH);
    }
    piece.shell([width - 0.2, 0.03, 1.03], [width - 0.08, 0.08, 1.05], All, PRINT);
}

/// Adds a window with cross bars and curtains, centered at `middle` along the wall.
pub(super) fn window(mut wall: Piece<'_>, middle: f64, draws: &mut Draws) {
    let (half, foot, height) = (draws.between(0.55, 0.75), 0.95, 1.25);
    let mut piece = wall.at([middle - half, 0.0, foot]);
    piece.sheet([0.0, 0.005, 0.0], [0.0, 0.0, height], [2.0 * half, 0.0, 0.0], GLASS);
    for x in [0.0, half - 0.03, 2.0 * half - 0.06] {
        piece.shell([x, 0.0, 0.0], [x + 0.06, 0.04, height], Standing, SMOOTH);
    }
    for z in [0.0, height - 0.06] {
        piece.shell([0.0, 0.0, z], [2.0 * half, 0.04, z + 0.06], All, SMOOTH);
    }
    piece.block([-0.05, 0.0, -0.03], [2.0 * half + 0.05, 0.16, 0.0], All, SMOOTH);
    for x in [-0.38, 2.0 * half + 0.02] {
        piece.block([x, 0.03, -0.75], [x + 0.36, 0.1, height + 0.1], Standing, FABRIC);
    }
}

/// Places up to `count` random objects between `low` and `high`, at most one per grid cell.
fn scatter(mut piece: Piece<'_>, low: [f64; 2], high: [f64; 2], count: u64, draws: &mut Draws) {
    /// Side of a cell, and largest width of an object, in meters.
    const CELL: f64 = 0.22;
    let sides = sub(&high, &low);
    let n = sides.map(|side| (side / CELL) as usize);
    for cell in draws.permutation(n[0] * n[1]).into_iter().take(count as usize) {
        let cell = [cell as usize % n[0], cell as usize / n[0]];
        let [x, y] = [0, 1].map(|c| low[c] + (cell[c] as f64 + 0.5) * (sides[c] / n[c] as f64));
        let small = turn(draws.between(-0.3, 0.3));
        thing(piece.turned([x, y, 0.0], small), draws);
    }
}

/// Adds a random object within a square of 20 cm.
fn thing(mut piece: Piece<'_>, draws: &mut Draws) {
    match draws.below(7) {
        0 => piece.tube([0.0; 3], [0.04, 0.042], draws.between(0.08, 0.11), PRINT),
        1 => {
            let height = draws.between(0.15, 0.28);
            piece.tube([0.0; 3], [0.045, 0.075], height, PATTERN);
            // Flowers.
            for _ in 0..10 {
                let out: [f64; 3] = draws.direction();
                let at = [0.07 * out[0], 0.07 * out[1], height + 0.1 + 0.07 * out[2]];
                leaf(&mut piece, at, 0.045, draws);
            }
        }
        2 => {
            // Pile of books.
            let mut z = 0.0;
            for _ in 0..2 + draws.below(4) {
                let (x, y) = (draws.between(0.07, 0.1), draws.between(0.05, 0.08));
                let high = [x, y, z + draws.between(0.015, 0.04)];
                piece.block([-x, -y, z], high, Standing, PRINT);
                z = high[2];
            }
        }
        3 => piece.tube([0.0; 3], [0.05, 0.095], 0.07, PATTERN),
        4 => {
            let (x, y) = (draws.between(0.05, 0.09), draws.between(0.03, 0.08));
            piece.block([-x, -y, 0.0], [x, y, draws.between(0.1, 0.26)], Standing, PRINT);
        }
        5 => {
            // Framed photo that leans back.
            let (w, h) = (draws.between(0.1, 0.18), draws.between(0.12, 0.2));
            piece.sheet([-0.5 * w, 0.02, 0.0], [0.0, -0.25 * h, h], [w, 0.0, 0.0], PRINT);
        }
        // Open magazine.
        _ => piece.block([-0.1, -0.08, 0.0], [0.1, 0.08, 0.01], Standing, PRINT),
    }
}

/// Adds a leaf of side `size` around `at`, in random direction, visible from both sides.
fn leaf(piece: &mut Piece<'_>, at: [f64; 3], size: f64, draws: &mut Draws) {
    let (u, v) = (draws.direction::<3>(), draws.direction::<3>());
    let (u, v) = (u.map(|x| x * size), v.map(|x| 0.5 * x * size));
    let corner = std::array::from_fn(|c| at[c] - 0.5 * (u[c] + v[c]));
    piece.sheet(corner, u, v, LEAVES);
    piece.sheet(corner, v, u, LEAVES);
}

/// Adds a computer screen with its foot, 53 cm wide.
fn screen(mut piece: Piece<'_>) {
    piece.block([0.0, -0.05, 0.0], [0.25, 0.1, 0.015], Standing, SMOOTH);
    piece.block([0.1, 0.0, 0.015], [0.15, 0.03, 0.15], Standing, SMOOTH);
    piece.block([-0.14, 0.03, 0.12], [0.39, 0.06, 0.45], All, SMOOTH);
    // Windows and text on the screen.
    piece.sheet([-0.13, 0.061, 0.13], [0.0, 0.0, 0.31], [0.51, 0.0, 0.0], PATTERN);
}

/// Adds a row of books, boxes and vases in a space of this width, depth and height.
fn shelf_row(mut piece: Piece<'_>, [width, depth, clear]: [f64; 3], draws: &mut Draws) {
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
                piece.block([x, 0.08, 0.0], high, Standing, PATTERN);
            }
            2 => {
                let height = clear * draws.between(0.4, 0.75);
                piece.tube([x + 0.07, depth - 0.1, 0.0], [0.045, 0.06], height, PATTERN);
            }
            // Book; its neighbors hide the covers.
            _ => {
                let front = depth - draws.between(0.015, 0.06);
                let high = [x + w - 0.001, front, clear * draws.between(0.62, 0.93)];
                piece.shell([x, 0.08, 0.0], high, FrontAndTop, PRINT);
            }
        }
        x += w;
    }
}
