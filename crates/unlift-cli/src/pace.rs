//! Progress and remaining time of a task.

use std::fmt;
use std::time::Duration;

/// Time constant of the running average in seconds: steps this long ago count a third. It grows
/// with the duration of the task.
const MEMORY_S: f64 = 30.0;

/// Finished items needed for an estimate, or a tenth of all if that is less.
const BASIS: f64 = 5.0;

/// Number of finished items, and their speed. Times are relative to the start.
#[derive(Clone, Debug, Default)]
pub struct Pace {
    done: f64,
    total: usize,
    /// Time of the last step, in seconds.
    last: f64,
    /// Discounted sums of the seconds and items of steps.
    seconds: f64,
    items: f64,
}

impl Pace {
    /// Number of finished items, including fractions.
    pub fn done(&self) -> f64 {
        self.done
    }

    pub fn total(&self) -> usize {
        self.total
    }

    /// Sets `done` of `total` items as finished. Fractions that threads added may already exceed
    /// `done`.
    pub fn set(&mut self, done: f64, total: usize, now: Duration) {
        self.total = total;
        self.add(done - self.done, now);
    }

    pub fn add(&mut self, share: f64, now: Duration) {
        let share = share.clamp(0.0, (self.total as f64 - self.done).max(0.0));
        if share == 0.0 {
            return;
        }
        let now = now.as_secs_f64();
        let took = (now - self.last).max(0.0);
        let discount = (-took / (MEMORY_S + now / 8.0)).exp();
        self.seconds = self.seconds * discount + took;
        self.items = self.items * discount + share;
        self.done += share;
        self.last = now;
    }

    /// Returns the remaining time; `None` during the first items, which are often not typical.
    pub fn left(&self, now: Duration) -> Option<Duration> {
        let open = self.total as f64 - self.done;
        let basis = (self.total as f64 / 10.0).clamp(1.0, BASIS);
        if self.done < basis || self.items <= 0.0 || open <= 0.0 {
            return None;
        }
        let since = (now.as_secs_f64() - self.last).max(0.0);
        let expected = open * self.seconds / self.items - since;
        // If the current step already takes longer than average, it ends now at the earliest.
        let at_least = (open - 1.0).max(0.0) * (self.seconds + since) / (self.items + 1.0);
        Some(Duration::from_secs_f64(expected.max(at_least)))
    }

    /// Returns the progress as a short text: `12/40, 3 min left`.
    pub fn status(&self, now: Duration) -> Status {
        Status { done: self.done as usize, total: self.total, left: self.left(now) }
    }
}

/// The short text of [`Pace::status`].
#[derive(Clone, Copy, Debug)]
pub struct Status {
    done: usize,
    total: usize,
    left: Option<Duration>,
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.done, self.total)?;
        let Some(left) = self.left else { return Ok(()) };
        match left.as_secs_f64().round() as u64 {
            s @ 0..100 => write!(f, ", {s} s left"),
            s @ 100..5400 => write!(f, ", {} min left", (s + 30) / 60),
            s => write!(f, ", {} h {} min left", s / 3600, s % 3600 / 60),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn s(seconds: f64) -> Duration {
        Duration::from_secs_f64(seconds)
    }

    #[test]
    fn even_steps_take_as_long_as_before_and_count_down_in_between() {
        let mut pace = Pace::default();
        pace.set(0.0, 40, s(0.0));
        assert_eq!(pace.status(s(1.0)).to_string(), "0/40", "nothing to tell by");
        pace.add(0.5, s(1.0));
        assert_eq!(pace.status(s(1.0)).to_string(), "0/40", "too little to tell by");
        pace.add(0.5, s(2.0));
        for n in 2..=10 {
            pace.add(1.0, s(2.0 * f64::from(n)));
        }
        assert_eq!(pace.status(s(20.0)).to_string(), "10/40, 60 s left");
        assert_eq!(pace.status(s(21.0)).to_string(), "10/40, 59 s left");
        // During a step that never ends, the remaining time grows.
        assert!(pace.left(s(500.0)) > pace.left(s(400.0)));
    }

    #[test]
    fn what_an_earlier_run_did_in_no_time_is_soon_forgotten() {
        let mut pace = Pace::default();
        pace.set(900.0, 1000, s(0.1));
        for n in 1..=50 {
            pace.add(1.0, s(0.1 + 10.0 * f64::from(n)));
        }
        // 50 more at ten seconds each.
        let left = pace.left(s(500.1)).unwrap().as_secs_f64();
        assert!((350.0..=550.0).contains(&left), "{left}");
    }

    #[test]
    fn parts_of_items_add_up_and_never_exceed_them() {
        let mut pace = Pace::default();
        pace.set(0.0, 2, s(0.0));
        (1..=8).for_each(|n| pace.add(0.25, s(f64::from(n))));
        assert_eq!(pace.status(s(8.0)).to_string(), "2/2");
        pace.add(0.25, s(9.0));
        pace.set(1.0, 2, s(9.0));
        assert_eq!(pace.done(), 2.0);
    }

    #[test]
    fn times_are_in_units_that_people_use() {
        let text = |left: f64| Status { done: 1, total: 2, left: Some(s(left)) }.to_string();
        assert_eq!(text(99.4), "1/2, 99 s left");
        assert_eq!(text(100.0), "1/2, 2 min left");
        assert_eq!(text(7500.0), "1/2, 2 h 5 min left");
    }
}
