//! Limits of the rate, the acceleration and the jerk with which a servo follows a command.

use alloc::{boxed::Box, format, string::String, vec};

use crate::{
    grid::Grid,
    kind::{Kind, Side, Signals},
    moving_mean::MovingMean,
    operator::{Operator, Span, Start},
    parameter::EffectParameter,
    sketch::{Quantity, Sketch},
};

/// A limit of the rate: y moves towards x by at most rate h in a step of length h. The memory is y.
///
/// ```
/// use stretch_effects::{Grid, Operator, SlewLimit, Span, Start};
/// let (mut cells, mut signal) = ([0.0], [0.0, 1.0, 1.0, 1.0, 0.875]);
/// let valve = SlewLimit { rate: 4.0 };
/// valve.begin(Start::Settled, signal[0], &mut cells);
/// valve.run(&Span::whole(&Grid::samples(0.125)?), &mut cells, &mut signal);
/// assert_eq!(signal, [0.0, 0.5, 1.0, 1.0, 0.875]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlewLimit {
    /// Greatest rate, units/s, above 0.
    pub rate: f64,
}

impl Operator for SlewLimit {
    fn cells(&self) -> usize {
        1
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let mut y = cells[0];
        span.each(signal.len(), |step, i| {
            let most = step.map_or(f64::INFINITY, |step| self.rate * span.grid.steps()[step]);
            let apart = signal[i] - y;
            // Within reach the output equals the input to the last bit.
            y = if apart.abs() <= most { signal[i] } else { y + most.copysign(apart) };
            signal[i] = y;
        });
        cells[0] = y;
    }
}

/// A limit of the rate.
pub static SLEW_LIMIT: Kind = Kind {
    name: "slew_limit",
    title: "a limit of the rate",
    words: "it cannot change faster than a rate",
    equation: "|y'| <= rate, y follows x",
    usual: &[Side::Input, Side::Output],
    // A limit of twice the quickest recorded change has no effect.
    parameters: |e, unit| {
        let off = 2.0 * e.quickest.max(1e-9 * e.span() / e.dt_s);
        vec![EffectParameter::sized("rate", &format!("{unit}/s"), 0.01 * off..=off).off_at(off)]
    },
    starts: Some(|e| [0.45, 0.3, 0.15, 0.06].map(|k| vec![2.0 * k * e.quickest]).into()),
    operator: |v, _, _| Box::new(SlewLimit { rate: v[0] }),
    sketch: Some(|v, _, signals| {
        let body = "let most = RATE * DT
            s.at = max(s.at - most, min(s.at + most, x))
            let y = s.at";
        Sketch::of(signals.x.clone(), body)
            .with_all(&[
                ("RATE", v[0], &*format!("{}/s", signals.x.unit)),
                ("DT", signals.dt_s, "s"),
            ])
            .remembering(["at"])
    }),
    twins: &["lag", "profile"],
    ..Kind::PLAIN
};

/// The trapezoid profile of a servo: y moves to x as quickly as |y'| <= rate and |y''| <= acceleration allow, and
/// brakes in time to stop there. In steps of length h, the greatest speed from which it can stop within a distance d is
///
/// ```text
/// v = a h/2 (sqrt(1 + 8 d/(a h^2)) - 1)
/// ```
///
/// With this speed it reaches the target exactly. The memory is y and its speed.
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
                // On arrival the output equals the command to the last bit.
                y = if v == apart / h { signal[i] } else { y + v * h };
            }
            signal[i] = y;
        });
        cells.copy_from_slice(&[y, v]);
    }
}

/// The S profile of a servo: the [`MovingMean`] of a [`Profile`] over a time T. A move over a distance d from rest to
/// rest has seven segments. It takes d/rate + rate/acceleration + T if it reaches the rate, otherwise 2
/// sqrt(d/acceleration) + T. Rate and acceleration have the limits of the profile. The jerk is limited to
/// acceleration/T, or to twice that if the acceleration changes sign within T.
///
/// ```
/// use stretch_effects::{Grid, Operator, Profile, SProfile, Span, Start};
/// let grid = Grid::samples(0.01)?;
/// let servo = SProfile::new(&grid, Profile { acceleration: 20.0, rate: 2.0 }, 0.05);
/// let (mut cells, mut signal) = (vec![0.0; servo.cells()], [1.0; 80]);
/// servo.begin(Start::Settled, 0.0, &mut cells);
/// servo.run(&Span::whole(&grid), &mut cells, &mut signal);
/// // 1/2 + 2/20 + 0.05 = 0.65 s.
/// assert!(signal[62] < 1.0 && signal[65] == 1.0);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SProfile {
    profile: Profile,
    mean: MovingMean,
}

impl SProfile {
    /// An S profile from a trapezoid and the time over which its corners are rounded, s. A time of 0 gives the
    /// trapezoid to the last bit.
    pub fn new(grid: &Grid, profile: Profile, round_s: f64) -> Self {
        Self { profile, mean: MovingMean::new(grid, round_s) }
    }
}

impl Operator for SProfile {
    fn cells(&self) -> usize {
        self.profile.cells() + self.mean.cells()
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        let (own, past) = cells.split_at_mut(self.profile.cells());
        self.profile.begin(start, first, own);
        self.mean.begin(start, first, past);
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let (own, past) = cells.split_at_mut(self.profile.cells());
        self.profile.run(span, own, signal);
        self.mean.run(span, past, signal);
    }
}

/// Returns the code of one step of a trapezoid profile towards a command, with the given names of position and speed.
fn follows(command: &str, at: &str, speed: &str, k: &str) -> String {
    format!(
        "let apart{k} = {command} - s.{at}
            let d{k} = abs(apart{k})
            let stops{k} = A * DT / 2 * (sqrt(1 + 8 * d{k} / (A * DT * DT)) - 1)
            var wanted{k} = min(min(stops{k}, d{k} / DT), RATE)
            if apart{k} < 0
            wanted{k} = -wanted{k}
            end
            s.{speed} = min(max(wanted{k}, s.{speed} - A * DT), s.{speed} + A * DT)
            s.{at} = s.{at} + s.{speed} * DT"
    )
}

fn trapezoid(v: &[f64], signals: &Signals) -> Sketch {
    let body = format!("{}\nlet y = s.at", follows("x", "at", "speed", ""));
    let rate = format!("{}/s", signals.x.unit);
    limits(
        Sketch::of(signals.x.clone(), body).remembering(["at"]).cells(["speed"], rate, "0"),
        v,
        signals,
    )
}

/// Writes the code with a second trapezoid that follows the command from a time T earlier. The mean over T then changes
/// by the value that enters minus the value that leaves.
fn rounded(v: &[f64], signals: &Signals) -> Sketch {
    let (samples, unit) = (v[2] / signals.dt_s, &signals.x.unit);
    let whole = libm::floor(samples);
    let body = format!(
        "if i < 1
            s.at = v[0]
            s.left = v[0]
            s.earlier = v[0]
            s.mean = v[0]
            end
            let a = s.earlier
            let b = s.left
            let was = s.at
            {}
            {}
            s.earlier = b
            let leaves = b - SHARE * SHARE * (b - a) / 2 + (1 - SHARE) * (1 - SHARE) * (s.left - b) / 2
            s.mean = s.mean + ((was + s.at) / 2 - leaves) / (WHOLE + SHARE)
            let y = s.mean",
        follows("v[i]", "at", "speed", "1"),
        follows("v[max(i - WHOLE, 0)]", "left", "slow", "2"),
    );
    let sketch = Sketch::of(signals.x.clone().named("v").record(), body)
        .beside(Quantity::new(
            "i",
            "1",
            "index of the sample to return: 0, 1, 2, ... in this order",
        ))
        .cells(["at", "left", "earlier", "mean"], unit.clone(), "0")
        .cells(["speed", "slow"], format!("{unit}/s"), "0");
    limits(sketch, v, signals).with_all(&[("WHOLE", whole, "1"), ("SHARE", samples - whole, "1")])
}

/// Adds the limits and the sample time.
fn limits(sketch: Sketch, v: &[f64], signals: &Signals) -> Sketch {
    let unit = &signals.x.unit;
    let units = [format!("{unit}/s^2"), format!("{unit}/s")];
    sketch.with_all(&[("A", v[0], &*units[0]), ("RATE", v[1], &*units[1])]).with(
        "DT",
        signals.dt_s,
        "s",
    )
}

/// A trapezoid profile of a command, or an S profile.
pub static PROFILE: Kind = Kind {
    name: "profile",
    title: "a limit of rate and acceleration",
    words: "a servo follows its command with a greatest rate and a greatest acceleration (trapezoid profile, S profile where corners are rounded)",
    equation: "y = mean of p over the last round_s; |p''| <= acceleration, |p'| <= rate, p goes to x and stops there",
    usual: &[Side::Input],
    // A limit of the acceleration has no effect if the quickest possible change can start and stop
    // within one sample.
    parameters: |e, unit| {
        let (slow, dt) = (SLOWEST * e.late_s(), e.dt_s);
        let span = e.span().max(f64::MIN_POSITIVE);
        let (least, off) = (4.0 * span / (slow * slow), 2.0 * span / (dt * dt));
        vec![
            EffectParameter::sized("acceleration", &format!("{unit}/s^2"), least.min(off)..=off)
                .off_at(off)
                .log(),
            EffectParameter::shaped("rate", &format!("{unit}/s"), span / slow..=span / dt),
            // The limit of the jerk is acceleration/round_s.
            EffectParameter::formed("round_s", "s", 0.0..=e.late_s(), 0.0),
        ]
    },
    starts: Some(|e| {
        // A search start, from two numbers. `takes` is the time of a move over the whole range. With a `share` of 1 the
        // move has no segment at the greatest rate, with 0.5 it has one.
        let of = |takes: f64, share: f64| {
            let (a, v) = (4.0 * e.span() / (takes * takes), 2.0 * e.span() / takes);
            vec![a / share, v * share, 0.0]
        };
        [(0.5, 1.0), (0.5, 0.5), (2.0, 1.0), (2.0, 0.5)]
            .map(|(late, share)| of(late * e.late_s(), share))
            .into()
    }),
    operator: |v, _, grid| {
        let profile = Profile { acceleration: v[0], rate: v[1] };
        match v[2] > 0.0 {
            true => Box::new(SProfile::new(grid, profile, v[2])),
            false => Box::new(profile),
        }
    },
    sketch: Some(|v, _, signals| match v[2] > 0.0 {
        true => rounded(v, signals),
        false => trapezoid(v, signals),
    }),
    twins: &["slew_limit", "second_order_lag", "lag", "delay"],
    ..Kind::PLAIN
};

/// Longest time of a move over the whole range, as a multiple of the longest delay that is searched.
const SLOWEST: f64 = 10.0;

#[cfg(test)]
mod tests;
