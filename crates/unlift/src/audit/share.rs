//! Thresholds, the share of points within one, and its sampling error.

use indexmap::IndexMap;

use crate::Error;

/// An error below which a point counts as recovered.
#[derive(Clone, Debug, PartialEq)]
pub struct Threshold {
    /// Text as the user typed it; the key in reports.
    pub label: String,
    /// Value in the unit of the points.
    pub value: f64,
}

impl Threshold {
    /// Parses a positive number and keeps its text.
    ///
    /// # Errors
    /// When `text` is not a positive number.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let label = text.trim().to_owned();
        match label.parse::<f64>() {
            Ok(value) if value.is_finite() && value > 0.0 => Ok(Self { label, value }),
            _ => Err(Error::new("threshold", "a positive number", format!("{text:?}"))),
        }
    }
}

/// Percentages by label of the threshold, in the order of the plan.
pub type ByThreshold = IndexMap<String, f64>;

/// Ends of a 95 % interval, in percent.
pub type Interval = [f64; 2];

/// Returns the interval of the largest of several figures, which may be as high as the highest of theirs. `None` without figures.
pub fn interval_of_largest(intervals: impl IntoIterator<Item = Interval>) -> Option<Interval> {
    intervals.into_iter().reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])])
}

/// A percentage with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WithInterval {
    /// The percentage.
    pub percent: f64,
    /// Its interval.
    pub interval: Interval,
}

impl WithInterval {
    /// Returns the upper end of the interval of what `self` exceeds `other` by (Newcombe's method).
    /// Errors are taken as independent, which is never too small for points that both recover.
    pub fn highest_gain(&self, other: &Self) -> f64 {
        let gain = self.percent - other.percent;
        gain + (self.interval[1] - self.percent).hypot(other.percent - other.interval[0])
    }
}

/// Sums over items: of items, points, points within, the squares of both, and their products.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Share([f64; 6]);

impl Share {
    /// Creates the share of `within` of the `points` of one item; without points it is empty.
    pub fn of(within: f64, points: f64) -> Self {
        let n_items = f64::from(u8::from(points > 0.0));
        Self([n_items, points, within, points * points, within * within, points * within])
    }

    /// Adds the sums of other items.
    pub(super) fn merge(&mut self, more: &Self) {
        self.0.iter_mut().zip(more.0).for_each(|(sum, more)| *sum += more);
    }

    /// Returns the mean over repeats, whose points are the same.
    pub(super) fn mean(repeats: impl Iterator<Item = Self>) -> Self {
        let (mut all, mut n) = (Self::default(), 0.0);
        for share in repeats {
            all.merge(&share);
            n += 1.0;
        }
        Self(all.0.map(|sum| sum / n))
    }

    /// Returns the share among `points`, of which none is within that is not counted yet.
    pub(super) fn among(mut self, points: f64) -> Self {
        let [_, counted, ..] = self.0;
        self.merge(&Self::of(0.0, points - counted));
        self
    }

    /// Returns the percentage; zero without points.
    pub fn percent(&self) -> f64 {
        let [_, points, within, ..] = self.0;
        if points == 0.0 { 0.0 } else { 100.0 * within / points }
    }

    /// Returns the 95 % interval of the percentage: Wilson's over points, as if they were independent;
    /// over several items, the wider of this and the t interval of a ratio of sums.
    pub fn interval(&self) -> Interval {
        let [n_items, n, within, points_squared, within_squared, product] = self.0;
        if n == 0.0 {
            return [0.0, 100.0];
        }
        let share = within / n;
        let (z, square) = (NORMAL, NORMAL * NORMAL);
        let center = (share + square / (2.0 * n)) / (1.0 + square / n);
        let half = z / (1.0 + square / n)
            * (share * (1.0 - share) / n + square / (4.0 * n * n)).max(0.0).sqrt();
        let wilson =
            [100.0 * (center - half), 100.0 * (center + half)].map(|p| p.clamp(0.0, 100.0));
        if n_items < 2.0 {
            return wilson;
        }
        let squares = within_squared - 2.0 * share * product + share * share * points_squared;
        let error = (n_items / (n_items - 1.0) * squares.max(0.0)).sqrt() / n;
        wider(wilson, around(100.0 * share, 100.0 * error, n_items - 1.0))
    }
}

/// Returns the interval of a mean over repeats: the wider of their mean one and the t interval.
pub(super) fn over_repeats(intervals: &[Interval], mean: f64, std: f64) -> Interval {
    let n = intervals.len() as f64;
    let end = |end: usize| intervals.iter().map(|interval| interval[end]).sum::<f64>() / n;
    wider([end(0), end(1)], around(mean, std / n.sqrt(), n - 1.0))
}

/// 97.5 % quantile of the normal distribution.
const NORMAL: f64 = 1.959_963_984_540_054;
/// 97.5 % quantiles of Student's t distribution, from one degree of freedom.
const STUDENT: [f64; 10] = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228];

fn around(mean: f64, error: f64, freedom: f64) -> Interval {
    let t = STUDENT.get(freedom as usize - 1).copied().unwrap_or_else(|| {
        let z = NORMAL;
        // The first terms of its expansion are right to 0.001 here.
        z + (z.powi(3) + z) / (4.0 * freedom)
            + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * freedom * freedom)
    });
    [mean - t * error, mean + t * error].map(|percent| percent.clamp(0.0, 100.0))
}

fn wider(a: Interval, b: Interval) -> Interval {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Shares by label of the threshold.
pub type Shares = IndexMap<String, Share>;

/// Returns a share for each threshold by its label.
pub(super) fn shares(thresholds: &[Threshold], share: impl Fn(&Threshold) -> Share) -> Shares {
    thresholds.iter().map(|t| (t.label.clone(), share(t))).collect()
}

pub(super) fn percents(shares: &Shares) -> ByThreshold {
    shares.iter().map(|(label, share)| (label.clone(), share.percent())).collect()
}

pub(super) fn intervals(shares: &Shares) -> IndexMap<String, Interval> {
    shares.iter().map(|(label, share)| (label.clone(), share.interval())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::{Cipher, Draws, Key, Stage};

    /// Returns the percentage of 1,000 draws whose interval contains `truth`.
    fn coverage(truth: f64, draw: impl Fn(&mut Draws<Cipher>) -> Interval) -> f64 {
        let mut draws = Key::from_seed(7).draws(Stage::Scheme, 0);
        let covers = |[low, high]: Interval| (low..=high).contains(&truth);
        (0..1_000).filter(|_| covers(draw(&mut draws))).count() as f64 / 10.0
    }

    /// Draws the share of `n` points, each of which is within with probability `share`.
    fn drawn(n: usize, share: f64, draws: &mut Draws<Cipher>) -> Share {
        Share::of((0..n).filter(|_| draws.unit() < share).count() as f64, n as f64)
    }

    #[test]
    fn intervals_contain_the_truth_in_95_of_100_draws() {
        for (n, share) in [(400, 0.5), (400, 0.03), (3_000, 0.2), (3_000, 0.97)] {
            let found = coverage(100.0 * share, |draws| drawn(n, share, draws).interval());
            assert!((93.0..=97.0).contains(&found), "{share} of {n} points: {found}");
        }
        for (n_items, share, deviation) in [(30, 0.5, 0.15), (100, 0.2, 0.05), (8, 0.6, 0.1)] {
            let found = coverage(100.0 * share, |draws| {
                let mut all = Share::default();
                for _ in 0..n_items {
                    let n = 300 + draws.below(300) as usize;
                    let of_item = share + deviation * draws.normal();
                    all.merge(&drawn(n, of_item, draws));
                }
                all.interval()
            });
            assert!((93.0..=97.0).contains(&found), "{share} in {n_items} images: {found}");
        }
        for n in [2, 5, 20] {
            let found = coverage(40.0, |draws| {
                let of: Vec<f64> = (0..n).map(|_| 40.0 + 3.0 * draws.normal()).collect();
                let mean = of.iter().sum::<f64>() / n as f64;
                let squares: f64 = of.iter().map(|x| (x - mean) * (x - mean)).sum();
                let points = |x: &f64| Share::of(1e4 * x, 1e6).interval();
                let points: Vec<Interval> = of.iter().map(points).collect();
                over_repeats(&points, mean, (squares / (n as f64 - 1.0)).sqrt())
            });
            assert!((93.0..=97.0).contains(&found), "{n} repeats: {found}");
        }
    }

    /// Independent points in every image give no narrower interval than the points of one map.
    #[test]
    fn an_interval_is_never_narrower_than_over_points() {
        let mut all = Share::default();
        (0..50).for_each(|_| all.merge(&Share::of(0.0, 100.0)));
        assert_eq!(all.interval()[1], Share::of(0.0, 5_000.0).interval()[1]);
        assert!(all.interval()[1] > 0.07, "no point of 5,000 came back, but some may");
        assert_eq!(Share::default().interval(), [0.0, 100.0]);
        let mut two = Share::of(2.0, 10.0);
        two.merge(&Share::of(0.0, 5.0));
        let mut three = two;
        three.merge(&Share::of(0.0, 0.0));
        assert_eq!(two, three, "an image without points");
        let [a, b] = [Share::of(60.0, 100.0), Share::of(40.0, 100.0)];
        let of =
            |share: Share| WithInterval { percent: share.percent(), interval: share.interval() };
        // Newcombe's interval of this difference ends at 32.8 points for independent samples.
        assert!((of(a).highest_gain(&of(b)) - 32.8).abs() < 0.1);
    }
}
