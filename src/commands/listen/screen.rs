//! The live plot.

use std::{
    collections::VecDeque,
    io::{self, Read, Write},
};

use terminal_size::{Height, Width, terminal_size};

use super::{plot::curve, status::Status, trial_file::Sample, twin::Twin};

/// Seconds that the plot shows.
const SPAN_S: f64 = 20.0;
/// Columns of the numbers at the left of the plot.
const NUMBERS: usize = 10;
/// Rows around the plot: the estimate above; time, status and what ends it below.
const AROUND: usize = 4;
/// Another screen, without a cursor; and back.
#[cfg(unix)]
const ENTER: &str = "\x1b[?1049h\x1b[?25l";
const LEAVE: &str = "\x1b[?25h\x1b[?1049l";

pub(crate) struct Screen {
    #[cfg(unix)]
    before: rustix::termios::Termios,
    points: VecDeque<(f64, f64)>,
    unit: String,
    /// What the axis shows at least: the calibrated span, where it is known.
    bounds: Option<[f64; 2]>,
}

impl Screen {
    /// Takes the terminal, whose keys then come one by one and unseen; it is given back by `drop`.
    #[cfg(unix)]
    pub(crate) fn open(twin: &Twin) -> io::Result<Self> {
        use rustix::termios::{OptionalActions, SpecialCodeIndex, tcgetattr, tcsetattr};
        let before = tcgetattr(io::stdin())?;
        let mut raw = before.clone();
        raw.make_raw();
        // a read that finds no key hands back none
        raw.special_codes[SpecialCodeIndex::VMIN] = 0;
        raw.special_codes[SpecialCodeIndex::VTIME] = 0;
        tcsetattr(io::stdin(), OptionalActions::Now, &raw)?;
        let screen =
            Self { before, points: VecDeque::new(), unit: twin.unit.clone(), bounds: twin.span };
        show(ENTER)?;
        Ok(screen)
    }

    /// Keys that come one by one are asked for on Unix only.
    #[cfg(not(unix))]
    pub(crate) fn open(_twin: &Twin) -> io::Result<Self> {
        Err(io::ErrorKind::Unsupported.into())
    }

    pub(crate) fn push(&mut self, sample: &Sample) {
        if let Some(estimate) = sample.estimate {
            self.points.push_back((sample.time_s, estimate));
        }
        while self.points.front().is_some_and(|(t, _)| *t < sample.time_s - SPAN_S) {
            self.points.pop_front();
        }
    }

    /// Whether a key asked for the end: q, Escape, or Ctrl-C, which is no signal here.
    pub(crate) fn asked_to_stop(&self) -> io::Result<bool> {
        let mut keys = [0; 64];
        let count = io::stdin().read(&mut keys)?;
        // other keys begin with an escape, too
        let is_escape = keys[..count] == [0x1b];
        let is_end = |key: &u8| [b'q', 0x03].contains(key);
        Ok(is_escape || keys[0] != 0x1b && keys[..count].iter().any(is_end))
    }

    pub(crate) fn draw(&mut self, status: &Status) -> io::Result<()> {
        let (columns, rows) = terminal_size().map_or((80, 24), |(Width(w), Height(h))| (w, h));
        let (columns, rows) = (usize::from(columns), usize::from(rows));
        let points: &[(f64, f64)] = self.points.make_contiguous();
        let newest = points.last().copied();
        let end = newest.map_or(SPAN_S, |(t, _)| t.max(SPAN_S));
        let around = newest.map_or([0.0, 1.0], |(_, y)| [y - 1.0, y + 1.0]);
        let bounds = self.bounds.unwrap_or(around);
        let [low, high] =
            points.iter().fold(bounds, |[low, high], &(_, y)| [low.min(y), high.max(y)]);
        let title = match newest {
            Some((_, estimate)) => format!("{estimate:.3} {}", self.unit),
            None => "no estimate yet".to_owned(),
        };
        let (wide, tall) = (columns.saturating_sub(NUMBERS), rows.saturating_sub(AROUND));
        let drawn = curve(points, [[end - SPAN_S, end], [low, high]], (wide, tall));
        let number = |row: usize| match row {
            0 => format!("{high:.1}"),
            row if row + 1 == tall => format!("{low:.1}"),
            row if row == tall / 2 => format!("{:.1}", 0.5 * (low + high)),
            _ => String::new(),
        };
        let mut lines = vec![title];
        let bordered = drawn.iter().enumerate();
        lines.extend(bordered.map(|(row, text)| format!("{:>8} \u{2502}{text}", number(row))));
        let begin = format!("{:.1} s", end - SPAN_S);
        let far = wide.saturating_sub(begin.len());
        lines.push(format!("{:NUMBERS$}{begin}{:>far$}", "", format!("{end:.1} s")));
        lines.extend([status.line(), "q ends it".to_owned()]);
        let cut = |line: &String| line.chars().take(columns).collect::<String>();
        let lines: Vec<String> = lines.iter().take(rows).map(cut).collect();
        // from the upper left corner, each line to its end, and nothing below
        show(&format!("\x1b[H{}\x1b[J", lines.join("\x1b[K\r\n")))
    }
}

fn show(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())?;
    out.flush()
}

impl Drop for Screen {
    fn drop(&mut self) {
        // where the terminal has gone there is nothing to give back
        let _ = show(LEAVE);
        #[cfg(unix)]
        let _ = rustix::termios::tcsetattr(
            io::stdin(),
            rustix::termios::OptionalActions::Now,
            &self.before,
        );
    }
}
