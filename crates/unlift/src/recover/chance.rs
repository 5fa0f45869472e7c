//! How improbable an agreement is by chance (the evidence that decides between positions).
//!
//! Of `k` listed records `n` support a position, while of `m` null records `c` do. A wrong position
//! gets Bin(k, p) votes with p about `(c + 1/2) / (m + 1)`, never 0. The evidence is the Chernoff
//! bound on the tail, `k KL(n/k || p)` nats: it orders as the tail does, and splits into logarithms
//! of integers, so four small tables replace one table per `k`.

/// Tables of logarithms for lists of up to `longest` records and null samples of `m`.
#[derive(Clone, Debug)]
pub(crate) struct Chance {
    ln: Vec<f32>,
    ln_p: Vec<f32>,
    ln_not_p: Vec<f32>,
}

impl Chance {
    /// Tables for up to `longest` listed and exactly `m` null records.
    pub(crate) fn new(longest: usize, m: usize) -> Self {
        let p = |c: usize| (c as f64 + 0.5) / (m as f64 + 1.0);
        Self {
            ln: (0..=longest).map(|n| libm::log(n.max(1) as f64) as f32).collect(),
            ln_p: (0..=m).map(|c| libm::log(p(c)) as f32).collect(),
            ln_not_p: (0..=m).map(|c| libm::log(1.0 - p(c)) as f32).collect(),
        }
    }

    /// Evidence in nats that `n` of `k` listed records agree although `c` of the null records do; 0
    /// when chance alone would give as many.
    #[inline(always)]
    pub(crate) fn evidence(&self, n: usize, k: usize, c: usize) -> f32 {
        let m1 = self.ln_p.len() as f32;
        if n == 0 || (n as f32) * m1 <= (c as f32 + 0.5) * (k as f32) {
            return 0.0;
        }
        let missed = k - n;
        let ln_k = self.ln[k];
        let evidence = n as f32 * (self.ln[n] - ln_k - self.ln_p[c])
            + missed as f32 * (self.ln[missed] - ln_k - self.ln_not_p[c]);
        // Just above chance the two terms cancel up to rounding.
        evidence.max(0.0)
    }

    /// What decides between positions: evidence plus the logarithm of the prior. A point is likelier
    /// to lie where the map is dense, and `p` itself measures density (without this, the empty
    /// parts of a map, where two votes are already improbable, win too often).
    ///
    /// Falls as `c` grows, until agreement is no more than chance; never above 0 from there on.
    #[inline(always)]
    pub(crate) fn score(&self, n: usize, k: usize, c: usize) -> f32 {
        self.evidence(n, k, c) + self.ln_p[c]
    }
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
        let chance = Chance::new(50, 100);
        for (n, c) in [(26, 40), (4, 0), (10, 3), (50, 20), (1, 0)] {
            let p = (c as f64 + 0.5) / 101.0;
            let evidence = f64::from(chance.evidence(n, 50, c));
            // Chernoff: P(X >= n) <= exp(-k KL); tight up to a polynomial factor.
            assert!(evidence <= -ln_tail(n, 50, p) + 1e-3, "n {n} c {c}");
            assert!(evidence >= -ln_tail(n, 50, p) - 4.0, "n {n} c {c}");
        }
        // 26 votes where 20 are expected are far likelier than 4 where 0.25 are.
        assert!(chance.evidence(26, 50, 40) < chance.evidence(4, 50, 0));
    }

    #[test]
    fn no_evidence_at_or_below_chance() {
        let chance = Chance::new(50, 100);
        assert_eq!(chance.evidence(0, 50, 0), 0.0);
        assert_eq!(chance.evidence(10, 50, 20), 0.0);
    }
}
