//! Maximum likelihood of errors within thresholds.

use nalgebra::{DMatrix, DVector};
use unlift::recover::{Cues, N_TERMS};

/// One slot: its cues and its true error, in typical radii of crowds.
pub struct Row {
    pub cues: Cues,
    pub error: f64,
    /// Typical distance of the K-th neighbor.
    pub typical: f64,
}

/// Fitted weights of one model.
pub struct Fitted {
    pub n: usize,
    pub loss: f64,
    pub found: Vec<f32>,
    pub scale: Vec<f32>,
}

/// Thresholds, in typical distances of the K-th neighbor.
const THRESHOLDS: [f64; 5] = [0.4, 0.7, 1.0, 1.5, 2.5];
/// Ridge penalty of weights, per row and threshold.
const RIDGE: f64 = 1e-5;
const STEPS: usize = 40;
/// Minimum distance of probabilities from 0 and 1.
const MARGIN: f64 = 1e-6;

struct Prepared {
    terms: [f32; N_TERMS],
    /// For each threshold, its logarithm and whether the error is within it.
    within: [(f64, bool); THRESHOLDS.len()],
}

/// Returns the maximum likelihood weights for the errors of `rows`, starting from zero.
pub fn fit(rows: &[Row], terms: impl Fn(&Cues) -> [f32; N_TERMS]) -> Fitted {
    let prepare = |row: &Row| Prepared {
        terms: terms(&row.cues),
        within: THRESHOLDS.map(|t| (libm::log(t * row.typical), row.error <= t * row.typical)),
    };
    let rows: Vec<Prepared> = rows.iter().map(prepare).collect();
    let mut weights = DVector::<f64>::zeros(2 * N_TERMS);
    let mut damping = 1e-3;
    let mut now = loss(&rows, &weights);
    for _ in 0..STEPS {
        let (gradient, information) = newton(&rows, &weights);
        let mut gained = 0.0;
        while damping < 1e6 {
            let mut damped = information.clone();
            for t in 0..2 * N_TERMS {
                damped[(t, t)] += damping * information[(t, t)] + 1e-12;
            }
            if let Some(cholesky) = damped.cholesky() {
                let next = &weights + cholesky.solve(&gradient);
                let then = loss(&rows, &next);
                if then < now {
                    gained = now - then;
                    (weights, now) = (next, then);
                    damping = (damping / 5.0).max(1e-6);
                    break;
                }
            }
            damping *= 10.0;
        }
        if gained < 1e-7 {
            break;
        }
    }
    let rounded =
        |from: usize| weights.iter().skip(from).take(N_TERMS).map(|&w| w as f32).collect();
    Fitted { n: rows.len(), loss: now, found: rounded(0), scale: rounded(N_TERMS) }
}

/// Returns the probability of the right place, and the conditional probabilities of an error within
/// each threshold.
fn parts(row: &Prepared, weights: &DVector<f64>) -> (f64, [f64; THRESHOLDS.len()]) {
    let (mut logit, mut ln_scale) = (0.0, 0.0);
    for (t, &x) in row.terms.iter().enumerate() {
        logit += f64::from(x) * weights[t];
        ln_scale += f64::from(x) * weights[N_TERMS + t];
    }
    let sigmoid = |z: f64| 1.0 / (1.0 + libm::exp(-z.clamp(-30.0, 30.0)));
    (sigmoid(logit), row.within.map(|(ln_t, _)| sigmoid(2.0 * (ln_t - ln_scale))))
}

fn probability(found: f64, within: f64) -> f64 {
    (found * within).clamp(MARGIN, 1.0 - MARGIN)
}

fn loss(rows: &[Prepared], weights: &DVector<f64>) -> f64 {
    let mut sum = 0.0;
    for row in rows {
        let (found, within) = parts(row, weights);
        for (given, (_, is_within)) in within.into_iter().zip(row.within) {
            let p = probability(found, given);
            sum -= libm::log(if is_within { p } else { 1.0 - p });
        }
    }
    sum / (rows.len() * THRESHOLDS.len()) as f64 + 0.5 * RIDGE * weights.norm_squared()
}

/// Returns the gradient of the log-likelihood and its expected information.
fn newton(rows: &[Prepared], weights: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
    let scale = 1.0 / (rows.len() * THRESHOLDS.len()) as f64;
    let mut gradient = -RIDGE * weights;
    let mut blocks = vec![[0.0f64; 3]; N_TERMS * N_TERMS];
    for row in rows {
        let (found, within) = parts(row, weights);
        let (mut slope, mut bend) = ([0.0; 2], [0.0; 3]);
        for (given, (_, is_within)) in within.into_iter().zip(row.within) {
            let p = probability(found, given);
            let by = [given * found * (1.0 - found), -2.0 * found * given * (1.0 - given)];
            let weight = scale / (p * (1.0 - p));
            let miss = f64::from(u8::from(is_within)) - p;
            slope = [slope[0] + weight * miss * by[0], slope[1] + weight * miss * by[1]];
            bend[0] += weight * by[0] * by[0];
            bend[1] += weight * by[0] * by[1];
            bend[2] += weight * by[1] * by[1];
        }
        for r in 0..N_TERMS {
            let x = f64::from(row.terms[r]);
            gradient[r] += slope[0] * x;
            gradient[N_TERMS + r] += slope[1] * x;
            for c in 0..=r {
                let xx = x * f64::from(row.terms[c]);
                let block = &mut blocks[r * N_TERMS + c];
                (0..3).for_each(|b| block[b] += bend[b] * xx);
            }
        }
    }
    let information = DMatrix::from_fn(2 * N_TERMS, 2 * N_TERMS, |r, c| {
        let (tr, tc) = (r % N_TERMS, c % N_TERMS);
        let block = blocks[tr.max(tc) * N_TERMS + tr.min(tc)];
        let which = usize::from(r >= N_TERMS) + usize::from(c >= N_TERMS);
        block[which] + if r == c { RIDGE } else { 0.0 }
    });
    (gradient, information)
}
