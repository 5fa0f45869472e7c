//! Protected descriptors: affine subspaces, or sets of words, in place of plain descriptors.
//!
//! Sources that compare plain descriptors read the attacker's [`guess`](ProtectedDescriptors::guess), from released and public data.

use std::sync::{Arc, OnceLock};

use crate::descriptors::Values;
use crate::parallel;
use crate::simd::{self, Kernel};
use crate::{Descriptors, Error};

/// Largest dimension of a subspace.
pub const MOST_DIRECTIONS: usize = 8;
/// A public descriptor lies on a subspace if its squared distance to it is below this.
const ON_SUBSPACE: f32 = 1e-4;

/// Descriptors as a protected map releases them, one row per slot.
#[derive(Clone, Debug)]
pub struct ProtectedDescriptors {
    rule: Rule,
    /// The released numbers of each row: the foot and the basis of a subspace, or the numbers of words.
    rows: Descriptors,
    /// Unit-length descriptors that owner and attacker know: the database of adversarial directions, or the vocabulary.
    public: Option<Arc<Descriptors>>,
    /// Whether the plain descriptors were bytes, as SIFT.
    bytes: bool,
    guess: OnceLock<Descriptors>,
}

impl PartialEq for ProtectedDescriptors {
    /// Compares what is released; the guess follows from it.
    fn eq(&self, other: &Self) -> bool {
        let of = |one: &Self| (one.rule, one.bytes);
        of(self) == of(other) && self.rows == other.rows && self.public == other.public
    }
}

/// The rule that protects descriptors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    /// An affine subspace of dimension `m` through a unit-length descriptor.
    Subspace {
        /// Dimension.
        m: usize,
    },
    /// `m` words of a public vocabulary. They contain the nearest word of the descriptor with a probability that is larger by the
    /// factor `exp(epsilon)` than that of any other word, relative to chance.
    Words {
        /// Number of words.
        m: usize,
        /// Privacy budget.
        epsilon: f64,
    },
}

impl ProtectedDescriptors {
    /// Creates rows from what is released. A subspace is its point nearest to the origin and `m` orthonormal directions, `(m + 1) x dim`
    /// values. A set of words is `m` ascending numbers from 0.
    ///
    /// # Errors
    /// When a row has another number of values than the rule, a value is not finite, or a word is not in the vocabulary.
    pub fn try_new(
        rule: Rule,
        rows: Vec<Vec<f32>>,
        public: Option<Arc<Descriptors>>,
        bytes: bool,
    ) -> Result<Self, Error> {
        let wrong = |expected: String, found: usize| {
            Err(Error::new("protected descriptors", expected, found))
        };
        let (Rule::Subspace { m } | Rule::Words { m, .. }) = rule;
        let least = if matches!(rule, Rule::Words { .. }) { m } else { m + 1 };
        let width = rows.first().map_or(least, Vec::len);
        if let Some(at) =
            rows.iter().position(|row| row.len() != width || row.iter().any(|x| !x.is_finite()))
        {
            return wrong(format!("{width} finite values per row"), at);
        }
        // Few rows may be equal, such as sets of words.
        let rows = Descriptors::unchecked(Values::F32(rows.concat()), width.max(1));
        match rule {
            Rule::Subspace { m } => {
                if !(1..=MOST_DIRECTIONS).contains(&m) {
                    return wrong(format!("1 to {MOST_DIRECTIONS} directions"), m);
                }
                if !rows.dim().is_multiple_of(m + 1) {
                    return wrong(format!("a multiple of {} values per row", m + 1), rows.dim());
                }
                let (dim, known) = (rows.dim() / (m + 1), public.as_ref().map(|all| all.dim()));
                if let Some(known) = known.filter(|&known| !rows.is_empty() && known != dim) {
                    return wrong(format!("directions of {known} values"), dim);
                }
            }
            Rule::Words { m, .. } => {
                if rows.dim() != m {
                    return wrong(format!("{m} words per row"), rows.dim());
                }
                let n = public.as_ref().map_or(0, |words| words.len());
                let mut words = rows.rows().flatten();
                if let Some(word) = words.find(|word| !(0.0..n as f32).contains(word)) {
                    return wrong(format!("words below {n}"), word as usize);
                }
            }
        }
        Ok(Self { rule, rows, public, bytes, guess: OnceLock::new() })
    }

    /// Returns the rule.
    pub fn rule(&self) -> Rule {
        self.rule
    }

    /// Whether the plain descriptors were bytes.
    pub fn of_bytes(&self) -> bool {
        self.bytes
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Number of values of a plain descriptor.
    pub fn dim(&self) -> usize {
        match self.rule {
            Rule::Subspace { m } => self.rows.dim() / (m + 1),
            Rule::Words { .. } => self.public().map_or(0, Descriptors::dim),
        }
    }

    /// The released numbers.
    pub fn rows(&self) -> &Descriptors {
        &self.rows
    }

    /// The public descriptors that the rule uses, if any.
    pub fn public(&self) -> Option<&Descriptors> {
        self.public.as_deref()
    }

    /// Returns the rows `order[0], order[1], ...`.
    #[must_use]
    pub fn select(&self, order: &[u32]) -> Self {
        let (rows, public) = (self.rows.select(order), self.public.clone());
        Self { rule: self.rule, rows, public, bytes: self.bytes, guess: OnceLock::new() }
    }

    /// Returns the similarity of every row to a unit-length descriptor: 1 minus half of the squared distance, or the largest cosine.
    pub fn similarities(&self, plain: &[f32]) -> Vec<f32> {
        simd::dispatch(Similarities { protected: self, plain })
    }

    /// Returns the plain descriptors that an attacker infers, in their scale: one point of each subspace, or the mean of the words.
    ///
    /// A subspace intersects the unit sphere in a sphere around its foot. Public descriptors on it are adversarial directions, and the
    /// point opposite to them is the guess. Without such, the guess is the foot: random directions are nearly orthogonal to the descriptor.
    pub fn guess(&self) -> &Descriptors {
        self.guess.get_or_init(|| {
            let dim = self.dim();
            let known: Vec<Vec<f32>> = self.public.iter().flat_map(|it| unit_rows(it)).collect();
            let of = |at: usize| {
                let row = self.rows.row(at);
                match self.rule {
                    Rule::Subspace { .. } => opposite(&row, dim, &known),
                    Rule::Words { .. } => {
                        let words = row.iter().map(|&word| &known[word as usize]);
                        let mut mean = vec![0.0; dim];
                        words.for_each(|word| add(&mut mean, word, 1.0));
                        mean
                    }
                }
            };
            let rows: Vec<Vec<f32>> = parallel::map(self.len(), of);
            let scaled = rows.into_iter().flat_map(|mut row| {
                if self.bytes {
                    row.iter_mut().for_each(|x| *x = x.max(0.0));
                }
                let length = inner(&row, &row).sqrt().max(1e-12);
                let scale = if self.bytes { 512.0 } else { 1.0 } / length;
                row.into_iter().map(move |x| x * scale)
            });
            let values = match self.bytes {
                // A cast saturates.
                true => Values::U8(scaled.map(|x| x.round() as u8).collect()),
                false => Values::F32(scaled.collect()),
            };
            Descriptors::unchecked(values, dim)
        })
    }
}

/// The loop of [`ProtectedDescriptors::similarities`]. Public descriptors have unit length.
struct Similarities<'a> {
    protected: &'a ProtectedDescriptors,
    plain: &'a [f32],
}

/// Returns the values of released rows or of public descriptors, which are floats.
fn floats(descriptors: &Descriptors) -> &[f32] {
    match descriptors.values() {
        Values::F32(values) => values,
        Values::U8(_) => &[],
    }
}

impl Kernel for Similarities<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn run(self) -> Vec<f32> {
        let Self { protected: ProtectedDescriptors { rule, rows, public, .. }, plain } = self;
        let dim = plain.len();
        let rows = floats(rows).chunks_exact(rows.dim());
        let mut similar = Vec::with_capacity(rows.len());
        match rule {
            Rule::Subspace { .. } => {
                let square = inner(plain, plain);
                for row in rows {
                    let (foot, basis) = row.split_at(dim);
                    let mut apart = square + inner(foot, foot) - 2.0 * inner(foot, plain);
                    for direction in basis.chunks_exact(dim) {
                        let along = inner(direction, plain);
                        apart -= along * along;
                    }
                    similar.push(1.0 - apart.max(0.0) / 2.0);
                }
            }
            Rule::Words { .. } => {
                let words = public.as_deref().map_or(&[][..], floats);
                let mut to_words = Vec::with_capacity(words.len() / dim.max(1));
                for word in words.chunks_exact(dim) {
                    to_words.push(inner(word, plain));
                }
                for row in rows {
                    let mut best = -1.0_f32;
                    for &word in row {
                        best = best.max(to_words[word as usize]);
                    }
                    similar.push(best);
                }
            }
        }
        similar
    }
}

/// Returns the point of a subspace on the unit sphere that is opposite to the `known` descriptors on it.
fn opposite(row: &[f32], dim: usize, known: &[Vec<f32>]) -> Vec<f32> {
    let (foot, basis) = row.split_at(dim);
    let square = inner(foot, foot);
    let mut away = vec![0.0; dim];
    for known in known {
        // A unit vector on the subspace has this inner product with the foot.
        if (inner(known, foot) - square).abs() > ON_SUBSPACE {
            continue;
        }
        let along = basis.chunks_exact(dim).map(|u| inner(u, known).powi(2)).sum::<f32>();
        if 1.0 - square - along < ON_SUBSPACE {
            add(&mut away, known, 1.0);
            add(&mut away, foot, -1.0);
        }
    }
    let length = inner(&away, &away).sqrt();
    let mut guess = foot.to_vec();
    if length > 0.0 {
        add(&mut guess, &away, -(1.0 - square).max(0.0).sqrt() / length);
    }
    guess
}

fn add(to: &mut [f32], row: &[f32], times: f32) {
    to.iter_mut().zip(row).for_each(|(to, x)| *to += times * x);
}

/// Returns the rows of a matrix, brought to length 1.
pub fn unit_rows(descriptors: &Descriptors) -> impl Iterator<Item = Vec<f32>> {
    descriptors.rows().map(|mut row| {
        let length = inner(&row, &row).sqrt();
        if length > 0.0 {
            row.iter_mut().for_each(|x| *x /= length);
        }
        row
    })
}

/// Returns an inner product in a fixed order of eight partial sums.
#[inline(always)]
pub fn inner(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0_f32; 8];
    for (a, b) in a.chunks_exact(8).zip(b.chunks_exact(8)) {
        (0..8).for_each(|c| sums[c] += a[c] * b[c]);
    }
    let rest = a.len() / 8 * 8;
    let tail: f32 = a[rest..].iter().zip(&b[rest..]).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f32>() + tail
}
