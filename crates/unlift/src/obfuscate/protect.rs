//! Protection of descriptors: what a map releases in place of plain descriptors.
//!
//! With a scheme it is itself a scheme ([`Changed`](super::Changed)): `ppl_ldp256.2.8`.

use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

use crate::descriptors::Values;
use crate::protected::{MOST_DIRECTIONS, ProtectedDescriptors, Rule, inner, unit_rows};
use crate::seed::{Cipher, Draws, Key, Stage};
use crate::{Descriptors, Error};
use unlift_attack::parallel;

unlift_attack::named! {
    /// Directions of a subspace.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Directions {
        Random = "random",
        /// Towards random entries of the public database.
        Adversarial = "adversarial",
        /// Half towards entries, the others random.
        Hybrid = "hybrid",
    }
}

/// A rule that protects descriptors, and the public descriptors that it uses.
#[derive(Clone, Debug, PartialEq)]
pub struct Protection {
    rule: Rule,
    directions: Directions,
    /// Number of words of the vocabulary; 0 for subspaces.
    n_words: usize,
    public: Option<Arc<Descriptors>>,
    /// Hashes of the rows of the public descriptors.
    known: Arc<HashSet<u64>>,
}

const FORMS: &str = "subspace:M, subspace:M:random, subspace:M:adversarial, subspace:M:hybrid or ldp:WORDS,M,EPSILON";
/// Largest vocabulary: Lloyd's algorithm takes a minute.
const MAX_WORDS: usize = 1 << 14;
/// Number of rounds of Lloyd's algorithm.
const ROUNDS: usize = 20;
/// Largest number of descriptors per word that Lloyd's algorithm reads.
const MAX_PER_WORD: usize = 64;
/// Largest share of the protected descriptors that public ones may equal.
const MAX_OWN: f64 = 0.01;
/// A direction is shorter than this if it lies in the span of the earlier ones.
const SHORTEST: f64 = 1e-6;

impl Protection {
    /// Parses `subspace:2` (hybrid), `subspace:4:adversarial` or `ldp:256,2,8`.
    ///
    /// # Errors
    /// If the text has another form, or a number is out of range.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let wrong = || Error::new("protection", FORMS, text);
        let (name, rest) = text.trim().split_once(':').ok_or_else(wrong)?;
        let found = match name {
            "subspace" => {
                let (m, how) = rest.split_once(':').unwrap_or((rest, "hybrid"));
                let directions = Directions::named(how).ok_or_else(wrong)?;
                let least = if directions == Directions::Hybrid { 2 } else { 1 };
                let m = m.parse().ok().filter(|m| (least..=MOST_DIRECTIONS).contains(m));
                m.map(|m| (Rule::Subspace { m }, directions, 0))
            }
            "ldp" => {
                let parts: Vec<&str> = rest.split(',').map(str::trim).collect();
                let [words, m, epsilon] = parts[..] else { return Err(wrong()) };
                let n_words = words.parse().ok().filter(|n| (2..=MAX_WORDS).contains(n));
                let m = m.parse().ok().filter(|&m: &usize| m > 0 && Some(m) < n_words);
                let epsilon = epsilon.parse().ok().filter(|x: &f64| *x > 0.0 && *x <= 100.0);
                let words = n_words.zip(m).zip(epsilon);
                words.map(|((n, m), epsilon)| (Rule::Words { m, epsilon }, Directions::Random, n))
            }
            _ => None,
        };
        let (rule, directions, n_words) = found.ok_or_else(wrong)?;
        Ok(Self { rule, directions, n_words, public: None, known: Arc::default() })
    }

    /// Returns the name in rows: letters, digits, `_` and `.`.
    pub fn name(&self) -> String {
        match (self.rule, self.directions) {
            (Rule::Subspace { m }, Directions::Hybrid) => format!("subspace{m}"),
            (Rule::Subspace { m }, how) => format!("subspace{m}.{}", how.name()),
            (Rule::Words { m, epsilon }, _) => format!("ldp{}.{m}.{epsilon}", self.n_words),
        }
    }

    /// Returns true if the rule uses public descriptors.
    pub fn needs_public(&self) -> bool {
        self.n_words > 0 || self.directions != Directions::Random
    }

    /// Sets the public descriptors, which owner and attacker know: the database of adversarial
    /// directions, or the descriptors from which the vocabulary is learned by k-means.
    ///
    /// # Errors
    /// If there are too few.
    pub fn with_public(self, public: &Descriptors) -> Result<Self, Error> {
        let rows: Vec<Vec<f32>> = unit_rows(public).filter(|row| inner(row, row) > 0.5).collect();
        let least = self.n_words.max(2 * MOST_DIRECTIONS);
        if rows.len() < least {
            let expected = format!("at least {least} for {}", self.name());
            return Err(Error::new("public descriptors", expected, rows.len()));
        }
        let known = Arc::new(rows.iter().map(|row| hash(row)).collect());
        let rows = if self.n_words > 0 { words(&rows, self.n_words) } else { rows };
        let public = Descriptors::try_new(Values::F32(rows.concat()), public.dim())?;
        Ok(Self { public: Some(Arc::new(public)), known, ..self })
    }

    /// Protects every row of `descriptors`.
    ///
    /// # Errors
    /// If public descriptors are missing, have another number of values or are those to protect.
    pub fn protect(
        &self,
        descriptors: &Descriptors,
        key: &Key,
    ) -> Result<ProtectedDescriptors, Error> {
        let dim = descriptors.dim();
        let public_dim = self.public.as_ref().map(|rows| rows.dim());
        if public_dim.map_or(self.needs_public(), |public| public != dim) {
            let expected = format!("public descriptors of {dim} values for {}", self.name());
            let found = public_dim.map_or("none".to_owned(), |dim| dim.to_string());
            return Err(Error::new("protection", expected, found));
        }
        if dim < 2 * MOST_DIRECTIONS {
            let expected = format!("descriptors of at least {} values", 2 * MOST_DIRECTIONS);
            return Err(Error::new("protection", expected, dim));
        }
        let known: Vec<Vec<f32>> = self.public.iter().flat_map(|rows| unit_rows(rows)).collect();
        let key = key.stage(Stage::Protection);
        let plain: Vec<Vec<f32>> = unit_rows(descriptors).collect();
        let n = plain.len();
        let n_own = plain.iter().filter(|row| self.known.contains(&hash(row))).count();
        if n_own as f64 > MAX_OWN * n as f64 {
            let found = format!("{n_own} of the {n} descriptors to protect among them");
            return Err(Error::new("public descriptors", "those of other images", found));
        }
        let of = |row: usize| {
            let (plain, mut draws) = (&plain[row], key.draws(row as u64));
            match self.rule {
                Rule::Subspace { m } => self.subspace(m, plain, &known, &mut draws),
                Rule::Words { m, epsilon } => {
                    subset(nearest(plain, &known), m, epsilon, known.len(), &mut draws)
                }
            }
        };
        let rows: Vec<Vec<f32>> = parallel::map(n, of);
        let bytes = matches!(descriptors.values(), Values::U8(_));
        ProtectedDescriptors::try_new(self.rule, rows, self.public.clone(), bytes)
    }

    /// Returns the foot of a random subspace through `plain`, and an orthonormal basis.
    ///
    /// Both depend on the subspace alone: the foot is its point nearest to the origin, and the
    /// basis is turned at random. Directions as drawn would show on which line the descriptor lies.
    fn subspace(
        &self,
        m: usize,
        plain: &[f32],
        known: &[Vec<f32>],
        draws: &mut Draws<Cipher>,
    ) -> Vec<f32> {
        let dim = plain.len();
        let n_adversarial = match self.directions {
            Directions::Random => 0,
            Directions::Adversarial => m,
            Directions::Hybrid => m / 2,
        };
        let plain: Vec<f64> = plain.iter().map(|&x| x.into()).collect();
        let mut tries = 0;
        let basis = orthonormal(m, |n_before| {
            tries += 1;
            // A database may have too few different entries.
            if n_before < n_adversarial && tries <= 16 * m {
                let entry = &known[draws.below(known.len() as u64) as usize];
                return entry.iter().zip(&plain).map(|(&v, d)| f64::from(v) - d).collect();
            }
            (0..dim).map(|_| draws.normal()).collect()
        });
        let turned = orthonormal(m, |_| {
            let mut direction = vec![0.0; dim];
            for along in &basis {
                let weight = draws.normal();
                direction.iter_mut().zip(along).for_each(|(to, x)| *to += weight * x);
            }
            direction
        });
        let mut foot = plain;
        remove(&mut foot, &turned);
        [foot].iter().chain(&turned).flatten().map(|&x| x as f32).collect()
    }
}

fn hash(row: &[f32]) -> u64 {
    let mut hasher = DefaultHasher::new();
    row.iter().for_each(|x| x.to_bits().hash(&mut hasher));
    hasher.finish()
}

/// Returns `m` orthonormal directions: of those that `draw` returns, given how many there are, the parts beyond the earlier ones.
fn orthonormal(m: usize, mut draw: impl FnMut(usize) -> Vec<f64>) -> Vec<Vec<f64>> {
    let length = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(m);
    while basis.len() < m {
        let mut direction = draw(basis.len());
        let before = length(&direction);
        remove(&mut direction, &basis);
        let after = length(&direction);
        if after <= SHORTEST * before.max(SHORTEST) {
            continue;
        }
        basis.push(direction.into_iter().map(|x| x / after).collect());
    }
    basis
}

/// Removes the components along `basis`, twice for the sake of rounding.
fn remove(from: &mut [f64], basis: &[Vec<f64>]) {
    for along in basis.iter().chain(basis) {
        let by: f64 = from.iter().zip(along).map(|(x, u)| x * u).sum();
        from.iter_mut().zip(along).for_each(|(x, u)| *x -= by * u);
    }
}

/// Draws `m` of `n` words, ascending: `own` is among them with probability
/// `m e^epsilon / (m e^epsilon + n - m)`, and the others are uniform (the subset mechanism).
fn subset(own: usize, m: usize, epsilon: f64, n: usize, draws: &mut Draws<Cipher>) -> Vec<f32> {
    let contains = 1.0 / (1.0 + (n - m) as f64 / m as f64 * libm::exp(-epsilon));
    let mut words = Vec::with_capacity(m);
    if draws.unit() < contains {
        words.push(own);
    }
    while words.len() < m {
        let word = draws.below(n as u64) as usize;
        if word != own && !words.contains(&word) {
            words.push(word);
        }
    }
    words.sort_unstable();
    words.into_iter().map(|word| word as f32).collect()
}

/// Returns the row with the largest inner product; the first of equals.
fn nearest(plain: &[f32], rows: &[Vec<f32>]) -> usize {
    let products = rows.iter().map(|row| inner(plain, row)).enumerate();
    let better = |best: (usize, f32), next: (usize, f32)| if next.1 > best.1 { next } else { best };
    products.fold((0, f32::NEG_INFINITY), better).0
}

/// Returns `n` unit-length words by spherical k-means with a fixed seed, which everyone can repeat.
fn words(rows: &[Vec<f32>], n: usize) -> Vec<Vec<f32>> {
    let mut draws = Draws::new(0, Stage::KMeans, n as u64);
    let mut order: Vec<usize> = (0..rows.len()).collect();
    draws.shuffle(&mut order);
    order.truncate(n * MAX_PER_WORD);
    let mut words: Vec<Vec<f32>> = order[..n].iter().map(|&at| rows[at].clone()).collect();
    for _ in 0..ROUNDS {
        let of = parallel::map(order.len(), |at| nearest(&rows[order[at]], &words));
        let mut sums = vec![vec![0.0_f32; rows[0].len()]; n];
        for (&at, &word) in order.iter().zip(&of) {
            sums[word].iter_mut().zip(&rows[at]).for_each(|(sum, x)| *sum += x);
        }
        for (word, sum) in words.iter_mut().zip(sums) {
            let length = inner(&sum, &sum).sqrt();
            // A word without descriptors stays.
            if length > 0.0 {
                *word = sum.into_iter().map(|x| x / length).collect();
            }
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::obfuscate::{Change, Changed, obfuscate, olc, ppl};
    use crate::truth::Original;
    use crate::{PointSet, Unit, synthetic};

    const DIM: usize = 64;

    /// Nonnegative descriptors around a common mean, as SIFT.
    fn descriptors(n: usize, seed: u64) -> Descriptors {
        let mut draws = Draws::new(seed, Stage::Shapes, 0);
        let values = (0..n * DIM).map(|_| (60.0 + 30.0 * draws.normal()).clamp(0.0, 255.0) as u8);
        Descriptors::try_new(Values::U8(values.collect()), DIM).unwrap()
    }

    fn protected(text: &str, of: &Descriptors, seed: u64) -> ProtectedDescriptors {
        let protection =
            Protection::parse(text).unwrap().with_public(&descriptors(300, 9)).unwrap();
        protection.protect(of, &Key::from_seed(seed)).unwrap()
    }

    fn cosine(a: &[f32], b: &[f32]) -> f32 {
        inner(a, b) / (inner(a, a) * inner(b, b)).sqrt()
    }

    #[test]
    fn names_are_plain_and_wrong_text_is_told() {
        let name = |text| Protection::parse(text).unwrap().name();
        assert_eq!(name("subspace:2"), "subspace2");
        assert_eq!(name("subspace:4:random"), "subspace4.random");
        assert_eq!(name("ldp:256,2,8"), "ldp256.2.8");
        let wrong = "|subspace|subspace:0|subspace:1|subspace:9|subspace:2:odd|ldp:256|ldp:4,4,1";
        for wrong in wrong.split('|').chain(["ldp:4,1,0", "noise:0.1"]) {
            let error = Protection::parse(wrong).unwrap_err().to_string();
            assert_eq!(error, format!("protection: expected {FORMS}, found {wrong}"));
        }
        let few = Protection::parse("ldp:400,2,8").unwrap().with_public(&descriptors(300, 9));
        let expected = "public descriptors: expected at least 400 for ldp400.2.8, found 300";
        assert_eq!(few.unwrap_err().to_string(), expected);
        let none = Protection::parse("subspace:2").unwrap();
        let error = none.protect(&descriptors(5, 1), &Key::from_seed(0)).unwrap_err().to_string();
        let expected = "public descriptors of 64 values for subspace2";
        assert_eq!(error, format!("protection: expected {expected}, found none"));
    }

    #[test]
    fn a_subspace_contains_its_descriptor_and_does_not_show_it() {
        let plain = descriptors(40, 1);
        for text in ["subspace:2:random", "subspace:3", "subspace:4:adversarial"] {
            let made = protected(text, &plain, 2);
            let Rule::Subspace { m } = made.rule() else { panic!("{text}") };
            for (at, (plain, row)) in unit_rows(&plain).zip(made.rows().rows()).enumerate() {
                let similar = made.similarities(&plain)[at];
                assert!((similar - 1.0).abs() < 1e-5, "{text}: {similar}");
                let parts: Vec<&[f32]> = row.chunks(DIM).skip(1).collect();
                assert_eq!(parts.len(), m, "{text}");
                for (i, one) in parts.iter().enumerate() {
                    for (j, other) in parts[..=i].iter().enumerate() {
                        let unit = if i == j { 1.0 } else { 0.0 };
                        assert!((inner(one, other) - unit).abs() < 1e-5, "{text}");
                    }
                }
                // No direction is the one from the descriptor to an entry.
                for entry in made.public().map(unit_rows).into_iter().flatten() {
                    let towards: Vec<f32> = entry.iter().zip(&plain).map(|(a, b)| a - b).collect();
                    let away = |part: &&[f32]| cosine(part, &towards).abs() <= 0.9999;
                    assert!(parts.iter().all(away), "{text}");
                }
            }
        }
    }

    #[test]
    fn the_guess_is_near_the_descriptor() {
        let plain = descriptors(60, 1);
        let rows: Vec<_> = unit_rows(&plain).collect();
        let mean_cosine = |of: &dyn Fn(usize) -> Vec<f32>| {
            let all = rows.iter().enumerate();
            all.map(|(at, row)| f64::from(cosine(row, &of(at)))).sum::<f64>() / 60.0
        };
        let mean: Vec<f32> = (0..DIM).map(|c| rows.iter().map(|row| row[c]).sum()).collect();
        let of_mean = mean_cosine(&|_| mean.clone());
        // A random direction removes a 64th of the squared length. Entries of the database on a subspace are excluded.
        for (text, least) in [
            ("subspace:2:random", 0.97),
            ("subspace:2", of_mean.max(0.95)),
            ("subspace:2:adversarial", of_mean.max(0.95)),
            ("subspace:4:adversarial", of_mean.max(0.95)),
        ] {
            let made = protected(text, &plain, 2);
            assert!(matches!(made.guess().values(), Values::U8(_)));
            let guess: Vec<_> = unit_rows(made.guess()).collect();
            let guessed = mean_cosine(&|at| guess[at].clone());
            assert!(guessed > least, "{text}: {guessed}, {least}");
        }
    }

    #[test]
    fn sets_contain_the_nearest_word_as_often_as_the_rule_says() {
        let (n, m, epsilon) = (20_000, 3, 2.0);
        let mut counts = [0_u32; 10];
        for item in 0..n {
            let mut draws = Key::from_seed(1).draws(Stage::Shapes, item);
            let words = subset(7, m, epsilon, 10, &mut draws);
            assert!(words.windows(2).all(|pair| pair[0] < pair[1]) && words.len() == m);
            words.iter().for_each(|&word| counts[word as usize] += 1);
        }
        let e = libm::exp(epsilon);
        let nearest = 3.0 * e / (3.0 * e + 7.0);
        // The other words are equally likely.
        for (word, count) in counts.into_iter().enumerate() {
            let expected = if word == 7 { nearest } else { (3.0 - nearest) / 9.0 };
            assert!((f64::from(count) / n as f64 - expected).abs() < 0.01, "{word}");
        }
    }

    #[test]
    fn a_released_map_has_no_plain_descriptor_and_public_ones_are_not_its_own() {
        let points = PointSet::try_new(synthetic::room(1, 200).points, Unit::Meter).unwrap();
        let (original, plain) = (Original::new(points), descriptors(200, 1));
        let rows: Vec<_> = unit_rows(&plain).collect();
        let texts = ["subspace:2", "ldp:16,2,4"];
        for (scheme, text) in
            [olc::ENTRY, ppl::ENTRY].into_iter().flat_map(|one| texts.map(|text| (one, text)))
        {
            let with = |public| Protection::parse(text).unwrap().with_public(public).unwrap();
            let error = with(&plain).protect(&plain, &Key::from_seed(0)).unwrap_err().to_string();
            let said = "expected those of other images, found 200 of the 200";
            assert!(error.contains(said), "{error}");
            let change = Change::Protection(with(&descriptors(300, 9)));
            let scheme = Changed::<3>::new(Arc::new(scheme), change);
            let hide = |seed| obfuscate(&scheme, &original, Some(&plain), &Key::from_seed(seed));
            let (released, secret) = hide(0).unwrap();
            let by_row = secret.by_descriptor_row();
            let mut guessed = unit_rows(released.descriptors().unwrap()).zip(by_row.hidden());
            assert!(guessed.all(|(guess, id)| guess != rows[id.index()]));
            if text.starts_with("subspace") {
                for (row, id) in by_row.hidden().iter().enumerate() {
                    let protected = released.protected().unwrap();
                    let similar = protected.similarities(&rows[id.index()])[row];
                    assert!((similar - 1.0).abs() < 1e-4, "{similar}");
                }
            }
            assert_eq!(hide(0).unwrap().0, released);
            assert_ne!(hide(1).unwrap().0.fingerprint(), released.fingerprint());
        }
    }
}
