//! Small changes of a command that are not followed.

use alloc::{boxed::Box, vec};

use crate::{
    kind::{Kind, Side},
    operator::{Operator, Span, Start},
    parameter::EffectParameter,
    sketch::Sketch,
};

/// The dead band of a servo's firmware: y stays where it is while |x - y| <= w; beyond it moves, and stops `short` w before x. A `short` of
/// 0 goes all the way, 1 is a play. Remembers y.
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
    /// How far before its target it stops, in units of the band, at most 1.
    pub short: f64,
}

impl Operator for HoldBand {
    fn cells(&self) -> usize {
        1
    }

    fn begin(&self, _start: Start, first: f64, cells: &mut [f64]) {
        cells[0] = first;
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

/// A dead band of firmware.
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
