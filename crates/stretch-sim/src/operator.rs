//! What effects do to a signal: operators with a memory, and the few building blocks they share.

use std::fmt;

use crate::grid::Grid;

/// How an operator's memory begins a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// At rest at the first value, everything before forgotten.
    Settled,
    /// As the last trial left it: the input went straight to this trial's first value and stayed there for `rest_s`.
    Carried {
        /// Seconds of rest between the trials.
        rest_s: f64,
    },
    /// Wound by a move that nobody recorded: +1 as if the input had come up to its first value from far
    /// below, -1 from far above, 0 settled, anything between a share of that reach. What counts the whole session (the
    /// travel of `gauge_softening`) goes on as when carried.
    Wound(f64),
}

/// The stretch of signal that an operator acts on, and what else is known there.
#[derive(Debug, Clone, Copy)]
pub struct Span<'a> {
    /// Steps of time.
    pub grid: &'a Grid,
    /// Node of the signal's first value; node 0 is emitted without advancing time.
    pub first_node: usize,
    /// Session time of node 0, s: since the gauge was powered and the sleeve first stretched.
    pub start_s: f64,
    /// Gauge pressure at the same nodes, kPa; empty when there is none.
    pub pressure_kpa: &'a [f64],
    /// Gauge strain at the same nodes, after the effects on it; empty where it is not yet known.
    pub strain: &'a [f64],
}

impl Span<'_> {
    /// Calls `visit(step, i)` for every value: `step` is the index of the piece of time that leads to it, none at node 0.
    #[inline]
    pub fn each(&self, len: usize, mut visit: impl FnMut(Option<usize>, usize)) {
        let mut i = 0;
        if self.first_node == 0 && len > 0 {
            visit(None, 0);
            i = 1;
        }
        let pieces = self.grid.pieces();
        if pieces == 1 {
            while i < len {
                visit(Some(0), i);
                i += 1;
            }
            return;
        }
        let mut step = (self.first_node + i + pieces - 1) % pieces;
        while i < len {
            visit(Some(step), i);
            step = if step + 1 == pieces { 0 } else { step + 1 };
            i += 1;
        }
    }
}

/// Something that changes a signal in place, sample by sample, with a memory of `cells()` numbers.
pub trait Operator: fmt::Debug + Send + Sync {
    /// How many numbers it remembers.
    fn cells(&self) -> usize {
        0
    }

    /// Prepares the memory for a trial whose first input is `first`.
    fn begin(&self, _start: Start, _first: f64, _cells: &mut [f64]) {}

    /// Replaces every value of `signal` by what the operator makes of it.
    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]);

    /// Replaces a recorded output by the input that made it, as far as that is possible; by default it leaves it alone.
    fn undo(&self, _signal: &mut [f64]) {}
}

/// A memoryless law y = f(x).
pub trait Law: fmt::Debug + Send + Sync {
    /// Its value at `x`.
    fn at(&self, x: f64) -> f64;
}

/// A pressure that the supply loses to the flow drawn from it: y' = rate(y, flow).
pub trait Droop: fmt::Debug + Send + Sync {
    /// Rate of the droop, Pa/s, at the droop y (Pa) and the flow through the inlet (kg/s).
    fn rate(&self, droop_pa: f64, flow_kg_s: f64) -> f64;
    /// What is left of it after `rest_s` seconds without flow.
    fn relaxed(&self, droop_pa: f64, rest_s: f64) -> f64;
}

/// Backlash of half-width `w`: the output `z` stays until the input `x` pushes it.
///
/// ```
/// use stretch_sim::play;
/// assert_eq!(play(0.0, 0.5, 1.0), 0.0);
/// assert_eq!(play(0.0, 3.0, 1.0), 2.0);
/// assert_eq!(play(2.0, -3.0, 1.0), -2.0);
/// ```
#[inline]
pub fn play(z: f64, x: f64, w: f64) -> f64 {
    let low = x - w;
    let high = x + w;
    if z < low {
        low
    } else if z > high {
        high
    } else {
        z
    }
}

/// Where a play of half-width `w` begins a trial at input `first`; `last` is its output before.
pub(crate) fn play_start(start: Start, last: f64, first: f64, w: f64) -> f64 {
    match start {
        Start::Settled => first,
        Start::Carried { .. } => play(last, first, w),
        Start::Wound(share) => first - share.clamp(-1.0, 1.0) * w,
    }
}

/// Prandtl-Ishlinskii hysteresis: x minus h times the mean of (x - play(x, r)), r = s {0.25, 0.5, 1}.
#[derive(Debug, Clone, Copy)]
pub struct Hysteresis {
    h: f64,
    radii: [f64; 3],
}

impl Hysteresis {
    /// Of share `h` and scale `s` (in the unit of the signal).
    pub fn new(h: f64, s: f64) -> Self {
        Self { h, radii: [0.25 * s, 0.5 * s, s] }
    }
}

impl Operator for Hysteresis {
    fn cells(&self) -> usize {
        3
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        for (z, r) in cells.iter_mut().zip(self.radii) {
            *z = play_start(start, *z, first, r);
        }
    }

    fn run(&self, _span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let [mut a, mut b, mut c] = [cells[0], cells[1], cells[2]];
        let share = self.h / 3.0;
        for x in signal {
            a = play(a, *x, self.radii[0]);
            b = play(b, *x, self.radii[1]);
            c = play(c, *x, self.radii[2]);
            *x -= share * ((*x - a) + (*x - b) + (*x - c));
        }
        cells.copy_from_slice(&[a, b, c]);
    }
}

/// Backlash as an operator.
#[derive(Debug, Clone, Copy)]
pub struct Backlash {
    /// Half-width, in the unit of the signal.
    pub w: f64,
}

impl Operator for Backlash {
    fn cells(&self) -> usize {
        1
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        cells[0] = play_start(start, cells[0], first, self.w);
    }

    fn run(&self, _span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let mut z = cells[0];
        for x in signal {
            z = play(z, *x, self.w);
            *x = z;
        }
        cells[0] = z;
    }

    fn undo(&self, signal: &mut [f64]) {
        crate::backlash::undo(self.w, signal);
    }
}

/// Mean reversion z' = (x - z)/tau, exact for an input that is linear between nodes.
#[derive(Debug, Clone)]
pub struct MeanReversion {
    tau: f64,
    reach: f64,
    /// For each piece of time: weights of z, the last x and the new x.
    weights: Vec<[f64; 3]>,
}

impl MeanReversion {
    /// Of time constant `tau` (s, positive) on a grid; `reach` is the stroke of its input, in the input's unit.
    pub fn new(tau: f64, reach: f64, grid: &Grid) -> Self {
        Self { tau, reach, weights: grid.steps().iter().map(|h| Self::weights(tau, *h)).collect() }
    }

    fn weights(tau: f64, h: f64) -> [f64; 3] {
        let a = h / tau;
        let gone = -libm::expm1(-a);
        // Mean of the decay over the step; a series where the quotient would cancel.
        let mean = if a < 1e-4 { 1.0 - a * (0.5 - a / 6.0) } else { gone / a };
        [1.0 - gone, mean - (1.0 - gone), 1.0 - mean]
    }

    /// How many numbers it remembers: its state and its last input.
    pub const CELLS: usize = 2;

    /// Prepares the memory, as [`Operator::begin`].
    pub fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        cells[0] = match start {
            Start::Settled => first,
            Start::Carried { rest_s } => first + (cells[0] - first) * libm::exp(-rest_s / self.tau),
            Start::Wound(share) => first - share.clamp(-1.0, 1.0) * self.reach,
        };
        cells[1] = first;
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
        let (mut z, mut last) = (cells[0], cells[1]);
        span.each(signal.len(), |step, i| {
            let x = signal[i];
            if let Some(step) = step {
                let [of_z, of_last, of_x] = self.weights[step];
                z = of_z * z + (of_last * last + of_x * x);
            }
            last = x;
            signal[i] = mix(x, z);
        });
        cells[0] = z;
        cells[1] = last;
    }
}

/// A soft lower bound: low + w ln(1 + exp((x - low)/w)); within rounding of x or of `low` from 37 w on.
///
/// ```
/// use stretch_sim::soft_floor;
/// assert_eq!(soft_floor(5.0, 1.0, 0.01), 5.0);
/// assert!((soft_floor(1.0, 1.0, 0.01) - (1.0 + 0.01 * 2f64.ln())).abs() < 1e-15);
/// ```
#[inline]
pub fn soft_floor(x: f64, low: f64, w: f64) -> f64 {
    let z = (x - low) / w;
    if z > 37.0 {
        x
    } else if z > 0.0 {
        x + w * libm::log1p(libm::exp(-z))
    } else {
        low + w * libm::log1p(libm::exp(z))
    }
}

/// A soft upper bound, the mirror image of [`soft_floor`].
#[inline]
pub fn soft_ceiling(x: f64, high: f64, w: f64) -> f64 {
    -soft_floor(-x, -high, w)
}
