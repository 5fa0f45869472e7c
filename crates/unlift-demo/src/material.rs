//! Colors of surfaces by material.

use unlift::synthetic::{Material, Sheet};

use crate::color::{Color, mixed, one_of, toned, within};
use crate::noise::{hashed, of_cell, rough, smooth, unit};
use crate::prints::print;
use unlift::synthetic::vectors::norm;

pub(crate) struct Shade {
    pub(crate) color: Color,
    /// True if its brightness does not depend on light.
    pub(crate) glows: bool,
}

const WOODS: [Color; 4] =
    [[0.42, 0.26, 0.13], [0.23, 0.12, 0.06], [0.55, 0.4, 0.22], [0.33, 0.17, 0.08]];
const FABRICS: [Color; 4] =
    [[0.13, 0.2, 0.29], [0.36, 0.12, 0.09], [0.22, 0.26, 0.16], [0.42, 0.34, 0.24]];
const SMOOTHS: [Color; 4] =
    [[0.62, 0.6, 0.56], [0.08, 0.08, 0.09], [0.48, 0.5, 0.5], [0.7, 0.68, 0.62]];
const WALLS: [Color; 3] = [[0.66, 0.62, 0.54], [0.4, 0.49, 0.5], [0.66, 0.62, 0.54]];

/// Returns the appearance of `sheet`, with number `index`, at `on` (both coordinates 0 to 1).
pub(crate) fn shade(sheet: &Sheet, index: u32, on: [f64; 2]) -> Shade {
    let sides = [norm(sheet.u), norm(sheet.v)];
    let [x, y] = [0, 1].map(|c| on[c] * sides[c]);
    let (part, piece) = (u64::from(sheet.part), u64::from(sheet.piece));
    // Grain runs along the longer side.
    let [along, across] = if sides[0] > sides[1] { [x, y] } else { [y, x] };
    let own = hashed([part, u64::from(index), 7]);
    let color = match sheet.material {
        Material::Paint => paint([x, y], part),
        Material::Smooth => {
            let tone = 0.94 + 0.12 * rough(x * 9.0, y * 9.0, own);
            toned(one_of(&SMOOTHS, [piece, 0, 3]), tone)
        }
        Material::Wood => wood([along, across], own, one_of(&WOODS, [piece, 0, 1])),
        Material::Boards => boards([x, y], own),
        Material::Fabric => fabric([x, y], own, one_of(&FABRICS, [piece, 0, 2])),
        Material::Pattern => pattern([x, y], part),
        Material::Print => print([x, y], sides, own),
        Material::Leaves => leaf(on, own),
        Material::Glass => return Shade { color: outside(on, own), glows: true },
    };
    Shade { color, glows: false }
}

fn paint([x, y]: [f64; 2], part: u64) -> Color {
    let base = one_of(&WALLS, [part, 1, 4]);
    let mut tone = 0.97 + 0.06 * rough(x * 3.0, y * 3.0, part);
    const CELL: f64 = 0.45;
    let (i, j) = ((x / CELL).floor(), (y / CELL).floor());
    let seed = |at: u64| [i as i64 as u64, j as i64 as u64, part ^ (at << 32)];
    if unit(seed(1)) < 0.4 {
        let [dx, dy] =
            [(x, i, 2), (y, j, 3)].map(|(x, i, at)| x - (i + 0.2 + 0.6 * unit(seed(at))) * CELL);
        let size = 0.006 + 0.03 * unit(seed(4)) * unit(seed(5));
        let edge =
            (dx * dx + dy * dy).sqrt() + 0.6 * size * (smooth(x * 60.0, y * 60.0, part) - 0.5);
        tone *= 1.0 - 0.2 * within(edge, size, 0.3 * size) * (0.3 + unit(seed(6)));
    }
    toned(base, tone)
}

/// Returns wood with grain along the first coordinate and knots.
fn wood([along, across]: [f64; 2], own: u64, base: Color) -> Color {
    const CELL: [f64; 2] = [0.5, 0.16];
    let (i, j) = ((along / CELL[0]).floor(), (across / CELL[1]).floor());
    let seed = |at: u64| [i as i64 as u64, j as i64 as u64, own ^ (at << 32)];
    let (dx, dy) = (
        along - (i + 0.2 + 0.6 * unit(seed(1))) * CELL[0],
        across - (j + 0.25 + 0.5 * unit(seed(2))) * CELL[1],
    );
    let size = 0.004 + 0.014 * unit(seed(3));
    let from_knot = (0.3 * dx * dx + dy * dy).sqrt();
    // Fibers bend around a knot.
    let bend = dy * size * 3.0 / (from_knot + size);
    let warp = 0.03 * smooth(along * 2.5, across * 6.0, own ^ 1);
    let fibers = rough(along * 4.0, (across + bend + warp) * 70.0, own);
    let rings = rough(along * 1.2, (across + bend + warp) * 18.0, own ^ 2);
    let mut tone = 0.55 + 0.45 * fibers + 0.45 * rings;
    if unit(seed(4)) < 0.6 {
        tone *= 1.0 - 0.65 * within(from_knot, size, 0.5 * size);
    }
    toned(base, tone)
}

/// Returns planks 12 cm wide, each different from its neighbors.
fn boards([x, y]: [f64; 2], own: u64) -> Color {
    const WIDTH: f64 = 0.12;
    const LENGTH: f64 = 1.1;
    let row = (y / WIDTH).floor();
    let shifted = x + LENGTH * unit([row as i64 as u64, 5, own]);
    let plank = hashed([row as i64 as u64, (shifted / LENGTH).floor() as i64 as u64, own]);
    let tone = 0.75 + 0.5 * unit([plank, 1, 1]);
    let color = toned(wood([shifted, y], plank, [0.4, 0.25, 0.13]), tone);
    let from_side = |x: f64, side: f64| {
        let share = x / side - (x / side).floor();
        share.min(1.0 - share) * side
    };
    let gap = within(from_side(y, WIDTH), 0.0025, 0.002).max(within(
        from_side(shifted, LENGTH),
        0.0025,
        0.002,
    ));
    toned(color, 1.0 - 0.7 * gap)
}

fn fabric([x, y]: [f64; 2], own: u64, base: Color) -> Color {
    let weave = of_cell(x * 160.0, y * 160.0, own);
    let knots = rough(x * 28.0, y * 28.0, own ^ 1);
    let worn = rough(x * 5.0, y * 5.0, own ^ 2);
    toned(base, 0.5 + 0.25 * weave + 0.6 * knots + 0.35 * worn)
}

/// Returns tiles of one of several shapes in three colors.
fn pattern([x, y]: [f64; 2], part: u64) -> Color {
    const DYES: [Color; 8] = [
        [0.5, 0.1, 0.07],
        [0.08, 0.15, 0.35],
        [0.62, 0.53, 0.36],
        [0.1, 0.28, 0.2],
        [0.6, 0.35, 0.06],
        [0.7, 0.66, 0.58],
        [0.06, 0.06, 0.08],
        [0.36, 0.17, 0.32],
    ];
    let dye = |at: u64| one_of(&DYES, [part, at, 11]);
    let side = 0.05 + 0.07 * unit([part, 2, 12]);
    let (i, j) = ((x / side).floor(), (y / side).floor());
    let (dx, dy) = (x / side - i - 0.5, y / side - j - 0.5);
    let which = hashed([i as i64 as u64, j as i64 as u64, part]);
    let from = match which % 4 {
        0 => (dx * dx + dy * dy).sqrt(),
        1 => dx.abs() + dy.abs(),
        2 => dx.abs().max(dy.abs()),
        _ => (dx + dy).abs(),
    };
    let size = 0.15 + 0.25 * unit([which, 1, 1]);
    let ring = within(from - size, 0.05, 0.04);
    let inner = within(from, size, 0.04);
    let ground = mixed(dye(0), dye(1), f64::from(u8::from((i + j) as i64 % 2 == 0)));
    let color = mixed(mixed(ground, dye(2 + which % 2), inner), dye(4), ring);
    toned(
        color,
        0.75 + 0.3 * of_cell(x * 220.0, y * 220.0, part) + 0.2 * rough(x * 9.0, y * 9.0, part),
    )
}

fn leaf([s, t]: [f64; 2], own: u64) -> Color {
    let green = mixed([0.1, 0.3, 0.06], [0.25, 0.42, 0.1], unit([own, 1, 1]));
    let rib = within(t - 0.5, 0.05, 0.04);
    let vein = (s * 7.0 + (t - 0.5).abs() * 4.0).fract();
    let veins = within(vein - 0.5, 0.1, 0.1);
    let tone = 0.55 + 0.6 * rough(s * 4.0, t * 4.0, own);
    toned(green, tone * (1.0 + 0.6 * rib + 0.3 * veins))
}

/// Returns trees in front of a sky.
fn outside([s, t]: [f64; 2], own: u64) -> Color {
    let crowns = 0.32 + 0.3 * rough(t * 3.0, 0.0, own);
    let tree = within(s, crowns + 0.06 * (rough(s * 12.0, t * 12.0, own) - 0.5), 0.03);
    let sky = mixed([0.8, 0.88, 0.95], [0.5, 0.7, 0.95], s);
    mixed(sky, toned([0.2, 0.32, 0.14], 0.5 + rough(s * 14.0, t * 14.0, own ^ 1)), tree)
}
