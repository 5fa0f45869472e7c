//! Comparison of protected descriptors by words in common. Subspaces are compared by the attacker's guess.

use super::compare::Likeness;
use crate::Descriptors;
use crate::protected::{ProtectedDescriptors, Rule};
use crate::simd::BLOCK;

/// Compares sets of words by the log likelihood that both were drawn for one word, against independent words.
///
/// A word is `exp(epsilon)` times as likely in the set of its own descriptor. With frequencies `p` of the words, the ratio of a pair
/// is `(1 + E p(A) + E p(B) + E^2 p(A and B)) / ((1 + E p(A)) (1 + E p(B)))`, `E = exp(epsilon) - 1`.
pub struct Shared {
    m: usize,
    gain: f64,
    frequency: Vec<f64>,
}

impl Shared {
    /// Estimates the frequencies of words from the released sets.
    pub fn new(protected: &ProtectedDescriptors) -> Option<Self> {
        let Rule::Words { m, epsilon } = protected.rule() else { return None };
        let n_words = protected.public()?.len();
        let (k, size) = (n_words as f64, m as f64);
        // Probability that a set contains its own word, and any other.
        let own = 1.0 / (1.0 + (k - size) / size * libm::exp(-epsilon));
        let other = (size - own) / (k - 1.0).max(1.0);
        let mut counted = vec![0.0; n_words];
        for word in protected.rows().rows().flatten() {
            counted[word as usize] += 1.0 / protected.len() as f64;
        }
        // At least a tenth of a uniform frequency: estimates of rare words may be negative.
        let least = 0.1 / k;
        let of = |share: f64| ((share - other) / (own - other).max(1e-9)).clamp(least, 1.0);
        let mut frequency: Vec<f64> = counted.into_iter().map(of).collect();
        let sum: f64 = frequency.iter().sum();
        frequency.iter_mut().for_each(|x| *x /= sum);
        Some(Self { m, gain: libm::exp(epsilon.min(40.0)) - 1.0, frequency })
    }
}

/// Words of [`BLOCK`] sets, `m` each, and the sum of their frequencies.
pub struct Sets {
    words: Vec<u32>,
    sums: Vec<f64>,
}

impl Likeness for Shared {
    const NAME: &'static str = "protected";
    const STEP: f32 = 1.0 / 1_024.0;
    type Block = Sets;

    fn block(&self, descriptors: &Descriptors, slots: &[u32]) -> Sets {
        let mut row = vec![0.0; self.m];
        let mut words = vec![u32::MAX; BLOCK * self.m];
        let mut sums = vec![0.0; BLOCK];
        for (at, &slot) in slots.iter().enumerate() {
            descriptors.read_row(slot as usize, &mut row);
            for (to, &word) in words[at * self.m..].iter_mut().zip(&row) {
                *to = word as u32;
                sums[at] += self.frequency[word as usize];
            }
        }
        Sets { words, sums }
    }

    fn scores(&self, a: &Sets, b: &Sets, scores: &mut [f32]) {
        let gain = self.gain;
        for i in 0..BLOCK {
            let own = &a.words[i * self.m..][..self.m];
            for j in 0..BLOCK {
                let other = &b.words[j * self.m..][..self.m];
                // Both are ascending.
                let (mut at, mut shared) = (0, 0.0);
                for word in own {
                    while at < self.m && other[at] < *word {
                        at += 1;
                    }
                    if at < self.m && other[at] == *word && *word != u32::MAX {
                        shared += self.frequency[*word as usize];
                    }
                }
                let (p, q) = (gain * a.sums[i], gain * b.sums[j]);
                let ratio = (1.0 + p + q + gain * gain * shared) / ((1.0 + p) * (1.0 + q));
                scores[i * BLOCK + j] = libm::log(ratio) as f32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::descriptors::Values;
    use crate::seed::{Draws, Stage};

    #[test]
    fn sets_with_a_rare_word_in_common_are_likeliest() {
        let mut draws = Draws::new(1, Stage::Shapes, 0);
        let words = (0..32 * 4).map(|_| draws.normal() as f32).collect();
        let words = crate::Descriptors::try_new(Values::F32(words), 4).unwrap();
        let words = std::sync::Arc::new(words);
        let of = |rows| {
            let rule = Rule::Words { m: 2, epsilon: 4.0 };
            ProtectedDescriptors::try_new(rule, rows, Some(words.clone()), false)
        };
        // Word 0 is frequent.
        let rows = [[0, 1], [0, 2], [0, 3], [0, 4], [0, 5], [6, 7], [6, 8], [9, 10]];
        let made = of(rows.iter().map(|row| row.map(|x| x as f32).to_vec()).collect()).unwrap();
        let shared = Shared::new(&made).unwrap();
        let block = shared.block(made.rows(), &(0..rows.len() as u32).collect::<Vec<_>>());
        let mut scores = vec![0.0; BLOCK * BLOCK];
        shared.scores(&block, &block, &mut scores);
        let score = |i: usize, j: usize| scores[i * BLOCK + j];
        let [rare, frequent, none] = [score(5, 6), score(0, 1), score(0, 7)];
        assert!(rare > frequent && frequent > none, "{rare} {frequent} {none}");
        assert_eq!(score(0, 5), score(5, 0));
        let error = of(vec![vec![1.0, 32.0]]).unwrap_err().to_string();
        assert_eq!(error, "protected descriptors: expected words below 32, found 32");
    }
}
