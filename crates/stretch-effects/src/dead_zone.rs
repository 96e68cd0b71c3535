//! Dead zones, dead bands and quantisation.

use alloc::{boxed::Box, vec};

use crate::{
    kind::{Kind, Side},
    operator::{Operator, Span, Start},
    parameter::EffectParameter,
    sketch::Sketch,
};

/// A dead zone on both sides of zero: y = x - clamp(x, -w, w). With a softness s the edge is gradual: y = sign(x)
/// (softplus(|x| - w) - softplus(-w)), with a softplus of width s w.
///
/// ```
/// use stretch_effects::{DeadZone, Grid, Operator, Span};
/// let mut torque = [-1.0, -0.25, 0.0, 0.25, 2.0];
/// DeadZone { w: 0.5, softness: 0.0 }.run(&Span::whole(&Grid::samples(0.01)?), &mut [], &mut torque);
/// assert_eq!(torque, [-0.5, 0.0, 0.0, 0.0, 1.5]);
/// let mut soft = [0.0, 0.5];
/// DeadZone { w: 0.5, softness: 0.2 }.run(&Span::whole(&Grid::samples(0.01)?), &mut [], &mut soft);
/// assert!(soft[0] == 0.0 && soft[1] > 0.0 && soft[1] < 0.1);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeadZone {
    /// Half-width, in the unit of the signal, at least 0.
    pub w: f64,
    /// Width of the edge, in units of the half-width; 0 is an abrupt edge.
    pub softness: f64,
}

impl Operator for DeadZone {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        let knee = self.softness * self.w;
        if knee <= 0.0 {
            signal.iter_mut().for_each(|x| *x -= x.clamp(-self.w, self.w));
            return;
        }
        let plus = |z: f64| if z > 37.0 { z } else { libm::log1p(libm::exp(z)) };
        let at_zero = plus(-self.w / knee);
        for x in signal {
            let size = knee * (plus((x.abs() - self.w) / knee) - at_zero);
            *x = size.copysign(*x);
        }
    }
}

/// Small values have no effect.
pub static DEAD_ZONE: Kind = Kind {
    name: "dead_zone",
    title: "a dead zone",
    words: "small values do nothing",
    equation: "y = x - clamp(x, -w, w)",
    usual: &[Side::Input],
    parameters: |e, unit| {
        let size = e.low.abs().max(e.high.abs());
        let softness = EffectParameter::formed("softness", "1", 0.0..=1.0, 0.0);
        vec![EffectParameter::sized("w", unit, 0.0..=0.5 * size), softness]
    },
    starts: Some(|e| {
        let size = e.low.abs().max(e.high.abs());
        [0.02, 0.1, 0.25].map(|k| vec![k * size, 0.0]).into()
    }),
    operator: |v, _, _| Box::new(DeadZone { w: v[0], softness: v[1] }),
    sketch: Some(|v, _, signals| {
        let x = signals.x.clone();
        let sketch = match v[1] {
            0.0 => Sketch::of(x, "let y = x - max(-W, min(W, x))"),
            softness => {
                let body = "let knee = SOFTNESS * W
                    let z = (abs(x) - W) / knee
                    let at_zero = log1p(exp(-1 / SOFTNESS))
                    var y = knee * (max(z, 0) + log1p(exp(-abs(z))) - at_zero)
                    if x < 0
                    y = -y
                    end";
                Sketch::of(x, body).with("SOFTNESS", softness, "1")
            }
        };
        sketch.with("W", v[0], &signals.x.unit)
    }),
    twins: &["backlash", "firmware_dead_band"],
    ..Kind::PLAIN
};

/// The dead band of a servo's firmware. The output y is held while |x - y| <= w. Otherwise it moves towards x and stops
/// at the distance `short` w before x. With a `short` of 0 it moves all the way to x; a `short` of 1 gives a play
/// (backlash). The memory is y.
///
/// ```
/// use stretch_effects::{Grid, HoldBand, Operator, Span, Start};
/// let (mut cells, mut command) = ([0.0], [0.0, 0.5, 1.5, 1.0, 0.0]);
/// let servo = HoldBand { w: 1.0, short: 0.0 };
/// servo.begin(Start::Settled, command[0], &mut cells);
/// servo.run(&Span::whole(&Grid::samples(0.01)?), &mut cells, &mut command);
/// assert_eq!(command, [0.0, 0.0, 1.5, 1.5, 0.0]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoldBand {
    /// Greatest change that is not followed, in the unit of the signal, at least 0.
    pub w: f64,
    /// Distance from the target at which the output stops, in units of `w`, at most 1.
    pub short: f64,
}

impl Operator for HoldBand {
    fn cells(&self) -> usize {
        1
    }

    fn run(&self, _span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let mut y = cells[0];
        for x in signal {
            let apart = *x - y;
            if apart.abs() > self.w {
                y = *x - (self.short * self.w).copysign(apart);
            }
            *x = y;
        }
        cells[0] = y;
    }
}

/// A dead band of the firmware.
pub static FIRMWARE_DEAD_BAND: Kind = Kind {
    name: "firmware_dead_band",
    title: "a dead band of the firmware",
    words: "a command that is changed by less than a band is not followed",
    equation: "y stays while |x - y| <= w, else y = x - short w sign(x - y)",
    usual: &[Side::Input],
    parameters: |e, unit| {
        vec![
            EffectParameter::sized("w", unit, 0.0..=0.5 * e.span()),
            EffectParameter::formed("short", "1", 0.0..=1.0, 0.0),
        ]
    },
    starts: Some(|e| [0.005, 0.02, 0.08].map(|k| vec![k * e.span(), 0.0]).into()),
    operator: |v, _, _| Box::new(HoldBand { w: v[0], short: v[1] }),
    sketch: Some(|v, _, signals| {
        let body = "if x - s.at > W
            s.at = x - SHORT * W
            end
            if s.at - x > W
            s.at = x + SHORT * W
            end
            let y = s.at";
        Sketch::of(signals.x.clone(), body)
            .with_all(&[("W", v[0], &*signals.x.unit), ("SHORT", v[1], "1")])
            .remembering(["at"])
    }),
    twins: &["backlash", "dead_zone", "quantisation"],
    hides_input: true,
    ..Kind::PLAIN
};

/// Opening, as a share, that represents a barely open valve.
const BARELY: f64 = 1e-12;

/// A valve that stays closed below a least command.
///
/// u -> max(0, (u - d(u))/(1 - d(1))), d(u) = u_db (1 - exp(-u/(u_db softness))). At a softness of 0, d is u_db. The
/// resulting conductance, least + (1 - least) u, is multiplied by 1 - exp(-u/(u_db gate)); at a gate of 0 this factor
/// is 1. A conductance below the least one is produced by evenly spaced pulses: a share of the samples passes the least
/// conductance. The memory is the accumulated share that has not been passed yet.
///
/// ```
/// use stretch_effects::{DeadBand, Grid, Operator, Span, Start};
/// let grid = Grid::samples(0.01)?;
/// let taken = |valve: DeadBand, commands: &[f64]| {
///     let (mut cells, mut openings) = ([0.0], commands.to_vec());
///     valve.begin(Start::Settled, commands[0], &mut cells);
///     valve.run(&Span::whole(&grid), &mut cells, &mut openings);
///     openings
/// };
/// let hard = DeadBand { u_db: 0.25, softness: 0.0, gate: 0.0, least: 0.02 };
/// assert_eq!(taken(hard, &[0.0, 0.1, 0.625, 1.0]), [0.0, 0.0, 0.5, 1.0]);
/// // A gate that lets a quarter of the least conductance pass is open a quarter of the time.
/// let gated = DeadBand { u_db: 0.01, softness: 1.5, gate: 0.9, least: 0.02 };
/// let open = taken(gated, &[0.0025; 1000]).iter().filter(|u| **u > 0.0).count();
/// assert!((200..320).contains(&open));
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeadBand {
    /// Greatest command at which the valve is still closed.
    pub u_db: f64,
    /// Width of the transition at the edge of the band, as a share of the band; 0 is an abrupt edge.
    pub softness: f64,
    /// Width of the gradual rise of the conductance above the band, in units of the band; 0 is an abrupt rise.
    pub gate: f64,
    /// Conductance of a barely open valve, as a share of the full conductance.
    pub least: f64,
}

impl DeadBand {
    /// Returns the opening that remains after the band is subtracted.
    fn shifted(&self, u: f64) -> f64 {
        if self.softness == 0.0 {
            return ((u - self.u_db) / (1.0 - self.u_db)).max(0.0);
        }
        let band = |u: f64| -self.u_db * libm::expm1(-u / (self.u_db * self.softness));
        ((u - band(u)) / (1.0 - band(1.0))).max(0.0)
    }
}

impl Operator for DeadBand {
    fn cells(&self) -> usize {
        1
    }

    fn begin(&self, _start: Start, _first: f64, cells: &mut [f64]) {
        cells[0] = 0.0;
    }

    fn run(&self, _span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        if self.u_db <= 0.0 {
            return;
        }
        let (owed, least) = (&mut cells[0], self.least);
        for opening in signal {
            let u = *opening;
            *opening = if u > 0.0 { self.shifted(u) } else { 0.0 };
            if self.gate == 0.0 || *opening <= 0.0 {
                continue;
            }
            let passed = -libm::expm1(-u / (self.u_db * self.gate));
            let share = (least + (1.0 - least) * *opening) * passed;
            if share >= least {
                *opening = ((share - least) / (1.0 - least)).min(1.0);
                continue;
            }
            *owed += share / least;
            let pulse = *owed >= 1.0;
            *owed -= f64::from(u8::from(pulse));
            *opening = if pulse { BARELY } else { 0.0 };
        }
    }
}

/// Rounding to multiples of a step: y = step round(x/step); halves are rounded away from zero.
///
/// ```
/// use stretch_effects::{Grid, Operator, Quantiser, Span};
/// let mut length_mm = [0.1, 0.4, -0.25];
/// Quantiser { step: 0.25 }.run(&Span::whole(&Grid::samples(0.01)?), &mut [], &mut length_mm);
/// assert_eq!(length_mm, [0.0, 0.5, -0.25]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantiser {
    /// Step, in the unit of the signal.
    pub step: f64,
}

impl Operator for Quantiser {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for x in signal {
            *x = libm::round(*x / self.step) * self.step;
        }
    }
}

/// Quantisation.
pub static QUANTISATION: Kind = Kind {
    name: "quantisation",
    title: "quantisation",
    words: "it comes in steps",
    equation: "y = step round(x/step)",
    parameters: |e, unit| vec![EffectParameter::sized("step", unit, 0.0..=0.1 * e.span())],
    starts: Some(|e| vec![vec![e.lattice], vec![0.01 * e.span()]]),
    operator: |v, _, _| Box::new(Quantiser { step: v[0].max(1e-300) }),
    sketch: Some(|v, _, signals| {
        let body = "var y = STEP * floor(abs(x) / STEP + 0.5)
            if x < 0
            y = -y
            end";
        Sketch::of(signals.x.clone(), body).with("STEP", v[0], &signals.x.unit)
    }),
    ..Kind::PLAIN
};
