//! A place made anew: least squares to the records of the neighbors found near it.

use crate::recover::joint::votes::Columns;
use crate::recover::map::lines::{LANES, Lanes};
use crate::recover::map::pieces::{Piece, Pieces};
use crate::recover::map::places::Places;

/// Least squares steps: the second one weighs neighbors from where the first one led.
const STEPS: usize = 2;

/// The directions of the pieces that neighbors lie on, in columns.
pub(crate) type Directions<const D: usize> = [Vec<f32>; D];

/// Makes `directions` those of the slots of `near`, padded as it is.
#[inline(always)]
fn gather<const D: usize, P: Pieces<D>>(
    directions: &mut Directions<D>,
    (pieces, places): (&P, &Places<D>),
    near: &Columns<D>,
) {
    let n = near.len();
    for column in &mut *directions {
        column.resize(n.next_multiple_of(LANES), 0.0);
    }
    let mut columns = directions.each_mut().map(|column| &mut column[..]);
    for i in 0..n {
        let slot = near.slot(i);
        let direction = pieces.direction(slot, places.piece(slot));
        for (column, along) in columns.iter_mut().zip(direction) {
            column[i] = along;
        }
    }
    for column in &mut columns {
        column[n..].fill(0.0);
    }
}

/// Sums over neighbors near a place, each weighted by how near it is; one per lane.
#[derive(Clone, Copy)]
struct Sums<const D: usize> {
    n: [u32; LANES],
    weight: Lanes,
    /// Differences to the place, and their parts along the directions of the neighbors' pieces.
    pull: [Lanes; D],
    free_pull: [Lanes; D],
    /// Products of the coordinates of these directions; the upper half of a symmetric matrix.
    free: [[Lanes; D]; D],
}

impl<const D: usize> Sums<D> {
    const ZERO: Self = Self {
        n: [0; LANES],
        weight: [0.0; LANES],
        pull: [[0.0; LANES]; D],
        free_pull: [[0.0; LANES]; D],
        free: [[[0.0; LANES]; D]; D],
    };

    /// Over the neighbors of `near` within `1 / sqrt(inverse_kernel2)` of `x`.
    #[inline(always)]
    fn new(
        near: &Columns<D>,
        directions: &Directions<D>,
        x: &[f32; D],
        inverse_kernel2: f32,
        (gain, inverse_a2): (f32, f32),
        doubt: f32,
    ) -> Self {
        let mut sums = Self::ZERO;
        let places = near.vectors();
        let odds = near.odds();
        let directions: [&[Lanes]; D] =
            std::array::from_fn(|c| &directions[c].as_chunks().0[..places[0].len()]);
        for i in 0..places[0].len() {
            for lane in 0..LANES {
                let away: [f32; D] = std::array::from_fn(|c| places[c][i][lane] - x[c]);
                let toward: [f32; D] = std::array::from_fn(|c| directions[c][i][lane]);
                let (mut r2, mut along) = (0.0, 0.0);
                for c in 0..D {
                    r2 += away[c] * away[c];
                    along += toward[c] * away[c];
                }
                let closeness = (1.0 - r2 * inverse_kernel2).max(0.0);
                let q = 1.0 / (1.0 + r2 * inverse_a2);
                let likelier = odds[i][lane] * gain * (q * q * q);
                sums.n[lane] += u32::from(closeness > 0.0);
                // What is near by chance does not hold: on a small map half of everything is near.
                let closeness = closeness * likelier / (doubt + likelier);
                sums.weight[lane] += closeness;
                for r in 0..D {
                    let held = closeness * toward[r];
                    sums.pull[r][lane] += closeness * away[r];
                    sums.free_pull[r][lane] += held * along;
                    for (c, toward) in toward.iter().enumerate().skip(r) {
                        sums.free[r][c][lane] += held * toward;
                    }
                }
            }
        }
        sums
    }
}

#[inline(always)]
fn total(lanes: &Lanes) -> f32 {
    lanes.iter().sum()
}

/// `x` moved along `own` to the least squares of the records of near neighbors, weighted by how near their
/// estimates are: within `1 / sqrt(inverse_kernel2)`. Estimates hold fully across their own pieces, and
/// a little along them. With it the number of these records. `at` tells kernel, law and doubt at a place.
#[inline(always)]
pub(crate) fn refined<const D: usize, P: Pieces<D>>(
    pieces: &P,
    places: &Places<D>,
    own: &Piece<D>,
    (near, directions): (&mut Columns<D>, &mut Directions<D>),
    mut x: [f32; D],
    at: impl Fn(&[f32; D]) -> (f32, (f32, f32), f32),
) -> ([f32; D], u32) {
    gather(directions, (pieces, places), near);
    let mut records = 0;
    for step in 1..=STEPS {
        let (inverse_kernel2, law, doubt) = at(&x);
        let sums = Sums::new(near, directions, &x, inverse_kernel2, law, doubt);
        let n: u32 = sums.n.iter().sum();
        if step == STEPS {
            records = n;
            if pieces.slots_per_record() > 1 {
                records = near.n_records(pieces.slots_per_record(), &x, inverse_kernel2);
            }
        }
        x = own.project(&moved::<D, P>(own, &x, &sums, n));
    }
    (x, records)
}

/// One step of least squares.
#[inline(always)]
fn moved<const D: usize, P: Pieces<D>>(
    own: &Piece<D>,
    x: &[f32; D],
    sums: &Sums<D>,
    n: u32,
) -> [f32; D] {
    let weight = total(&sums.weight);
    let mut pull = sums.pull.map(|lanes| total(&lanes));
    // The part of neighbors that is free along their pieces: lines, or all but the normals of planes.
    let (whole, sign) = if P::NORMAL { (1.0, -1.0) } else { (0.0, 1.0) };
    let free_share = 1.0 - P::MOST_ALONG.min(P::ALONG / n.max(1) as f32);
    let mut hold = [[0.0f32; D]; D];
    for (r, row) in hold.iter_mut().enumerate() {
        for (c, value) in row.iter_mut().enumerate() {
            let free = sign * total(&sums.free[r.min(c)][r.max(c)]);
            *value = -free_share * if r == c { free + whole * weight } else { free };
        }
        row[r] += weight;
        pull[r] -= free_share * (whole * pull[r] + sign * total(&sums.free_pull[r]));
    }
    solve_within(own, x, &hold, &pull, weight)
}

/// `x` plus the step along `own` that solves `hold step = pull` within it.
#[inline(always)]
fn solve_within<const D: usize>(
    own: &Piece<D>,
    x: &[f32; D],
    hold: &[[f32; D]; D],
    pull: &[f32; D],
    weight: f32,
) -> [f32; D] {
    // P hold P + weight (1 - P): the part across the piece is decoupled and stays 0.
    let p = &own.along;
    let (mut half, mut full, mut right) = ([[0.0f32; D]; D], [[0.0f32; D]; D], [0.0f32; D]);
    for r in 0..D {
        for c in 0..D {
            for k in 0..D {
                half[r][c] += p[r][k] * hold[k][c];
            }
            right[r] += p[r][c] * pull[c];
        }
    }
    for r in 0..D {
        for c in 0..D {
            for k in 0..D {
                full[r][c] += half[r][k] * p[k][c];
            }
            full[r][c] -= weight * p[r][c];
        }
        full[r][r] += weight;
    }
    if !solve_symmetric(&mut full, &mut right) {
        return *x;
    }
    std::array::from_fn(|c| x[c] + right[c])
}

// Systems of two or three equations.

/// Solves `a x = b` for a symmetric positive `a`; `b` becomes `x`. `false` when it is singular.
#[inline(always)]
pub(crate) fn solve_symmetric<const D: usize>(a: &mut [[f32; D]; D], b: &mut [f32; D]) -> bool {
    for i in 0..D {
        if a[i][i] <= 0.0 || a[i][i].is_nan() {
            return false;
        }
        for r in i + 1..D {
            let f = a[r][i] / a[i][i];
            let pivot = a[i];
            for (value, p) in a[r].iter_mut().zip(&pivot).skip(i) {
                *value -= f * p;
            }
            b[r] -= f * b[i];
        }
    }
    for i in (0..D).rev() {
        for c in i + 1..D {
            b[i] -= a[i][c] * b[c];
        }
        b[i] /= a[i][i];
    }
    true
}
