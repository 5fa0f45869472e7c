//! The entries with the highest scores of a stream, independent of its order.

/// The result of comparing a row with others.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// The best rows of other records, best first; equal scores in row order.
    pub best: Vec<(f32, u32)>,
    /// Mean of the scores with rows of other records; 0 unless they were counted.
    pub mean: f64,
    /// Standard deviation of these scores; 0 unless they were counted.
    pub deviation: f64,
}

/// Keeps the entries with the highest scores, and among equal scores those with the lowest ids. The result depends on the set
/// of entries alone.
#[derive(Clone, Debug)]
pub struct Best {
    most: usize,
    floor: f32,
    entries: Vec<(f32, u32)>,
}

impl Best {
    /// Keeps at most `most` entries.
    pub fn new(most: usize) -> Self {
        Self { most, floor: f32::NEG_INFINITY, entries: Vec::new() }
    }

    /// Entries with a lower score can no longer be kept.
    #[inline(always)]
    pub fn floor(&self) -> f32 {
        self.floor
    }

    /// Adds an entry; each id at most once.
    #[inline]
    pub fn push(&mut self, score: f32, id: u32) {
        self.entries.push((score, id));
        if self.entries.len() >= 2 * self.most.max(8) {
            self.shrink();
        }
    }

    fn shrink(&mut self) {
        if self.most == 0 {
            self.entries.clear();
            self.floor = f32::INFINITY;
        } else if self.entries.len() > self.most {
            self.entries.select_nth_unstable_by(self.most - 1, higher_first);
            self.entries.truncate(self.most);
            self.floor = self.entries[self.most - 1].0;
        }
    }

    /// Returns the kept entries, highest score first, equal scores by id.
    pub fn into_sorted(mut self) -> Vec<(f32, u32)> {
        self.shrink();
        self.entries.sort_unstable_by(higher_first);
        self.entries
    }
}

/// Order of results: by score, high to low, then by id.
pub fn higher_first(a: &(f32, u32), b: &(f32, u32)) -> std::cmp::Ordering {
    b.0.total_cmp(&a.0).then(a.1.cmp(&b.1))
}
