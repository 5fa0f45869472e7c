//! Progress on stderr for work of more than a second: a bar on a terminal, otherwise a line per
//! minute. `--quiet` disables both.

use std::fmt::Write;
use std::io::IsTerminal;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
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
    shown: Shown,
    bar: ProgressBar,
    /// Time of the last line in a log.
    told: Arc<Mutex<Instant>>,
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
            let _ = text.write_str(&status(state.pos(), state.len(), state.eta()));
        }));
        if shown == Shown::Bar {
            // In a thread, because the first step may take a minute.
            let bar = bar.downgrade();
            std::thread::spawn(move || {
                std::thread::sleep(PATIENCE);
                let bar = bar.upgrade().filter(|bar| !bar.is_finished());
                if let Some(bar) = bar {
                    bar.set_draw_target(ProgressDrawTarget::stderr());
                    bar.enable_steady_tick(TICK);
                }
            });
        }
        Self(Steps { shown, bar, told: Arc::new(Mutex::new(Instant::now())) })
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

/// Formats parts of items: `12/40, 3 minutes left`, without the time while it is not known.
fn status(parts: u64, of: Option<u64>, left: Duration) -> String {
    let total = of.unwrap_or(0) / PARTS;
    let done = ((parts + PARTS / 1000) / PARTS).min(total);
    match left.as_secs() {
        0 => format!("{done}/{total}"),
        _ => format!("{done}/{total}, {} left", HumanDuration(left)),
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
        if self.shown == Shown::Lines {
            let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
            if told.elapsed() >= LINES {
                *told = Instant::now();
                let status = status(self.bar.position(), self.bar.length(), self.bar.eta());
                tell(format_args!("unlift: {status}: {}", self.bar.message()));
            }
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
        let said = || status(bar.position(), bar.length(), Duration::ZERO);
        progress.show(0, 2, "a.jpg");
        (0..2).for_each(|_| progress.0.add(1.0 / 3.0, ""));
        assert_eq!((said(), bar.message()), ("0/2".to_owned(), "a.jpg".to_owned()));
        progress.0.add(1.0 / 3.0, "b.jpg");
        assert_eq!((said(), bar.message()), ("1/2".to_owned(), "b.jpg".to_owned()));
        (0..2).for_each(|_| progress.0.add(1.0, ""));
        progress.show(1, 2, "");
        assert_eq!(said(), "2/2");
        let minutes = status(3 * PARTS, Some(4 * PARTS), Duration::from_secs(150));
        assert_eq!(minutes, "3/4, 3 minutes left");
    }
}
