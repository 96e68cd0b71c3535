//! The live plot.

use std::{collections::VecDeque, io, time::Duration};

use ratatui::{
    DefaultTerminal,
    crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers},
    layout::{Constraint, Layout},
    style::{Color, Style},
    symbols::Marker,
    text::Line,
    widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph},
};

use super::{record::Sample, status::Status, twin::Twin};

/// Seconds that the plot shows.
const SPAN_S: f64 = 20.0;

pub(crate) struct Screen {
    terminal: DefaultTerminal,
    points: VecDeque<(f64, f64)>,
    unit: String,
    /// What the axis shows at least: the calibrated span, where it is known.
    bounds: Option<[f64; 2]>,
}

impl Screen {
    /// Takes the terminal; it is given back by `drop`, and when the program panics.
    pub(crate) fn open(twin: &Twin) -> io::Result<Self> {
        Ok(Self {
            terminal: ratatui::try_init()?,
            points: VecDeque::new(),
            unit: twin.unit.clone(),
            bounds: twin.span,
        })
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
        while event::poll(Duration::ZERO)? {
            if let Event::Key(key) = event::read()? {
                let ctrl_c =
                    key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
                let stop = matches!(key.code, KeyCode::Char('q') | KeyCode::Esc) || ctrl_c;
                if key.kind == KeyEventKind::Press && stop {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    pub(crate) fn draw(&mut self, status: &Status) -> io::Result<()> {
        let points: &[(f64, f64)] = self.points.make_contiguous();
        let newest = points.last().copied();
        let end = newest.map_or(SPAN_S, |(t, _)| t.max(SPAN_S));
        let around = newest.map_or([0.0, 1.0], |(_, y)| [y - 1.0, y + 1.0]);
        let bounds = self.bounds.unwrap_or(around);
        let [low, high] =
            points.iter().fold(bounds, |[low, high], &(_, y)| [low.min(y), high.max(y)]);
        let unit = &self.unit;
        let title = match newest {
            Some((_, estimate)) => format!(" {estimate:.3} {unit} "),
            None => " no estimate yet ".to_owned(),
        };
        let label = |x: f64| Line::from(format!("{x:.1}"));
        let chart = Chart::new(vec![
            Dataset::default()
                .marker(Marker::Braille)
                .graph_type(GraphType::Line)
                .style(Style::default().fg(Color::Cyan))
                .data(points),
        ])
        .block(Block::bordered().title(title))
        .x_axis(Axis::default().title("s").bounds([end - SPAN_S, end]).labels([
            label(end - SPAN_S),
            label(end - SPAN_S / 2.0),
            label(end),
        ]))
        .y_axis(Axis::default().title(unit.as_str()).bounds([low, high]).labels([
            label(low),
            label(0.5 * (low + high)),
            label(high),
        ]));
        let foot = Paragraph::new(vec![Line::from(status.line()), Line::from("q ends it")]);
        self.terminal.draw(|frame| {
            let [plot, below] =
                Layout::vertical([Constraint::Min(5), Constraint::Length(2)]).areas(frame.area());
            frame.render_widget(chart, plot);
            frame.render_widget(foot, below);
        })?;
        Ok(())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // its own `restore` says on standard error that it failed, and panics where that is full
        let _ = ratatui::try_restore();
    }
}
