//! Progress on stderr for work of more than a second: a bar on a terminal, otherwise a line per
//! minute. `--quiet` disables both.

use std::fmt::Write;
use std::io::IsTerminal;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use unlift::OneLine;

use crate::stderr::tell;

/// Work that takes less time shows no progress.
const PATIENCE: Duration = Duration::from_secs(1);
/// Interval at which a bar is redrawn, so that the remaining time counts down.
const TICK: Duration = Duration::from_millis(500);
/// Shortest interval between lines in a log.
const LINES: Duration = Duration::from_secs(60);
/// Seconds of a day, the longest time that is estimated.
const A_DAY: f64 = 86_400.0;
/// Steps of a bar per item, so that it moves within items. Fractions are rounded to them.
const PARTS: u64 = 1_000_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    Nothing,
    Bar,
    Lines,
}

/// Progress over countable items; removed when dropped.
pub struct Progress(Steps);

/// A handle with which any thread can report progress.
#[derive(Clone)]
pub struct Steps {
    bar: ProgressBar,
}

impl Progress {
    /// Starts the progress of new work.
    pub fn new(quiet: bool) -> Self {
        Self::with(match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => Shown::Nothing,
            (false, true) => Shown::Bar,
            (false, false) => Shown::Lines,
        })
    }

    fn with(shown: Shown) -> Self {
        // A hidden bar still counts and estimates.
        let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::hidden());
        let style = ProgressStyle::with_template("{bar:30} {status} {wide_msg}");
        let style = style.expect("the template is ours");
        bar.set_style(style.with_key("status", |state: &ProgressState, text: &mut dyn Write| {
            // A failed write only loses the status.
            let _ = text.write_str(&status(state.pos(), state.len(), state.elapsed()));
        }));
        if shown != Shown::Nothing {
            // In a thread, because a step may take minutes.
            let (bar, started) = (bar.downgrade(), Instant::now());
            std::thread::spawn(move || {
                std::thread::sleep(if shown == Shown::Bar { PATIENCE } else { LINES });
                while let Some(bar) = bar.upgrade().filter(|bar| !bar.is_finished()) {
                    if shown == Shown::Bar {
                        bar.set_draw_target(ProgressDrawTarget::stderr());
                        bar.enable_steady_tick(TICK);
                        return;
                    }
                    let status = status(bar.position(), bar.length(), started.elapsed());
                    tell(format_args!("unlift: {status}: {}", bar.message()));
                    drop(bar);
                    std::thread::sleep(LINES);
                }
            });
        }
        Self(Steps { bar })
    }

    /// Sets `done` of `total` items as finished; `what` is the next item.
    pub fn show(&self, done: usize, total: usize, what: &str) {
        let bar = &self.0.bar;
        bar.set_length(total as u64 * PARTS);
        // Fractions that threads added may already exceed `done`.
        bar.set_position(bar.position().max(done as u64 * PARTS));
        self.0.tell(what);
    }

    /// Prints a line on stderr without breaking the bar.
    pub fn say(&self, line: &str) {
        self.0.say(line);
    }
}

/// Formats the share of parts that are done: `40 %, 3 minutes left`. The time is estimated from a tenth on, and only up to a day.
fn status(parts: u64, of: Option<u64>, elapsed: Duration) -> String {
    let share = parts as f64 / of.unwrap_or(0).max(1) as f64;
    // The last item ends with the work itself.
    let percent = ((100.0 * share + 1e-3) as u64).min(99);
    let seconds = elapsed.as_secs_f64() * (1.0 - share) / share;
    match share >= 0.1 && (1.0..=A_DAY).contains(&seconds) {
        true => format!("{percent} %, {} left", HumanDuration(Duration::from_secs_f64(seconds))),
        false => format!("{percent} %"),
    }
}

impl unlift_audit::Progress for Progress {
    fn show(&self, done: usize, total: usize, what: &str) {
        Self::show(self, done, total, what);
    }

    fn add(&self, share: f64, what: &str) {
        self.0.add(share, what);
    }

    fn say(&self, line: &str) {
        self.0.say(&format!("unlift: {line}"));
    }
}

/// Prints messages on stderr, without progress.
#[derive(Clone, Copy, Debug)]
pub struct Stderr;

impl unlift_audit::Progress for Stderr {
    fn say(&self, line: &str) {
        tell(format_args!("unlift: {line}"));
    }
}

impl unlift_audit::Progress for Spinner {
    fn say(&self, line: &str) {
        Self::say(self, &format!("unlift: {line}"));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.bar.finish_and_clear();
    }
}

impl Steps {
    /// Adds a fraction of an item; `what` is the current item, unless it is empty.
    pub fn add(&self, share: f64, what: &str) {
        self.bar.inc((share * PARTS as f64).round() as u64);
        self.tell(what);
    }

    /// Prints a line on stderr without breaking the bar.
    pub fn say(&self, line: &str) {
        self.bar.suspend(|| tell(line));
    }

    fn tell(&self, what: &str) {
        if !what.is_empty() {
            self.bar.set_message(OneLine(what).to_string());
        }
    }
}

/// An activity indicator for work whose steps cannot be counted; removed when dropped. Without a
/// terminal it prints a line per minute.
pub struct Spinner {
    bar: ProgressBar,
    /// Dropping it ends the thread that prints lines.
    _lines: Option<mpsc::Sender<()>>,
}

impl Spinner {
    /// Starts an indicator that shows `what` and the elapsed time.
    pub fn new(what: &'static str) -> Self {
        let style = ProgressStyle::with_template("{spinner} {msg}, {elapsed}");
        let bar = ProgressBar::new_spinner().with_message(what);
        bar.set_style(style.expect("the template is ours"));
        // Without a terminal, a thread prints lines instead.
        if !bar.is_hidden() {
            bar.enable_steady_tick(PATIENCE / 8);
            return Self { bar, _lines: None };
        }
        let (lines, ended) = mpsc::channel();
        std::thread::spawn(move || tell_each(LINES, what, &ended, tell));
        Self { bar, _lines: Some(lines) }
    }

    pub fn unless(quiet: bool, what: &'static str) -> Self {
        if quiet { Self { bar: ProgressBar::hidden(), _lines: None } } else { Self::new(what) }
    }

    /// Prints a line on stderr without breaking the indicator.
    pub fn say(&self, line: &str) {
        self.bar.suspend(|| tell(line));
    }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Prints `what` and the elapsed time once per `while_`, until the other end of `ended` is dropped.
fn tell_each(
    while_: Duration,
    what: &str,
    ended: &mpsc::Receiver<()>,
    mut say: impl FnMut(String),
) {
    let started = Instant::now();
    while ended.recv_timeout(while_) == Err(mpsc::RecvTimeoutError::Timeout) {
        say(format!("unlift: {what}, {} s", started.elapsed().as_secs()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_that_cannot_be_counted_says_that_it_goes_on_until_it_ends() {
        let (lines, ended) = mpsc::channel();
        let mut lines = Some(lines);
        let mut said = Vec::new();
        tell_each(Duration::from_millis(5), "finding neighbors", &ended, |line| {
            said.push(line);
            lines = lines.take().filter(|_| said.len() < 2);
        });
        assert_eq!(said, ["unlift: finding neighbors, 0 s"; 2]);
    }

    #[test]
    fn parts_of_items_add_up_and_never_exceed_them() {
        let progress = Progress::with(Shown::Lines);
        let bar = &progress.0.bar;
        let status_now = || status(bar.position(), bar.length(), Duration::ZERO);
        progress.show(0, 2, "a.jpg");
        (0..2).for_each(|_| progress.0.add(1.0 / 3.0, ""));
        assert_eq!((status_now(), bar.message()), ("33 %".to_owned(), "a.jpg".to_owned()));
        progress.0.add(1.0 / 3.0, "b.jpg");
        assert_eq!((status_now(), bar.message()), ("50 %".to_owned(), "b.jpg".to_owned()));
        (0..2).for_each(|_| progress.0.add(1.0, ""));
        progress.show(1, 2, "");
        assert_eq!(status_now(), "99 %");
    }

    /// Regression: a run of twelve minutes had 31 weeks, 8 years and 584942417355 years left.
    #[test]
    fn time_is_estimated_from_a_tenth_on_and_up_to_a_day() {
        let status = |parts, seconds| status(parts, Some(100), Duration::from_secs(seconds));
        assert_eq!(status(75, 450), "75 %, 3 minutes left");
        assert_eq!(status(9, 60), "9 %");
        assert_eq!(status(10, 100_000), "10 %");
        assert_eq!(status(0, 60), "0 %");
        assert_eq!(status(100, 60), "99 %");
    }
}
