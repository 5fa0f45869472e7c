//! How improbable an agreement is by chance (the evidence that decides between positions).
//!
//! Of `k` listed records `n` support a position, while a random one does with chance `p`. A wrong
//! position gets Bin(k, p) votes. The evidence is the Chernoff
//! bound on the tail, `k KL(n/k || p)` nats: it orders as the tail does, and splits into logarithms
//! of integers, so four small tables replace one table per `k`.

/// What lists of up to so many records need to weigh agreement.
#[derive(Clone, Debug)]
pub(crate) struct Improbability {
    ln: Vec<f32>,
}

/// The chance that a random record agrees with a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chance {
    /// The probability.
    pub(crate) p: f32,
    /// Its logarithm.
    pub(crate) ln_p: f32,
}

impl Improbability {
    /// Tables for up to `longest` listed records.
    pub(crate) fn new(longest: usize) -> Self {
        Self { ln: (0..=longest).map(|n| libm::log(n.max(1) as f64) as f32).collect() }
    }

    /// Evidence in nats that `n` of `k` listed records agree; 0 when chance alone would give as many.
    #[inline(always)]
    pub(crate) fn evidence(&self, n: usize, k: usize, chance: Chance) -> f32 {
        if n as f32 <= chance.p * k as f32 {
            return 0.0;
        }
        let missed = k - n;
        let ln_k = self.ln[k];
        let evidence = n as f32 * (self.ln[n] - ln_k - chance.ln_p)
            + missed as f32 * (self.ln[missed] - ln_k - ln_not(chance.p));
        // Just above chance the two terms cancel up to rounding.
        evidence.max(0.0)
    }
}

/// `ln(1 - p)` for `p` up to a half, to 1e-5.
#[inline(always)]
fn ln_not(p: f32) -> f32 {
    let z = p / (2.0 - p);
    let z2 = z * z;
    -2.0 * z * (1.0 + z2 * (1.0 / 3.0 + z2 * (0.2 + z2 / 7.0)))
}

/// Evidence in nats that `n` of `k` listed records agree where a random one does with probability
/// `p`, for chances that are known exactly.
#[inline(always)]
pub(crate) fn evidence(n: usize, k: usize, p: f32) -> f32 {
    let (hits, all) = (n as f32, k as f32);
    if hits <= p * all {
        return 0.0;
    }
    let missed = all - hits;
    let miss_term =
        if missed > 0.0 { missed * libm::logf(missed / (all * (1.0 - p))) } else { 0.0 };
    (hits * libm::logf(hits / (all * p)) + miss_term).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chance(p: f64) -> Chance {
        Chance { p: p as f32, ln_p: p.ln() as f32 }
    }

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
        let improbability = Improbability::new(50);
        for (n, p) in [(26, 0.4), (4, 0.005), (10, 0.035), (50, 0.2), (1, 0.005), (49, 0.5)] {
            let of_tables = f64::from(improbability.evidence(n, 50, chance(p)));
            let evidence = f64::from(evidence(n, 50, p as f32));
            assert!((evidence - of_tables).abs() < 2e-3, "n {n} p {p}: {evidence} {of_tables}");
            // Chernoff: P(X >= n) <= exp(-k KL); tight up to a polynomial factor.
            assert!(evidence <= -ln_tail(n, 50, p) + 1e-3, "n {n} p {p}");
            assert!(evidence >= -ln_tail(n, 50, p) - 4.0, "n {n} p {p}");
        }
        // 26 votes where 20 are expected are far likelier than 4 where 0.25 are.
        let of = |n, p| improbability.evidence(n, 50, chance(p));
        assert!(of(26, 0.4) < of(4, 0.005));
    }

    #[test]
    fn no_evidence_at_or_below_chance() {
        let improbability = Improbability::new(50);
        assert_eq!(improbability.evidence(0, 50, chance(0.005)), 0.0);
        assert_eq!(improbability.evidence(10, 50, chance(0.2)), 0.0);
        assert_eq!(evidence(10, 50, 0.2), 0.0);
    }
}
