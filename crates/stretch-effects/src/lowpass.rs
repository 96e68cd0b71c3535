//! Low-pass filters with one or two poles.

use alloc::{boxed::Box, format, vec, vec::Vec};

use stretch_core::arithmetic::lag_weights;

use crate::{
    effect::{Acts, Effect, Live, each},
    grid::Grid,
    kind::{Family, Kind, Side},
    operator::{Operator, Span, Start},
    oscillator::{Oscillator, Swing},
    parameter::{EffectParameter, Form},
    place::Place,
    sketch::Sketch,
};

/// A first-order lag (mean reversion) z' = (x - z)/tau, exact for an input that is linear between nodes.
///
/// ```
/// use stretch_effects::{Grid, MeanReversion, Span, Start};
/// let grid = Grid::samples(0.01)?;
/// let lag = MeanReversion::new(0.1, 1.0, &grid);
/// let mut cells = [0.0; MeanReversion::CELLS];
/// lag.begin(Start::Settled, 0.0, &mut cells);
/// // A ramp of slope 1: the lag trails it by tau (1 - exp(-t/tau)).
/// let mut signal: Vec<f64> = (0..101).map(|i| 0.01 * i as f64).collect();
/// lag.run(&Span::whole(&grid), &mut cells, &mut signal, |_, z| z);
/// assert!((signal[100] - (1.0 - 0.1 * (1.0 - (-10.0_f64).exp()))).abs() < 1e-12);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct MeanReversion {
    tau: f64,
    reach: f64,
    /// For each grid step: weights of z, of the last x and of the new x.
    weights: Vec<[f64; 3]>,
}

impl MeanReversion {
    /// Number of remembered values: the state and the last input.
    pub const CELLS: usize = 2;

    /// A lag of time constant `tau` (s, positive) on a grid. `reach` is the stroke of the input, in the input's unit;
    /// it scales the state of `Start::Hysteresis`.
    pub fn new(tau: f64, reach: f64, grid: &Grid) -> Self {
        Self { tau, reach, weights: grid.steps().iter().map(|h| lag_weights(*h, tau)).collect() }
    }

    /// Prepares the memory, as [`Operator::begin`](crate::Operator::begin).
    pub fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        cells[0] = match start {
            Start::Settled => first,
            Start::Carried { rest_s } => first + (cells[0] - first) * libm::exp(-rest_s / self.tau),
            Start::Hysteresis(share) => first - share.clamp(-1.0, 1.0) * self.reach,
        };
        cells[1] = first;
    }

    /// Advances by the grid step with index `step` to the input `x` and returns the state. Without a step the state is
    /// unchanged.
    #[inline]
    pub(crate) fn step(&self, step: Option<usize>, cells: &mut [f64], x: f64) -> f64 {
        if let Some(step) = step {
            let [of_z, of_last, of_x] = self.weights[step];
            cells[0] = of_z * cells[0] + (of_last * cells[1] + of_x * x);
        }
        cells[1] = x;
        cells[0]
    }

    /// Replaces every x by `mix(x, z)`.
    #[inline]
    pub fn run(
        &self,
        span: &Span<'_>,
        cells: &mut [f64],
        signal: &mut [f64],
        mix: impl Fn(f64, f64) -> f64,
    ) {
        let mut own = [cells[0], cells[1]];
        span.each(signal.len(), |step, i| {
            let x = signal[i];
            signal[i] = mix(x, self.step(step, &mut own, x));
        });
        cells[..2].copy_from_slice(&own);
    }
}

/// The numbers of a [`Lowpass`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Poles {
    /// Sum of the time constants, s: the lag behind a ramp.
    pub tau_s: f64,
    /// Share of `tau_s` that the second pole has, up to 0.5; 0 gives one pole. Above 0.5 the poles are complex.
    pub second: f64,
}

/// A low-pass with one or two poles and the transfer function 1/(1 + tau s + b tau^2 s^2).
///
/// Up to `second` = 0.5 the poles are real, b = second (1 - second), and the low-pass is two lags in series,
/// y = mean_rev(mean_rev(x, tau (1 - second)), tau second). Here mean_rev(x, tau) is x behind the first-order lag
/// [`MeanReversion`]. Above 0.5 the poles are complex and b = second^2: an [`Oscillator`] with m = tau second and the
/// damping ratio 1/(2 second). A Butterworth filter of second order has `second` = 0.7071, a Bessel filter 0.5774.
///
/// Every trial begins with a settled state, independent of its `Start`.
///
/// ```
/// use stretch_effects::{Grid, Lowpass, Operator, Poles, Span, Start};
/// let grid = Grid::samples(0.01)?;
/// for second in [0.0, 0.3, 0.5, 0.7071] {
///     let slow = Lowpass::new(Poles { tau_s: 0.1, second }, &grid);
///     let mut cells = vec![0.0; slow.cells()];
///     let mut ramp: Vec<f64> = (0..300).map(|i| 0.01 * i as f64).collect();
///     slow.begin(Start::Settled, 0.0, &mut cells);
///     slow.run(&Span::whole(&grid), &mut cells, &mut ramp);
///     // A ramp is trailed by tau, whatever the poles; the second takes the first's output as linear between samples.
///     assert!((ramp[299] - (2.99 - 0.1)).abs() < 1e-8);
/// }
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Lowpass(Filter);

#[derive(Debug, Clone, PartialEq)]
enum Filter {
    Real(Vec<MeanReversion>),
    Complex(Oscillator),
}

/// Largest `second` at which the poles are real.
const REAL: f64 = 0.5;

impl Lowpass {
    /// A low-pass with one or two poles on a grid.
    pub fn new(poles: Poles, grid: &Grid) -> Self {
        let Poles { tau_s, second } = poles;
        if second > REAL {
            let swing = Swing { m: tau_s * second, damping: 0.5 / second, drag: 0.0, dry: 0.0 };
            return Self(Filter::Complex(Oscillator::new(swing, grid)));
        }
        // The reach scales only `Start::Hysteresis`, which a low-pass does not use.
        let pole = |tau: f64| MeanReversion::new(tau, 0.0, grid);
        let mut poles = Vec::from([pole(tau_s * (1.0 - second))]);
        if second != 0.0 {
            poles.push(pole(tau_s * second));
        }
        Self(Filter::Real(poles))
    }
}

impl Operator for Lowpass {
    fn cells(&self) -> usize {
        match &self.0 {
            Filter::Real(poles) => poles.len() * MeanReversion::CELLS,
            Filter::Complex(pair) => pair.cells(),
        }
    }

    fn begin(&self, _start: Start, first: f64, cells: &mut [f64]) {
        match &self.0 {
            Filter::Real(poles) => {
                for (pole, own) in poles.iter().zip(cells.chunks_mut(MeanReversion::CELLS)) {
                    pole.begin(Start::Settled, first, own);
                }
            }
            Filter::Complex(pair) => pair.begin(Start::Settled, first, cells),
        }
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        match &self.0 {
            Filter::Real(poles) => {
                for (pole, own) in poles.iter().zip(cells.chunks_mut(MeanReversion::CELLS)) {
                    pole.run(span, own, signal, |_, z| z);
                }
            }
            Filter::Complex(pair) => pair.run(span, cells, signal),
        }
    }
}

/// A low-pass with one or two real poles.
pub static LAG: Kind = Kind {
    name: "lag",
    title: "a lag",
    words: "it follows slowly, without overshoot",
    equation: "y = mean_rev(mean_rev(x, tau_s (1 - second)), tau_s second)",
    usual: &[Side::Input, Side::Output],
    parameters: |e, _| {
        vec![
            EffectParameter::sized("tau_s", "s", 0.0..=2.0 * e.late_s()),
            EffectParameter::formed("second", "1", 0.0..=0.5, 0.1),
        ]
    },
    starts: Some(|e| [0.03, 0.12, 0.4].map(|k| vec![2.0 * k * e.late_s(), 0.1]).into()),
    operator: |v, _, grid| {
        Box::new(Lowpass::new(Poles { tau_s: v[0].max(1e-9), second: v[1] }, grid))
    },
    sketch: Some(|v, _, signals| {
        let x = signals.x.clone();
        let sketch = match v[1] {
            0.0 => {
                let body = "let k = exp(-DT / TAU)
                    let m = (1 - k) * TAU / DT
                    s.z = k * s.z + (m - k) * s.last + (1 - m) * x
                    s.last = x
                    let y = s.z";
                Sketch::of(x, body).with("TAU", v[0], "s").remembering(["z", "last"])
            }
            second if second > REAL => {
                let body = "let sn = exp(-DT / (2 * SECOND * M)) * sin(W * DT) / W
                    let cs = exp(-DT / (2 * SECOND * M)) * cos(W * DT)
                    let slope = (x - s.last) / DT
                    let p = s.at - s.last + M / SECOND * slope
                    let q = s.speed - slope
                    s.at = x - M / SECOND * slope + (cs + sn / (2 * SECOND * M)) * p + sn * q
                    s.speed = slope - sn / (M * M) * p + (cs - sn / (2 * SECOND * M)) * q
                    s.last = x
                    let y = s.at";
                let m = v[0] * second;
                let omega = libm::sqrt(1.0 - 0.25 / (second * second)) / m;
                let speed = format!("{}/s", signals.x.unit);
                Sketch::of(x, body)
                    .remembering(["at", "last"])
                    .cells(["speed"], speed, "0")
                    .with_all(&[("M", m, "s"), ("SECOND", second, "1"), ("W", omega, "1/s")])
            }
            second => {
                let body = "let k = exp(-DT / (TAU * (1 - SECOND)))
                    let m = (1 - k) * TAU * (1 - SECOND) / DT
                    let before = s.z
                    s.z = k * s.z + (m - k) * s.last + (1 - m) * x
                    s.last = x
                    let k2 = exp(-DT / (TAU * SECOND))
                    let m2 = (1 - k2) * TAU * SECOND / DT
                    s.w = k2 * s.w + (m2 - k2) * before + (1 - m2) * s.z
                    let y = s.w";
                let sketch = Sketch::of(x, body).remembering(["z", "last", "w"]);
                sketch.with_all(&[("TAU", v[0], "s"), ("SECOND", second, "1")])
            }
        };
        sketch.with("DT", signals.dt_s, "s")
    }),
    twins: &["delay", "skew", "second_order_lag", "relaxation"],
    family: Some((Family::Late, |v| v[0])),
    needs_fine_steps: true,
    ..Kind::PLAIN
};

/// Lag of the amplifier.
pub(crate) static AMPLIFIER_LOWPASS: Effect = Effect {
    name: "amplifier_lowpass",
    title: "the amplifier's lag",
    words: "the amplifier is slow",
    equation: "v -> mean_rev(mean_rev(v, tau (1 - second)), tau second); complex poles if second is above 0.5",
    parameters: &[
        EffectParameter::strength("tau", "s", 0.0, 0.4, 0.05),
        EffectParameter::form("second", "1", 0.0, 1.0, Form { neutral: 0.0, usual: 0.1 }),
    ],
    acts: Acts::at(&LAG, Place::Volts),
    twins: &["channel_skew", "gauge_relaxation"],
    starts: Some(|_| each([0.004, 0.02, 0.08])),
    live: Some(Live {
        parameters: &[
            EffectParameter::shape("tau", "s", 5e-4, 1.0, 0.02),
            EffectParameter::form("second", "1", 0.005, 0.5, Form { neutral: 0.1, usual: 0.1 }),
        ],
        set: |v, _, map| map.lowpass_s = Some([v[0] * (1.0 - v[1]), v[0] * v[1]]),
        ..Live::BY_CURVE
    }),
    ..Effect::PLAIN
};
