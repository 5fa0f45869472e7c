//! Printed surfaces: spines, covers, posters, packages.

use crate::color::{Color, mixed, one_of, toned, within};
use crate::noise::{of_cell, rough, unit};

const INKS: [Color; 10] = [
    [0.55, 0.08, 0.06],
    [0.06, 0.16, 0.4],
    [0.7, 0.6, 0.12],
    [0.07, 0.3, 0.16],
    [0.72, 0.7, 0.64],
    [0.05, 0.05, 0.06],
    [0.6, 0.3, 0.08],
    [0.3, 0.1, 0.32],
    [0.2, 0.45, 0.55],
    [0.66, 0.44, 0.4],
];

const SHAPES: u64 = 11;

/// Returns the color at `(x, y)`, in meters from the corner of a print with these sides. `x` goes
/// up spines and posters.
pub(crate) fn print([x, y]: [f64; 2], sides: [f64; 2], own: u64) -> Color {
    let ink = |at: u64| one_of(&INKS, [own, at, 21]);
    let shade = 0.8 + 0.4 * rough(x * 16.0, y * 16.0, own);
    let mut color = toned(mixed(ink(0), ink(1), 0.6 * x / sides[0]), shade);
    let large = sides[0].min(sides[1]);
    for shape in 0..SHAPES {
        let of = |at: u64| unit([own, shape, 30 + at]);
        let (dx, dy) = (x - of(1) * sides[0], y - of(2) * sides[1]);
        let size = large * (0.05 + 0.3 * of(3) * of(3));
        let from = match (of(4) * 4.0) as u32 {
            0 => (dx * dx + dy * dy).sqrt(),
            1 => dx.abs().max(2.0 * dy.abs()),
            2 => dx.abs() + dy.abs(),
            _ => (dx + (2.0 * of(5) - 1.0) * dy).abs() * 4.0,
        };
        color = mixed(color, toned(ink(2 + shape), shade), within(from, size, 0.0015));
    }
    lettered(color, [x, y], sides, own, ink(3))
}

/// Adds lines of letter-like marks to a part of the print.
fn lettered(ground: Color, [x, y]: [f64; 2], sides: [f64; 2], own: u64, ink: Color) -> Color {
    let of = |at: u64| unit([own, at, 50]);
    let large = sides[0].min(sides[1]);
    let high = (0.12 * large).clamp(0.006, 0.03) * (0.7 + 0.6 * of(1));
    // Letters run along spines, but across other prints.
    let (run, line, length, lines) = match sides[0] > 3.0 * sides[1] {
        true => (x, y, sides[0], sides[1]),
        false => (y, x, sides[1], sides[0]),
    };
    let (first, last) = (0.1 + 0.3 * of(2), 0.6 + 0.3 * of(3));
    let block = line / lines;
    if run < 0.1 * length || run > 0.9 * length || block < 0.15 || block > 0.25 + 0.6 * of(4) {
        return ground;
    }
    let row = (line / high).floor();
    let in_row = line / high - row;
    if run / length < first - 0.2 || run / length > last + 0.2 || !(0.2..0.8).contains(&in_row) {
        return ground;
    }
    // Strokes are cells of a third of a letter, about half of them inked. Gaps separate words.
    let stroke = of_cell(run / (0.25 * high), line / (0.3 * high), own ^ 3);
    let word = of_cell(run / (1.6 * high), row, own ^ 4);
    match stroke < 0.55 && word < 0.8 {
        true => ink,
        false => ground,
    }
}
