//! The last step of an update: weighted least squares over the estimates of nearby neighbors.

use crate::recover::joint::update::Context;
use crate::recover::joint::votes::Near;
use crate::recover::map::{Columns, Family, LANES, Lanes, Piece};

/// Estimates within this many radii count, with less weight the farther they are.
const RADIUS: f32 = 3.75;
/// Number of least-squares steps. The second one recomputes the weights.
const STEPS: usize = 2;

/// Weighted sums over nearby neighbors, one per vector lane.
#[derive(Clone, Copy)]
struct Sums<const D: usize> {
    n: [u32; LANES],
    weight: Lanes,
    /// Differences to the place, and their components along the directions.
    pull: [Lanes; D],
    free_pull: [Lanes; D],
    /// Outer products of the directions; only the upper triangle is filled.
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

    /// Sums over the neighbors of `near` within `1 / sqrt(inverse_reach2)` of `x`.
    #[inline(always)]
    fn new(
        near: &Near<D>,
        directions: &Columns<D>,
        x: &[f32; D],
        (inverse_reach2, (gain, inverse_a2), half_weight_ratio): (f32, (f32, f32), f32),
    ) -> Self {
        let mut sums = Self::ZERO;
        let odds = near.odds.as_chunks::<LANES>().0;
        let places: [&[Lanes]; D] =
            std::array::from_fn(|c| &near.x.0[c].as_chunks().0[..odds.len()]);
        let directions: [&[Lanes]; D] =
            std::array::from_fn(|c| &directions.0[c].as_chunks().0[..odds.len()]);
        for i in 0..odds.len() {
            for lane in 0..LANES {
                let away: [f32; D] = std::array::from_fn(|c| places[c][i][lane] - x[c]);
                let toward: [f32; D] = std::array::from_fn(|c| directions[c][i][lane]);
                let (mut r2, mut along) = (0.0, 0.0);
                for c in 0..D {
                    r2 += away[c] * away[c];
                    along += toward[c] * away[c];
                }
                let closeness = (1.0 - r2 * inverse_reach2).max(0.0);
                let q = 1.0 / (1.0 + r2 * inverse_a2);
                let likelier = odds[i][lane] * gain * (q * q * q);
                sums.n[lane] += u32::from(closeness > 0.0);
                // Estimates that are close by chance get less weight: on a small map half of all are close.
                let closeness = closeness * likelier / (half_weight_ratio + likelier);
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

impl<const D: usize, F: Family<D>> Context<'_, D, F> {
    /// Moves `x` along `own` by weighted least squares; returns the place and the number of records within reach.
    ///
    /// The residual of a neighbor is the difference to its estimate, with less weight along its own record. `directions` is a buffer.
    #[inline(always)]
    pub(super) fn least_squares(
        &self,
        own: &Piece<D>,
        (near, directions): (&Near<D>, &mut Columns<D>),
        mut x: [f32; D],
    ) -> ([f32; D], u32) {
        let Self { problem, estimates, density: field, neighbors, .. } = self;
        directions.fill(&near.slot, |&slot| {
            let piece = usize::from(estimates[slot as usize].axis);
            problem.family.piece(slot as usize, piece).direction
        });
        directions.resize(near.odds.len(), 0.0);
        let mut records = 0;
        for step_at in 1..=STEPS {
            let density = field.at(&x);
            let reach = RADIUS * neighbors.radius * field.stretch(density);
            let inverse_reach2 = 1.0 / (reach * reach);
            let half_weight_ratio = F::HALF_WEIGHT_RATIO
                * (1.0 + neighbors.background / self.volume(density) / density);
            let weights = (inverse_reach2, self.distribution(density), half_weight_ratio);
            let sums = Sums::new(near, directions, &x, weights);
            let n: u32 = sums.n.iter().sum();
            if step_at == STEPS {
                records = match problem.graph.slots_per_record {
                    1 => n,
                    _ => near.n_pairs(&x, inverse_reach2),
                };
            }
            x = own.project(&step::<D, F>(own, &x, &sums, n));
        }
        (x, records)
    }
}

/// Returns `x` plus the least-squares step along `own`, from the sums over `n` neighbors.
#[inline(always)]
fn step<const D: usize, F: Family<D>>(
    own: &Piece<D>,
    x: &[f32; D],
    sums: &Sums<D>,
    n: u32,
) -> [f32; D] {
    let total = |lanes: &Lanes| lanes.iter().sum::<f32>();
    let weight = total(&sums.weight);
    let mut pull = sums.pull.map(|lanes| total(&lanes));
    // The component along a record: the direction of a line, or all but the normal of a plane.
    let (whole, sign) = if F::IS_PLANE { (1.0, -1.0) } else { (0.0, 1.0) };
    let free_fraction = 1.0 - F::MOST_ALONG.min(F::ALONG / n.max(1) as f32);
    let mut hold = [[0.0f32; D]; D];
    for (r, row) in hold.iter_mut().enumerate() {
        for (c, value) in row.iter_mut().enumerate() {
            let free = sign * total(&sums.free[r.min(c)][r.max(c)]);
            *value = -free_fraction * if r == c { free + whole * weight } else { free };
        }
        row[r] += weight;
        pull[r] -= free_fraction * (whole * pull[r] + sign * total(&sums.free_pull[r]));
    }
    // The step solves `hold step = pull` within the piece: P hold P + weight (1 - P). The component across is decoupled and stays 0.
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

/// Solves `a x = b` for a symmetric positive definite `a`; `b` becomes `x`. Returns `false` if `a` is singular.
#[inline(always)]
fn solve_symmetric<const D: usize>(a: &mut [[f32; D]; D], b: &mut [f32; D]) -> bool {
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
