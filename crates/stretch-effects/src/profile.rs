//! A command that is followed with a greatest rate and a greatest acceleration.

use alloc::{boxed::Box, format, vec};

use crate::{
    kind::{Kind, Side},
    operator::{Operator, Span, Start},
    parameter::EffectParameter,
    sketch::Sketch,
};

/// The trapezoid profile of a servo: y goes to x as quickly as |y'| <= rate and |y''| <= acceleration allow, and brakes in time to stop
/// there. In steps of length h the greatest speed from which it stops within d is
///
/// ```text
/// v = a h/2 (sqrt(1 + 8 d/(a h^2)) - 1)
/// ```
///
/// so that it arrives without a rest. Remembers y and its speed.
///
/// ```
/// use stretch_effects::{Grid, Operator, Profile, Span, Start};
/// let servo = Profile { acceleration: 1.0, rate: 2.0 };
/// let (mut cells, mut signal) = ([0.0; 2], [6.0; 10]);
/// servo.begin(Start::Settled, 0.0, &mut cells);
/// servo.run(&Span { first_node: 1, ..Span::whole(&Grid::samples(1.0)?) }, &mut cells, &mut signal);
/// // Up to two a second and down again.
/// assert_eq!(signal[..5], [1.0, 3.0, 5.0, 6.0, 6.0]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    /// Greatest acceleration, units/s^2, above 0.
    pub acceleration: f64,
    /// Greatest rate, units/s, above 0.
    pub rate: f64,
}

impl Operator for Profile {
    fn cells(&self) -> usize {
        2
    }

    fn begin(&self, _start: Start, first: f64, cells: &mut [f64]) {
        cells.copy_from_slice(&[first, 0.0]);
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let [mut y, mut v] = [cells[0], cells[1]];
        let a = self.acceleration;
        span.each(signal.len(), |step, i| {
            if let Some(step) = step {
                let h = span.grid.steps()[step];
                let apart = signal[i] - y;
                let d = apart.abs();
                let stops = 0.5 * a * h * (libm::sqrt(1.0 + 8.0 * d / (a * h * h)) - 1.0);
                let wanted = stops.min(d / h).min(self.rate).copysign(apart);
                let (low, high) = (v - a * h, v + a * h);
                v = wanted.max(low).min(high);
                // Where it arrives it is the value itself, to the last bit.
                y = if v == apart / h { signal[i] } else { y + v * h };
            }
            signal[i] = y;
        });
        cells.copy_from_slice(&[y, v]);
    }
}

/// A trapezoid profile of a command.
pub static PROFILE: Kind = Kind {
    name: "profile",
    title: "a limit of rate and acceleration",
    words: "a servo follows its command with a greatest rate and a greatest acceleration (trapezoid profile)",
    equation: "|y''| <= acceleration, |y'| <= rate, y goes to x and stops there",
    usual: &[Side::Input],
    // At an acceleration that turns the quickest possible change within a sample nothing is limited.
    parameters: |e, unit| {
        let (slow, dt) = (SLOWEST * e.late_s(), e.dt_s);
        let span = e.span().max(f64::MIN_POSITIVE);
        let (least, off) = (4.0 * span / (slow * slow), 2.0 * span / (dt * dt));
        vec![
            EffectParameter::sized("acceleration", &format!("{unit}/s^2"), least.min(off)..=off)
                .off_at(off)
                .log(),
            EffectParameter::shaped("rate", &format!("{unit}/s"), span / slow..=span / dt),
        ]
    },
    starts: Some(|e| {
        // So long a way from end to end takes, with and without a stretch at the greatest rate.
        let of = |takes: f64, share: f64| {
            let (a, v) = (4.0 * e.span() / (takes * takes), 2.0 * e.span() / takes);
            vec![a / share, v * share]
        };
        [(0.5, 1.0), (0.5, 0.5), (2.0, 1.0), (2.0, 0.5)]
            .map(|(late, share)| of(late * e.late_s(), share))
            .into()
    }),
    operator: |v, _, _| Box::new(Profile { acceleration: v[0], rate: v[1] }),
    sketch: Some(|v, _, signals| {
        let body = "let apart = x - s.at
            let d = abs(apart)
            let stops = A * DT / 2 * (sqrt(1 + 8 * d / (A * DT * DT)) - 1)
            var wanted = min(min(stops, d / DT), RATE)
            if apart < 0
            wanted = -wanted
            end
            s.speed = min(max(wanted, s.speed - A * DT), s.speed + A * DT)
            s.at = s.at + s.speed * DT
            let y = s.at";
        let unit = &signals.x.unit;
        let units = [format!("{unit}/s^2"), format!("{unit}/s")];
        Sketch::of(signals.x.clone(), body)
            .remembering(["at"])
            .cells(["speed"], units[1].clone(), "0")
            .with_all(&[("A", v[0], &*units[0]), ("RATE", v[1], &*units[1])])
            .with("DT", signals.dt_s, "s")
    }),
    twins: &["slew_limit", "second_order_lag", "lag", "delay"],
    ..Kind::PLAIN
};

/// Longest way from end to end, in longest delays.
const SLOWEST: f64 = 10.0;
