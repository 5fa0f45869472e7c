//! How far estimates lie from the hidden coordinate: learned from the pairs themselves.

/// Records are told apart by their evidence into this many classes of one size: the better founded, the nearer.
pub(super) const CLASSES: usize = 8;
/// Normal distributions that make up the law, each half as wide as the one before: down to 1 / 512 of the reach.
pub(super) const SCALES: usize = 9;
/// The share of good estimates in a class is at least and at most this: a share of 0 or 1 would never change again.
const SHARE: (f64, f64) = (0.02, 0.995);

/// Steps from 0 to the reach in which distances are counted: as fine as the narrowest distribution.
const STEPS: usize = 1 << 9;

/// Per class: the share of estimates that are near the hidden coordinate, and how near they are.
#[derive(Clone, Debug)]
pub(super) struct Law {
    good: [f64; CLASSES],
    weight: [[f64; SCALES]; CLASSES],
    /// The density of each scale in the middle of each step.
    shapes: Vec<[f64; SCALES]>,
    reach: f32,
    /// Density times share, per class and step.
    table: Vec<[f64; STEPS]>,
}

impl Law {
    /// Before anything is known; partners are looked for within `reach`.
    pub(super) fn new(reach: f32) -> Self {
        let weight = [[1.0 / SCALES as f64; SCALES]; CLASSES];
        let shape = |step: usize, scale: usize| {
            let away = (step as f64 + 0.5) / STEPS as f64;
            // In units of the reach; 1 / sqrt(2 pi).
            let inverse = f64::from(2u32 << scale);
            let z = away * inverse;
            0.398_942_280_4 * inverse / f64::from(reach) * libm::exp(-0.5 * z * z)
        };
        let shapes =
            (0..STEPS).map(|step| std::array::from_fn(|scale| shape(step, scale))).collect();
        let table = vec![[0.0; STEPS]; CLASSES];
        Self { good: [0.8; CLASSES], weight, shapes, reach, table }.tabulated()
    }

    /// The weighted density of each scale of `class` in the middle of a step.
    fn parts(&self, class: usize, step: usize) -> [f64; SCALES] {
        let shape = &self.shapes[step];
        std::array::from_fn(|s| shape[s] * self.weight[class][s])
    }

    fn tabulated(mut self) -> Self {
        for class in 0..CLASSES {
            for step in 0..STEPS {
                let sum: f64 = self.parts(class, step).iter().sum();
                self.table[class][step] = self.good[class] * sum;
            }
        }
        self
    }

    #[inline(always)]
    fn step(&self, away: f32) -> usize {
        ((away / self.reach * STEPS as f32) as usize).min(STEPS - 1)
    }

    /// The density of a good estimate's distance, times the share of good ones.
    #[inline(always)]
    pub(super) fn density(&self, class: usize, away: f32) -> f64 {
        self.table[class][self.step(away)]
    }

    /// The weight of "no partner is known" for a record of `class`, when a share `others` of the
    /// partners can be found.
    pub(super) fn alone(&self, class: usize, others: f64) -> f64 {
        1.0 - self.good[class] * others
    }

    /// The mean share of good estimates.
    pub(super) fn mean_good(&self) -> f64 {
        self.good.iter().sum::<f64>() / CLASSES as f64
    }

    /// The law that `tally` suggests, where this one was used to find the pairs.
    pub(super) fn learned(&self, tally: &Tally) -> Self {
        let mut next = self.clone();
        let others = self.mean_good().max(0.1);
        for class in 0..CLASSES {
            if tally.records[class] == 0.0 {
                continue;
            }
            let mut scales = [0.0; SCALES];
            for (step, found) in tally.found[class].iter().enumerate().filter(|x| *x.1 > 0.0) {
                let parts = self.parts(class, step);
                let sum = parts.iter().sum::<f64>().max(f64::MIN_POSITIVE);
                for (to, part) in scales.iter_mut().zip(parts) {
                    *to += found * part / sum;
                }
            }
            let total: f64 = scales.iter().sum();
            let good = total / tally.records[class] / others;
            next.good[class] = good.clamp(SHARE.0, SHARE.1);
            // One pair more, spread over all scales.
            let spread = |s: f64| (s + 1.0 / SCALES as f64) / (total + 1.0);
            next.weight[class] = scales.map(spread);
        }
        next.tabulated()
    }
}

/// What pairs show about distances, per class and step.
#[derive(Clone, Debug)]
pub(super) struct Tally {
    pub(super) records: [f64; CLASSES],
    found: Vec<[f64; STEPS]>,
}

impl Default for Tally {
    fn default() -> Self {
        Self { records: [0.0; CLASSES], found: vec![[0.0; STEPS]; CLASSES] }
    }
}

impl Tally {
    /// Counts an estimate of `class` that lies `away` from its partner's value with `probability`.
    #[inline(always)]
    pub(super) fn add(&mut self, law: &Law, class: usize, away: f32, probability: f64) {
        self.found[class][law.step(away)] += probability;
    }

    pub(super) fn merge(&mut self, other: &Self) {
        for class in 0..CLASSES {
            self.records[class] += other.records[class];
            for (to, more) in self.found[class].iter_mut().zip(&other.found[class]) {
                *to += more;
            }
        }
    }
}
