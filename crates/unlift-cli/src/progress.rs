//! Progress on stderr for work of more than a second: a bar on a terminal, otherwise a line per
//! minute. `--quiet` disables both.

use std::io::IsTerminal;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use unlift::OneLine;

use crate::pace::Pace;
use crate::stderr::tell;

/// Work that takes less time shows no progress.
const PATIENCE: Duration = Duration::from_secs(1);
/// Interval at which a bar is redrawn, so that the remaining time counts down.
const TICK: Duration = Duration::from_millis(500);
/// Shortest interval between lines in a log.
const LINES: Duration = Duration::from_secs(60);
/// Steps of a bar per item, so that it moves within items.
const PARTS: f64 = 1000.0;

#[derive(Clone, Copy)]
enum Shown {
    Nothing,
    /// A bar, with its draw target.
    Bar(fn() -> ProgressDrawTarget),
    /// Lines, with the time of the last one.
    Lines(Duration),
}

/// Progress over countable items; removed when dropped.
pub struct Progress(Steps);

/// A handle with which any thread can report progress.
#[derive(Clone)]
pub struct Steps {
    started: Instant,
    state: Arc<Mutex<State>>,
    bar: ProgressBar,
}

struct State {
    pace: Pace,
    shown: Shown,
    what: String,
}

impl Progress {
    /// Starts the progress of new work.
    pub fn new(quiet: bool) -> Self {
        Self::with(match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => Shown::Nothing,
            (false, true) => Shown::Bar(ProgressDrawTarget::stderr),
            (false, false) => Shown::Lines(Duration::ZERO),
        })
    }

    fn with(shown: Shown) -> Self {
        let started = Instant::now();
        let state =
            Arc::new(Mutex::new(State { pace: Pace::default(), shown, what: String::new() }));
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        let template = "{bar:30} {status} {wide_msg}";
        let style = ProgressStyle::with_template(template).expect("the template is ours");
        let of_bar = Arc::clone(&state);
        bar.set_style(style.with_key(
            "status",
            move |_: &ProgressState, text: &mut dyn std::fmt::Write| {
                // A failed write only loses the status.
                let _ = write!(text, "{}", lock(&of_bar).pace.status(started.elapsed()));
            },
        ));
        if let Shown::Bar(target) = shown {
            // In a thread, because the first step may take a minute.
            let bar = bar.downgrade();
            std::thread::spawn(move || {
                std::thread::sleep(PATIENCE);
                let bar = bar.upgrade().filter(|bar| !bar.is_finished());
                if let Some(bar) = bar {
                    bar.set_draw_target(target());
                    bar.enable_steady_tick(TICK);
                }
            });
        }
        Self(Steps { started, state, bar })
    }

    /// Sets `done` of `total` items as finished; `what` is the next item.
    pub fn show(&self, done: usize, total: usize, what: &str) {
        self.0.tell(what, |pace, now| pace.set(done as f64, total, now));
    }

    /// Ends this progress and starts that of further work.
    pub fn again(&self) -> Self {
        self.0.bar.finish_and_clear();
        Self::with(match lock(&self.0.state).shown {
            Shown::Lines(_) => Shown::Lines(Duration::ZERO),
            shown => shown,
        })
    }

    /// Prints a line on stderr without breaking the bar.
    pub fn say(&self, line: &str) {
        self.0.say(line);
    }

    pub fn steps(&self) -> Steps {
        self.0.clone()
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
        self.tell(what, |pace, now| pace.add(share, now));
    }

    /// Prints a line on stderr without breaking the bar.
    pub fn say(&self, line: &str) {
        self.bar.suspend(|| tell(line));
    }

    fn tell(&self, what: &str, step: impl FnOnce(&mut Pace, Duration)) {
        let now = self.started.elapsed();
        let mut state = lock(&self.state);
        step(&mut state.pace, now);
        if !what.is_empty() {
            state.what = OneLine(what).to_string();
        }
        let State { pace, shown, what } = &mut *state;
        match shown {
            Shown::Nothing => {}
            Shown::Lines(last) => {
                if now.saturating_sub(*last) >= LINES {
                    *last = now;
                    tell(format_args!("unlift: {}: {what}", pace.status(now)));
                }
            }
            Shown::Bar(_) => {
                let (pace, what) = (pace.clone(), what.clone());
                // Drawing the bar locks the state.
                drop(state);
                self.bar.set_length((pace.total() as f64 * PARTS) as u64);
                self.bar.set_message(what);
                self.bar.set_position((pace.done() * PARTS) as u64);
            }
        }
    }
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
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
    use indicatif::TermLike;
    use std::io;

    static DRAWN: Mutex<Vec<String>> = Mutex::new(Vec::new());

    #[derive(Debug)]
    struct Paper;

    impl TermLike for Paper {
        fn width(&self) -> u16 {
            100
        }
        fn move_cursor_up(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_down(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_right(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_left(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn write_line(&self, text: &str) -> io::Result<()> {
            self.write_str(text)
        }
        fn write_str(&self, text: &str) -> io::Result<()> {
            DRAWN.lock().unwrap().push(text.to_owned());
            Ok(())
        }
        fn clear_line(&self) -> io::Result<()> {
            Ok(())
        }
        fn flush(&self) -> io::Result<()> {
            Ok(())
        }
    }

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
    fn what_is_at_work_is_said_also_where_only_a_share_is_told() {
        let progress = Progress::with(Shown::Lines(Duration::ZERO));
        progress.show(0, 4, "a.jpg");
        progress.steps().add(0.5, "");
        assert_eq!(lock(&progress.0.state).what, "a.jpg");
    }

    fn wait_until(done: impl Fn() -> bool) {
        let started = Instant::now();
        while !done() {
            // A busy machine may take a while.
            assert!(started.elapsed() < Duration::from_secs(20), "{:?}", DRAWN.lock().unwrap());
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    #[test]
    fn a_bar_counts_tells_what_is_left_and_moves_at_least_once_a_second() {
        let progress = Progress::with(Shown::Bar(|| {
            ProgressDrawTarget::term_like_with_hz(Box::new(Paper), 20)
        }));
        let frames = || DRAWN.lock().unwrap().clone();
        progress.show(0, 4, "a.jpg");
        assert_eq!(frames(), [""; 0], "too early");
        // The bar appears and moves without further steps.
        wait_until(|| frames().iter().any(|f| f.contains("0/4") && f.contains("a.jpg")));
        let steps = progress.steps();
        std::thread::spawn(move || steps.add(1.0, "b.jpg")).join().unwrap();
        wait_until(|| frames().iter().any(|f| f.contains("1/4") && f.contains("left b.jpg")));
        let before = frames().len();
        std::thread::sleep(Duration::from_secs(1));
        assert!(frames().len() > before, "no step was made, and nothing moved");
    }
}
