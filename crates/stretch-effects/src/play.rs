//! Play (backlash): the output follows only after the input has crossed a gap.

use alloc::{boxed::Box, vec, vec::Vec};

use stretch_core::{Plays, arithmetic::play};

use crate::{
    effect::{Acts, Effect, Live, each},
    hysteresis::PrandtlIshlinskii,
    kind::{Family, Kind, Side},
    operator::{Operator, Span, Start},
    parameter::{EffectParameter, Form},
    place::{Place, RigStage},
    sketch::Sketch,
};

/// Backlash: y = play(x, w), or the mean of play(x, w {1 - spread, 1, 1 + spread}), which has soft reversals. Here
/// play(x, w) follows x only after x has crossed a gap of half-width w.
///
/// [`Operator::undo`] returns an input that would have produced a recorded output. It is exact while the output moves.
/// While the output dwells, the input is interpolated linearly. A soft backlash is treated as a hard one.
///
/// ```
/// use stretch_effects::{Backlash, Grid, Operator, Span, Start};
/// let slip = Backlash::hard(1.0);
/// let (mut cells, mut signal) = ([0.0], [0.0, 0.5, 3.0, 2.5]);
/// slip.begin(Start::Settled, signal[0], &mut cells);
/// slip.run(&Span::whole(&Grid::samples(0.01)?), &mut cells, &mut signal);
/// assert_eq!(signal, [0.0, 0.0, 2.0, 2.0]);
/// assert_eq!(Backlash::soft(1.0, 0.3).cells(), 3);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backlash {
    w: f64,
    /// A mean of plays is a Prandtl-Ishlinskii operator with a share of 1.
    soft: Option<PrandtlIshlinskii>,
}

impl Backlash {
    /// One play of half-width `w`, in the unit of the signal.
    pub fn hard(w: f64) -> Self {
        Self { w, soft: None }
    }

    /// Three plays with half-widths from `w (1 - spread)` to `w (1 + spread)`; a spread of 0 gives one play.
    pub fn soft(w: f64, spread: f64) -> Self {
        let radii = [w * (1.0 - spread), w, w * (1.0 + spread)];
        Self { w, soft: (spread != 0.0).then(|| PrandtlIshlinskii::of_radii(1.0, radii)) }
    }
}

impl Operator for Backlash {
    fn cells(&self) -> usize {
        self.soft.map_or(1, |soft| soft.cells())
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        match &self.soft {
            Some(soft) => soft.begin(start, first, cells),
            None => cells[0] = start.of_play(cells[0], first, self.w),
        }
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        if let Some(soft) = &self.soft {
            return soft.run(span, cells, signal);
        }
        let mut z = cells[0];
        for x in signal {
            z = play(z, *x, self.w);
            *x = z;
        }
        cells[0] = z;
    }

    fn undo(&self, signal: &mut [f64]) {
        unplay(self.w, signal);
    }
}

/// A play of one half-width, or three plays around it.
pub static BACKLASH: Kind = Kind {
    name: "backlash",
    title: "backlash",
    words: "it has play: it follows once a gap is taken up",
    equation: "y = mean of play(x, w {1 - softness, 1, 1 + softness})",
    usual: &[Side::Input, Side::Output],
    parameters: |e, unit| {
        vec![
            EffectParameter::sized("w", unit, 0.0..=0.5 * e.span()),
            EffectParameter::formed("softness", "1", 0.0..=0.6, 0.2),
        ]
    },
    starts: Some(|e| [0.005, 0.03, 0.1, 0.3].map(|k| vec![k * e.span(), 0.2]).into()),
    operator: |v, _, _| Box::new(Backlash::soft(v[0], v[1])),
    sketch: Some(|v, _, signals| {
        let unit = signals.x.unit.clone();
        let body = "let ra = W * (1 - SPREAD)
            let rc = W * (1 + SPREAD)
            s.a = max(x - ra, min(x + ra, s.a))
            s.b = max(x - W, min(x + W, s.b))
            s.c = max(x - rc, min(x + rc, s.c))
            let y = (s.a + s.b + s.c) / 3";
        Sketch::of(signals.x.clone(), body)
            .with_all(&[("W", v[0], &unit), ("SPREAD", v[1], "1")])
            .remembering(["a", "b", "c"])
    }),
    twins: &["hysteresis", "bouc_wen", "dead_zone", "firmware_dead_band"],
    family: Some((Family::Loop, |v| v[0])),
    hides_input: true,
    ..Kind::PLAIN
};

/// Slip of the sleeve on the muscle.
pub(crate) static SLEEVE_SLIP: Effect = Effect {
    name: "sleeve_slip",
    title: "the sensor's slip",
    words: "the sensor slips on what carries it before it follows",
    equation: "e -> mean of play(e, w {1 - spread, 1, 1 + spread})",
    parameters: &[
        EffectParameter::strength("w", "strain", 0.0, 0.03, 0.008),
        EffectParameter::form("spread", "1", 0.0, 0.95, Form { neutral: 0.0, usual: 0.3 }),
    ],
    acts: Acts::at(&BACKLASH, Place::Strain),
    twins: &["gauge_hysteresis", "pot_backlash"],
    starts: Some(|_| each([0.0005, 0.002, 0.01])),
    live: Some(Live {
        parameters: &[
            EffectParameter::shape("w", "1", 1e-4, 0.3, 0.02),
            EffectParameter::form("spread", "1", 0.0, 0.95, Form { neutral: 0.3, usual: 0.3 }),
        ],
        set: |v, _, map| {
            let radii = [v[0] * (1.0 - v[1]), v[0], v[0] * (1.0 + v[1])];
            map.slip = Some(Plays { share: 1.0, radii });
        },
        ..Live::BY_CURVE
    }),
    ..Effect::PLAIN
};

/// Backlash of the potentiometer. A calibration built on a diagnosis undoes it in the reference to which it is fitted.
pub(crate) static POT_BACKLASH: Effect = Effect {
    name: "pot_backlash",
    title: "the reference sensor's backlash",
    words: "the reference sensor has backlash",
    stage: RigStage::Reference,
    equation: "L_meas = mean of play(L, w {1 - spread, 1, 1 + spread})",
    parameters: &[
        EffectParameter::strength("w", "mm", 0.0, 2.0, 0.3),
        EffectParameter::form("spread", "1", 0.0, 0.95, Form { neutral: 0.0, usual: 0.3 }),
    ],
    acts: Acts::at(&BACKLASH, Place::Length),
    twins: &["sleeve_slip"],
    starts: Some(|_| each([0.05, 0.2, 0.8])),
    live: Some(Live {
        parameters: &[EffectParameter::shape("w", "1", 1e-4, 0.2, 0.01)],
        ..Live::BY_CURVE
    }),
    ..Effect::PLAIN
};

/// Replaces the output of a backlash of half-width `w` by an input that would have produced it.
///
/// While the output moves, the input is ahead of it by w. After each reversal the output dwells at its extreme while
/// the input crosses the gap. The input is unknown there and is interpolated linearly. Reversals and dwells are
/// detected with a band of w/10 (at least a millionth of the signal's range), so the noise of the signal must be
/// smaller than this band.
pub(crate) fn unplay(w: f64, signal: &mut [f64]) {
    let (low, high) = signal.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
    let band = (0.1 * w).max(1e-6 * (high - low));
    if signal.is_empty() || band.is_nan() || band <= 0.0 {
        return;
    }
    let turns = turns(signal, band);
    // Distance by which the input is ahead of the output at the last reversal.
    let mut ahead = 0.0;
    for (n, turn) in turns.iter().enumerate() {
        let end = turns.get(n + 1).map_or(signal.len(), |next| next.at);
        let extreme = signal[turn.at];
        let left = (turn.at..end).find(|i| (signal[*i] - extreme).abs() > band).unwrap_or(end);
        let dwell = (left - turn.at).max(1) as f64;
        let goal = turn.direction * w;
        for (i, x) in signal[turn.at..end].iter_mut().enumerate() {
            *x += ahead + (goal - ahead) * (i as f64 / dwell).min(1.0);
        }
        ahead = goal;
    }
}

/// A sample at which a move begins, and its direction: +1 up, -1 down, 0 if the signal never moves.
struct Turn {
    at: usize,
    direction: f64,
}

/// Finds the extremes between moves of more than `band`; the first entry is the signal's start.
fn turns(signal: &[f64], band: f64) -> Vec<Turn> {
    let mut turns = alloc::vec![Turn { at: 0, direction: 0.0 }];
    let mut extreme = 0;
    for (i, x) in signal.iter().enumerate() {
        let last = turns.len() - 1;
        let moved = x - signal[extreme];
        if moved * turns[last].direction > 0.0 {
            extreme = i;
        } else if moved.abs() > band {
            let direction = moved.signum();
            if turns[last].direction == 0.0 {
                turns[last].direction = direction;
            } else {
                turns.push(Turn { at: extreme, direction });
            }
            extreme = i;
        }
    }
    turns
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use stretch_core::arithmetic::play;
    use testkit::tolerance::F64_ROUNDING;

    #[test]
    fn finds_the_input_while_the_output_moves() {
        let w = 0.5;
        let input: Vec<f64> = (0..2000).map(|i| 10.0 * libm::sin(i as f64 * 0.01)).collect();
        let mut z = input[0];
        let output: Vec<f64> = input
            .iter()
            .map(|x| {
                z = play(z, *x, w);
                z
            })
            .collect();
        let mut found = output.clone();
        unplay(w, &mut found);
        let rms = |a: &[f64]| {
            let sum: f64 = a.iter().zip(&input).map(|(a, b)| (a - b) * (a - b)).sum();
            libm::sqrt(sum / 2e3)
        };
        assert!(rms(&found) < 0.2 * rms(&output), "{} of {}", rms(&found), rms(&output));
        // Away from the reversals the result is exact.
        assert_relative_eq!(found[1000], input[1000], epsilon = 0.0, max_relative = F64_ROUNDING);
        let mut still = [3.0; 10];
        unplay(w, &mut still);
        assert_eq!(still, [3.0; 10]);
    }
}
