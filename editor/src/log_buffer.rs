//! The newest log lines, for the Log panel. Enters: tracing events. Leaves: lines with level and time since the start.
//! Old lines are forgotten; it knows no window.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::layer::{Context, SubscriberExt};
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{EnvFilter, Layer};

/// Most lines kept.
const MOST_LINES: usize = 2000;
/// What is logged when RUST_LOG says nothing.
const DEFAULT_FILTER: &str =
    "warn,winit=error,caustica=info,caustica_scene=info,caustica_renderer=info,caustica_gpu=info";

/// One line of the log.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    /// Seconds since the program started.
    pub seconds: f64,
    /// How bad it is.
    pub level: Level,
    /// Who says it.
    pub target: String,
    /// What it says, one line.
    pub text: String,
}

/// The newest lines; clones share them.
#[derive(Clone, Debug)]
pub struct LogBuffer {
    lines: Arc<Mutex<VecDeque<LogLine>>>,
    start: Instant,
}

impl Default for LogBuffer {
    fn default() -> Self {
        Self { lines: Arc::default(), start: Instant::now() }
    }
}

impl LogBuffer {
    /// Adds a line.
    pub fn push(&self, level: Level, target: &str, text: String) {
        let line =
            LogLine { seconds: self.start.elapsed().as_secs_f64(), level, target: target.to_owned(), text };
        if let Ok(mut lines) = self.lines.lock() {
            if lines.len() == MOST_LINES {
                lines.pop_front();
            }
            lines.push_back(line);
        }
    }

    /// Reads the lines, oldest first.
    pub fn read<R>(&self, reader: impl FnOnce(&VecDeque<LogLine>) -> R) -> R {
        match self.lines.lock() {
            Ok(lines) => reader(&lines),
            Err(poisoned) => reader(&poisoned.into_inner()),
        }
    }

    /// Forgets every line.
    pub fn clear(&self) {
        if let Ok(mut lines) = self.lines.lock() {
            lines.clear();
        }
    }
}

/// Feeds a [`LogBuffer`] from tracing.
pub struct LogLayer {
    buffer: LogBuffer,
}

impl LogLayer {
    /// A layer that writes into `buffer`.
    pub fn new(buffer: LogBuffer) -> Self {
        Self { buffer }
    }
}

impl<S: Subscriber> Layer<S> for LogLayer {
    fn on_event(&self, event: &Event<'_>, _context: Context<'_, S>) {
        let mut text = LineText::default();
        event.record(&mut text);
        let metadata = event.metadata();
        self.buffer.push(*metadata.level(), metadata.target(), text.0);
    }
}

#[derive(Default)]
struct LineText(String);

impl Visit for LineText {
    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        if !self.0.is_empty() {
            self.0.push(' ');
        }
        // Writing into a String does not fail.
        let _ = match field.name() {
            "message" => write!(self.0, "{value:?}"),
            name => write!(self.0, "{name}={value:?}"),
        };
    }
}

/// Sends log events to standard error and to a buffer; RUST_LOG chooses which. Where a subscriber stands already the
/// buffer stays empty apart from what the window itself adds.
pub fn install() -> LogBuffer {
    let buffer = LogBuffer::default();
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(DEFAULT_FILTER));
    let installed = tracing_subscriber::registry()
        .with(filter)
        .with(tracing_subscriber::fmt::layer().with_writer(std::io::stderr).without_time())
        .with(LogLayer::new(buffer.clone()))
        .try_init();
    if installed.is_err() {
        buffer.push(
            Level::WARN,
            "caustica",
            "another log subscriber is active: the log is not shown here".to_owned(),
        );
    }
    buffer
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_become_lines_and_old_lines_go() {
        let buffer = LogBuffer::default();
        let subscriber = tracing_subscriber::registry().with(LogLayer::new(buffer.clone()));
        tracing::subscriber::with_default(subscriber, || {
            for n in 0..MOST_LINES + 5 {
                tracing::warn!(count = n, "imported {}", "chair.glb");
            }
        });
        buffer.read(|lines| {
            assert_eq!(lines.len(), MOST_LINES);
            assert_eq!(lines[0].level, Level::WARN);
            assert!(
                lines[0].text.contains("imported chair.glb") && lines[0].text.contains("count=5"),
                "{:?}",
                lines[0]
            );
        });
        buffer.clear();
        buffer.read(|lines| assert!(lines.is_empty()));
    }
}
