//! A response that weakens with use.

use alloc::{boxed::Box, format, vec};

use stretch_core::Worn;

use crate::{
    effect::{Acts, Effect, Live, pairs},
    extent::Extent,
    kind::{Beside, Kind, Side, Signals},
    operator::{Operator, Span, Start},
    parameter::{EffectParameter, Form},
    place::Place,
    sketch::Sketch,
};

/// Softening with travel: y = zero + (x - zero)(1 - m (1 - left)). The factor left = (1 + tail travel/n)^(-1/tail)
/// falls from 1 to 0; at a tail of 0 it is exp(-travel/n). Travel is the summed absolute change of strain since the
/// session began.
///
/// The memory is the travel, the last counted strain, and the direction: +1, -1, or 0 before the first move. Source of
/// the long tail: stretched forms of the Mullins effect, Diani 2009, doi:10.1016/j.eurpolymj.2008.11.017.
///
/// ```
/// use stretch_effects::{Grid, Operator, Softening, Span, Start};
/// let gauge = Softening { m: 0.3, n: 2.0, tail: 0.0, zero: 1.0, reversal: 1e-3 };
/// let (grid, mut cells, mut ohm) = (Grid::samples(0.01)?, [0.0; 3], [3.0, 3.0, 3.0]);
/// gauge.begin(Start::Settled, 0.0, &mut cells);
/// let span = Span { strain: &[0.0, 1.0, 0.0], ..Span::whole(&grid) };
/// gauge.run(&span, &mut cells, &mut ohm);
/// assert_eq!((ohm[0], cells[0]), (3.0, 2.0)); // up by one and down again
/// assert!((ohm[2] - (1.0 + 2.0 * (1.0 - 0.3 * (1.0 - (-1.0_f64).exp())))).abs() < 1e-12);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Softening {
    /// Share that is lost after a long travel.
    pub m: f64,
    /// Travel scale of the loss, in strain.
    pub n: f64,
    /// Length of the tail; 0 gives an exponential.
    pub tail: f64,
    /// Value of the signal at zero strain, which does not change.
    pub zero: f64,
    /// Reversals smaller than this strain are not counted, because noise alone would accumulate a long travel.
    pub reversal: f64,
}

impl Softening {
    /// Counts a move to the strain `e`. Returns whether the travel changed.
    #[inline]
    fn go(&self, cells: &mut [f64; 3], e: f64) -> bool {
        let [travel, reached, direction] = cells;
        let moved = e - *reached;
        let onward = moved * *direction > 0.0;
        let distance = moved.abs();
        if onward || distance > self.reversal {
            *travel += distance;
            *reached = e;
            if !onward {
                *direction = moved.signum();
            }
            return true;
        }
        false
    }

    /// Returns 1 - m (1 - left).
    #[inline]
    fn factor(&self, travel: f64) -> f64 {
        let exponent = match self.tail {
            0.0 => -travel / self.n,
            tail => -libm::log1p(tail * travel / self.n) / tail,
        };
        1.0 + self.m * libm::expm1(exponent)
    }
}

impl Operator for Softening {
    fn cells(&self) -> usize {
        3
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        let mut state = [cells[0], cells[1], cells[2]];
        match start {
            Start::Settled => state = [0.0, first, 0.0],
            Start::Carried { .. } | Start::Hysteresis(_) => {
                self.go(&mut state, first);
            }
        }
        cells.copy_from_slice(&state);
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let mut state = [cells[0], cells[1], cells[2]];
        let mut factor = self.factor(state[0]);
        for (x, e) in signal.iter_mut().zip(span.strain) {
            if self.go(&mut state, *e) {
                factor = self.factor(state[0]);
            }
            *x = self.zero + (*x - self.zero) * factor;
        }
        cells.copy_from_slice(&state);
    }
}

/// A response that weakens with the distance travelled.
pub static SOFTENING: Kind = Kind {
    name: "softening",
    title: "softening",
    words: "its response weakens with the distance travelled",
    equation: "y = zero + (x - zero)(1 - m (1 - (1 + tail travel/n)^(-1/tail))), travel since the session began",
    usual: &[Side::Output],
    beside: Beside::Itself,
    parameters: |e, unit| {
        let s = e.span();
        // The value that does not soften: 0 if the channel crosses it, otherwise the end of its range nearest to 0.
        let zero = 0.0_f64.clamp(e.low, e.high);
        vec![
            EffectParameter::sized("m", "1", 0.0..=0.5),
            EffectParameter::shaped("n", unit, 1.5 * s..=200.0 * s),
            EffectParameter::formed("tail", "1", 0.05..=2.5, 1.0 / 3.0).log(),
            EffectParameter::formed("zero", unit, e.low - s..=e.high + s, zero),
        ]
    },
    operator: |v, e, _| {
        let reversal = reversal(e);
        Box::new(Softening { m: v[0], n: v[1], tail: v[2], zero: v[3], reversal })
    },
    sketch: Some(sketch),
    counts_session: true,
    drifts: true,
    ..Kind::PLAIN
};

/// Smallest counted reversal, as a share of the range of the strain: noise alone would accumulate a long travel.
const REVERSAL: f64 = 2.5e-3;

fn reversal(e: &Extent) -> f64 {
    REVERSAL * (e.beside[1] - e.beside[0])
}

fn sketch(v: &[f64], extent: &Extent, signals: &Signals) -> Sketch {
    let (x, e) = (&signals.x, &signals.beside);
    let lost = match v[2] {
        0.0 => "expm1(-s.travel / N)",
        _ => "expm1(-log1p(TAIL * s.travel / N) / TAIL)",
    };
    let body = format!(
        "let moved = e - s.reached
        if (moved * s.direction > 0) or (abs(moved) > REVERSAL)
        s.travel = s.travel + abs(moved)
        s.reached = e
        s.direction = moved / abs(moved)
        end
        let y = ZERO + (x - ZERO) * (1 + M * {lost})"
    );
    let mut sketch = Sketch::of(x.clone(), body).beside(e.clone());
    sketch = sketch.with_all(&[("M", v[0], "1"), ("N", v[1], &*e.unit)]);
    if v[2] != 0.0 {
        sketch = sketch.with("TAIL", v[2], "1");
    }
    sketch
        .with_all(&[("ZERO", v[3], &*x.unit), ("REVERSAL", reversal(extent), &*e.unit)])
        .cells(["travel"], e.unit.clone(), "0")
        .cells(["reached"], e.unit.clone(), e.name)
        .cells(["direction"], "1", "0")
}

/// Softening of the gauge with use.
pub(crate) static GAUGE_SOFTENING: Effect = Effect {
    name: "gauge_softening",
    title: "the gauge's softening",
    words: "the gauge's response weakens with the distance travelled",
    equation: "R - R0 -> (R - R0)(1 - m (1 - (1 + tail travel/n)^(-1/tail))), exp(-travel/n) at a tail of 0; travel: summed abs strain change since the session began",
    parameters: &[
        EffectParameter::strength("m", "1", 0.0, 0.3, 0.1),
        EffectParameter::shape("n", "strain", 0.3, 20.0, 2.5),
        EffectParameter::form("tail", "1", 0.05, 2.5, Form { neutral: 0.0, usual: 1.0 / 3.0 })
            .log(),
    ],
    acts: Acts::with(&SOFTENING, Place::Resistance, |v, around| {
        [v, &[around.resistance_zero]].concat()
    }),
    starts: Some(|_| pairs(0.03, [0.5, 2.5, 12.0])),
    live: Some(Live {
        parameters: &[
            EffectParameter::strength("m", "1", 0.0, 0.6, 0.05),
            EffectParameter::shape("n", "1", 0.3, 500.0, 12.0),
            EffectParameter::form("zero", "1", -3.0, 3.0, Form { neutral: 0.0, usual: 0.0 }),
        ],
        set: |v, target, map| {
            let (m, n, zero) = (v[0], v[1], target.at(v[2]));
            map.worn = Some(Worn { m, n, zero, reversal: REVERSAL, travelled: 0.0 });
        },
        drifts: true,
    }),
    ..Effect::PLAIN
};
