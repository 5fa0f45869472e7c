//! Progress on stderr: only on a terminal, and only for what takes longer than a second.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Shorter work shows nothing.
const PATIENCE: Duration = Duration::from_secs(1);

/// A progress bar that appears once it is worth it.
pub struct Progress {
    bar: ProgressBar,
    started: Instant,
    wanted: bool,
}

impl Progress {
    /// A bar for work that begins now; none at all when `quiet` or when stderr is no terminal.
    pub fn new(quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        let template = "{bar:30} {pos}/{len} {wide_msg}";
        bar.set_style(ProgressStyle::with_template(template).expect("the template is ours"));
        Self { bar, started: Instant::now(), wanted: !quiet && std::io::stderr().is_terminal() }
    }

    /// `done` of `total` steps are made; `what` is next.
    pub fn show(&mut self, done: usize, total: usize, what: &str) {
        if !self.wanted {
            return;
        }
        if self.bar.is_hidden() && self.started.elapsed() >= PATIENCE {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.set_length(total as u64);
        self.bar.set_position(done as u64);
        self.bar.set_message(what.to_owned());
    }

    /// Prints a line on stderr without tearing the bar.
    pub fn say(&self, line: &str) {
        self.voice().say(line);
    }

    /// The same for whoever has something to say while another one shows progress.
    pub fn voice(&self) -> Voice {
        Voice(self.bar.clone())
    }
}

/// Prints lines on stderr beside a progress bar.
#[derive(Clone)]
pub struct Voice(ProgressBar);

impl Voice {
    /// Prints a line on stderr without tearing the bar.
    pub fn say(&self, line: &str) {
        self.0.suspend(|| eprintln!("{line}"));
    }
}

/// A sign of life for work whose steps cannot be counted; gone when dropped. Hidden where stderr is no
/// terminal.
pub struct Spinner(ProgressBar);

impl Spinner {
    /// Says `what` is being done.
    pub fn new(what: &'static str) -> Self {
        let bar = ProgressBar::new_spinner().with_message(what);
        bar.enable_steady_tick(PATIENCE / 8);
        Self(bar)
    }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
