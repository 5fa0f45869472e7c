//! Progress on stderr for work of more than a second: a bar on a terminal, otherwise a line per minute. `--quiet` disables both.

use std::fmt::Write;
use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use indicatif::{
    HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle, WeakProgressBar,
};
use unlift::OneLine;

use crate::output::tell;

/// Work that takes less time shows no progress.
const PATIENCE: Duration = Duration::from_secs(1);
/// Interval at which a bar is redrawn, so that the remaining time counts down.
const TICK: Duration = Duration::from_millis(500);
/// Shortest interval between lines in a log.
const LINES: Duration = Duration::from_secs(60);
/// Seconds of a day, the longest time that is estimated.
const A_DAY: f64 = 86_400.0;
/// The progress that started last, for an interrupt.
static CURRENT: Mutex<Option<WeakProgressBar>> = Mutex::new(None);

/// Exit code after an interrupt, as shells have it.
const INTERRUPTED: i32 = 130;
/// Steps of a bar per item, so that it moves within items. Fractions are rounded to them.
const PARTS: u64 = 1_000_000;

/// The progress of some work, which any thread can report; removed when dropped.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Starts the progress over countable items.
    pub fn new(quiet: bool) -> Self {
        Self::start(quiet, "{bar:30} {status} {wide_msg}")
    }

    /// Starts the progress of work whose steps cannot be counted: shows `what` and the elapsed time.
    pub fn uncounted(quiet: bool, what: &'static str) -> Self {
        let progress = Self::start(quiet, "{spinner} {msg}, {elapsed}");
        progress.bar.set_message(what);
        progress
    }

    fn start(quiet: bool, template: &str) -> Self {
        // A hidden bar still counts and estimates.
        let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::hidden());
        let style = ProgressStyle::with_template(template).expect("the template is ours");
        bar.set_style(style.with_key("status", |state: &ProgressState, text: &mut dyn Write| {
            // A failed write only loses the status.
            let _ = text.write_str(&status(state.pos(), state.len(), state.elapsed()));
        }));
        let current = || CURRENT.lock().unwrap_or_else(PoisonError::into_inner);
        *current() = Some(bar.downgrade());
        // The first handler stays, and tells of the progress that started last.
        let _ = ctrlc::set_handler(move || {
            let last = current().take();
            if let Some(bar) = last.and_then(|bar| bar.upgrade()) {
                let done = line(&bar);
                bar.finish_and_clear();
                tell(format_args!("unlift: interrupted at {done}"));
            }
            tell("  try: nothing is written: run it again, or in parts, each with its own --out");
            std::process::exit(INTERRUPTED);
        });
        if !quiet {
            // In a thread, because a step may take minutes.
            let bar = bar.downgrade();
            let on_terminal = std::io::stderr().is_terminal();
            std::thread::spawn(move || {
                std::thread::sleep(if on_terminal { PATIENCE } else { LINES });
                while let Some(bar) = bar.upgrade().filter(|bar| !bar.is_finished()) {
                    if on_terminal {
                        bar.set_draw_target(ProgressDrawTarget::stderr());
                        bar.enable_steady_tick(TICK);
                        return;
                    }
                    tell(format_args!("unlift: {}", line(&bar)));
                    drop(bar);
                    std::thread::sleep(LINES);
                }
            });
        }
        Self { bar }
    }

    fn name(&self, what: &str) {
        if !what.is_empty() {
            self.bar.set_message(OneLine(what).to_string());
        }
    }
}

/// Formats how far a bar is. Bars of work whose steps cannot be counted have no length.
fn line(bar: &ProgressBar) -> String {
    match bar.length() {
        Some(0) => format!("{}, {} s", bar.message(), bar.elapsed().as_secs()),
        length => format!("{}: {}", status(bar.position(), length, bar.elapsed()), bar.message()),
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
        // Another total is another stage: what an earlier one took says nothing about it.
        if self.bar.length() != Some(total as u64 * PARTS) {
            self.bar.reset();
            self.bar.set_length(total as u64 * PARTS);
        }
        // Fractions that threads added may already exceed `done`.
        self.bar.set_position(self.bar.position().max(done as u64 * PARTS));
        self.name(what);
    }

    fn add(&self, share: f64, what: &str) {
        self.bar.inc((share * PARTS as f64).round() as u64);
        self.name(what);
    }

    fn say(&self, line: &str) {
        // The line must not break the bar.
        self.bar.suspend(|| tell(format_args!("unlift: {line}")));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
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

#[cfg(test)]
mod tests {
    use unlift_audit::Progress as _;

    use super::*;

    #[test]
    fn parts_of_items_add_up_and_never_exceed_them() {
        let progress = Progress::new(true);
        let bar = &progress.bar;
        let status_now = || status(bar.position(), bar.length(), Duration::ZERO);
        progress.show(0, 2, "a.jpg");
        (0..2).for_each(|_| progress.add(1.0 / 3.0, ""));
        assert_eq!([status_now(), bar.message()], ["33 %", "a.jpg"]);
        progress.add(1.0 / 3.0, "b.jpg");
        assert_eq!([status_now(), bar.message()], ["50 %", "b.jpg"]);
        (0..2).for_each(|_| progress.add(1.0, ""));
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
