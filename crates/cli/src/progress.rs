//! How long work is told: a bar on a terminal, plain lines elsewhere, nothing when quiet. Always standard error.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{HumanCount, HumanDuration, ProgressBar, ProgressStyle};

/// Seconds between plain lines.
const LINE_INTERVAL: f64 = 2.0;
/// What has to be done before the rest can be told from it.
const LEAST_SHARE: f64 = 2e-3;

/// Until when a solve goes on.
#[derive(Clone, Copy, Debug)]
pub enum Goal {
    /// A number of rays.
    Rays(u64),
    /// Seconds.
    Seconds(f64),
    /// A relative error, as estimated.
    Error(f64),
    /// A number of rays, or seconds, whichever comes first.
    First(u64, f64),
}

/// Progress of one solve.
#[derive(Debug)]
pub struct Progress {
    start: Instant,
    goal: Goal,
    unit: &'static str,
    /// Rays that were there before the clock started.
    before: u64,
    /// How long the clock stood still.
    rested: Duration,
    shown: Shown,
    last_line: f64,
}

#[derive(Debug)]
enum Shown {
    Nothing,
    Lines,
    Bar(ProgressBar),
}

impl Progress {
    /// Starts the clock.
    pub fn new(goal: Goal, quiet: bool) -> Self {
        let shown = Shown::new(quiet);
        Self { start: Instant::now(), goal, unit: "rays", before: 0, rested: Duration::ZERO, shown, last_line: 0.0 }
    }

    /// Counts something else than rays.
    pub fn counting(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    /// Goes on from so many rays.
    pub fn after(self, before: u64) -> Self {
        Self { before, ..self }
    }

    /// Seconds since the start, rests left out.
    pub fn seconds(&self) -> f64 {
        self.start.elapsed().saturating_sub(self.rested).as_secs_f64()
    }

    /// So long nothing was done: it counts for no goal and no rate.
    pub fn rest(&mut self, how_long: Duration) {
        self.rested += how_long;
    }

    /// True once the goal is reached; the error is asked for only where it is the goal.
    pub fn is_reached(&self, rays: u64, relative_error: impl FnOnce() -> f64) -> bool {
        match self.goal {
            Goal::Rays(n) => rays >= n,
            Goal::Seconds(s) => self.seconds() >= s,
            Goal::Error(e) => relative_error() <= e,
            Goal::First(n, s) => rays >= n || self.seconds() >= s,
        }
    }

    /// True if an update would be shown now: errors are not estimated for nobody.
    pub fn wants_update(&self) -> bool {
        match self.shown {
            Shown::Nothing => false,
            Shown::Lines => self.seconds() - self.last_line >= LINE_INTERVAL,
            Shown::Bar(_) => true,
        }
    }

    /// Tells how far the solve is.
    pub fn update(&mut self, rays: u64, relative_error: f64) {
        let seconds = self.seconds();
        let rate = rays.saturating_sub(self.before) as f64 / seconds.max(1e-9);
        let (share, left) = match self.goal {
            Goal::Rays(n) => (rays as f64 / n as f64, n.saturating_sub(rays) as f64 / rate.max(1e-9)),
            Goal::First(n, s) => {
                let left = (n.saturating_sub(rays) as f64 / rate.max(1e-9)).min((s - seconds).max(0.0));
                ((rays as f64 / n as f64).max(seconds / s), left)
            }
            Goal::Seconds(s) => (seconds / s, (s - seconds).max(0.0)),
            // The error falls as the root of rays, or a little faster.
            Goal::Error(e) => {
                let share = (e / relative_error.max(1e-12)).powi(2).min(1.0);
                (share, rays as f64 * (1.0 / share - 1.0) / rate.max(1e-9))
            }
        };
        let message = format!(
            "{} {}  {:.2} M/s  error ≈ {:.2} %  {} left",
            HumanCount(rays),
            self.unit,
            rate * 1e-6,
            100.0 * relative_error,
            HumanDuration(Duration::from_secs_f64(left.min(1e9)))
        );
        self.shown.tell(share, message);
        self.last_line = seconds;
    }

    /// Says something in between: in a line of its own where there are lines.
    pub fn say(&self, text: &str) {
        match &self.shown {
            Shown::Lines => crate::say!("{text}"),
            Shown::Nothing | Shown::Bar(_) => {}
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.shown.finish();
    }
}

impl Shown {
    fn new(quiet: bool) -> Self {
        if quiet {
            Self::Nothing
        } else if std::io::stderr().is_terminal() {
            let bar = ProgressBar::new(1000);
            bar.set_style(ProgressStyle::with_template("{bar:30} {percent:>3}%  {msg}").expect("a fixed template"));
            Self::Bar(bar)
        } else {
            Self::Lines
        }
    }

    fn tell(&self, share: f64, message: String) {
        match self {
            Self::Nothing => {}
            Self::Lines => crate::say!("{:3.0} %  {message}", 100.0 * share.min(1.0)),
            Self::Bar(bar) => {
                bar.set_position((1000.0 * share.min(1.0)) as u64);
                bar.set_message(message);
            }
        }
    }

    fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

/// Progress of many pictures.
#[derive(Debug)]
pub struct FrameProgress {
    start: Instant,
    total: usize,
    done: usize,
    what: &'static str,
    shown: Shown,
    last_line: f64,
}

impl FrameProgress {
    /// Starts the clock for so many pictures.
    pub fn new(total: usize, quiet: bool) -> Self {
        Self { start: Instant::now(), total, done: 0, what: "frame", shown: Shown::new(quiet), last_line: 0.0 }
    }

    /// Counts something else than frames.
    pub fn counting(self, what: &'static str) -> Self {
        Self { what, ..self }
    }

    /// One more is done.
    pub fn advance(&mut self) {
        self.done += 1;
        self.update(0.0);
    }

    /// Tells how much of the next one is done.
    pub fn update(&mut self, share_of_next: f64) {
        let seconds = self.seconds();
        if matches!(self.shown, Shown::Nothing) || self.done >= self.total {
            return;
        }
        if matches!(self.shown, Shown::Lines) && seconds - self.last_line < LINE_INTERVAL {
            return;
        }
        let share = (self.done as f64 + share_of_next.clamp(0.0, 1.0)) / self.total as f64;
        let left = seconds * (1.0 / share.max(1e-9) - 1.0);
        let left = HumanDuration(Duration::from_secs_f64(left.min(1e9)));
        let which = if self.total > 1 { format!(" {} of {}", self.done + 1, self.total) } else { String::new() };
        // Of next to nothing, nobody can tell.
        let left = if share > LEAST_SHARE { format!("  {left} left") } else { String::new() };
        self.shown.tell(share, format!("{}{which}{left}", self.what));
        self.last_line = seconds;
    }

    /// Seconds since the start.
    pub fn seconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.shown.finish();
    }
}
