//! How improbable an agreement is by chance (the evidence that decides between positions).
//!
//! Of `k` listed records `n` support a position, while a random one does with chance `p`. A wrong
//! position gets Bin(k, p) votes. The evidence is the Chernoff bound on the tail, `k KL(n/k || p)` nats:
//! it orders as the tail does, and has no branches.

use super::lanes::ln;

/// The chance that a random record agrees is taken for at most this: beyond, a density is no probability.
pub(crate) const MOST_CHANCE: f32 = 0.5;

/// Evidence in nats that `n` of `k` listed records agree where a random one does with probability
/// `p`, above 0 and below 1; 0 when chance alone would give as many.
#[inline(always)]
pub(crate) fn evidence(n: f32, k: f32, p: f32) -> f32 {
    let missed = k - n;
    // The logarithm of 0 is some number here, and counts for nothing.
    let evidence = n * (ln(n) - ln(k * p)) + missed * (ln(missed) - ln(k * (1.0 - p)));
    // Just above chance the two terms cancel up to rounding.
    if n <= p * k { 0.0 } else { evidence.max(0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ln P(X >= n) for X ~ Bin(k, p), by summation.
    fn ln_tail(n: usize, k: usize, p: f64) -> f64 {
        let mut term = (1.0 - p).powi(k as i32);
        let mut tail = 0.0;
        for x in 0..=k {
            if x >= n {
                tail += term;
            }
            term *= (k - x) as f64 / (x + 1) as f64 * p / (1.0 - p);
        }
        tail.ln()
    }

    #[test]
    fn evidence_bounds_the_binomial_tail_and_orders_like_it() {
        for (n, p) in [(26, 0.4), (4, 0.005), (10, 0.035), (50, 0.2), (1, 0.005), (49, 0.5)] {
            let evidence = f64::from(evidence(n as f32, 50.0, p as f32));
            // Chernoff: P(X >= n) <= exp(-k KL); tight up to a polynomial factor.
            assert!(evidence <= -ln_tail(n, 50, p) + 1e-3, "n {n} p {p}");
            assert!(evidence >= -ln_tail(n, 50, p) - 4.0, "n {n} p {p}");
        }
        // 26 votes where 20 are expected are far likelier than 4 where 0.25 are.
        assert!(evidence(26.0, 50.0, 0.4) < evidence(4.0, 50.0, 0.005));
    }

    #[test]
    fn evidence_is_near_the_exact_bound() {
        for k in [1, 2, 7, 20, 50, 100, 400] {
            for n in 0..=k {
                for p in [1e-6, 1e-4, 0.005, 0.03, 0.2, f64::from(MOST_CHANCE)] {
                    let share = n as f64 / k as f64;
                    let term = |x: f64, y: f64| if x > 0.0 { x * (x / y).ln() } else { 0.0 };
                    let exact = k as f64 * (term(share, p) + term(1.0 - share, 1.0 - p));
                    let exact = if share <= p { 0.0 } else { exact };
                    let found = f64::from(evidence(n as f32, k as f32, p as f32));
                    assert!((found - exact).abs() <= 2e-3, "{n} of {k} at {p}: {found}, {exact}");
                }
            }
        }
    }

    #[test]
    fn no_evidence_at_or_below_chance() {
        assert_eq!(evidence(0.0, 50.0, 0.005), 0.0);
        assert_eq!(evidence(10.0, 50.0, 0.2), 0.0);
    }
}
