//! Crosstalk from another channel.

use alloc::{boxed::Box, vec};

use crate::{
    effect::{Acts, Effect, Live, Need},
    kind::{Beside, Kind, Side},
    operator::{Operator, Span},
    parameter::{EffectParameter, Form},
    place::{Action, Place},
    sketch::{Quantity, Sketch},
};

/// y = x + c z (1 + bend z), z = (other - middle)/span. The [`Span`] passes the other channel in the field of the
/// strain.
///
/// ```
/// use stretch_effects::{Crosstalk, Grid, Operator, Span};
/// let talk = Crosstalk { c: 0.5, bend: 0.0, middle: 10.0, span: 20.0 };
/// let (grid, mut shown) = (Grid::samples(0.01)?, [1.0, 1.0]);
/// talk.run(&Span { strain: &[10.0, 20.0], ..Span::whole(&grid) }, &mut [], &mut shown);
/// assert_eq!(shown, [1.0, 1.25]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crosstalk {
    /// Effect of one span of the other channel, in the unit of the signal.
    pub c: f64,
    /// Relative curvature of the effect.
    pub bend: f64,
    /// Value of the other channel that has no effect.
    pub middle: f64,
    /// Difference between the other channel's greatest and least value.
    pub span: f64,
}

impl Operator for Crosstalk {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (x, other) in signal.iter_mut().zip(span.strain) {
            let z = (other - self.middle) / self.span;
            *x += self.c * z * (1.0 + self.bend * z);
        }
    }
}

/// Crosstalk from another channel.
pub static CROSSTALK: Kind = Kind {
    name: "crosstalk",
    title: "crosstalk",
    words: "another channel couples into it",
    equation: "y = x + c z (1 + bend z), z the other channel from its middle, over its span",
    usual: &[Side::Output],
    beside: Beside::Another,
    parameters: |e, unit| {
        let most = 0.3 * e.span();
        let bend = EffectParameter::formed("bend", "1", -1.0..=1.0, 0.0);
        vec![EffectParameter::sized("c", unit, -most..=most), bend]
    },
    starts: Some(|e| [-0.03, 0.03].map(|k| vec![k * e.span(), 0.0]).into()),
    operator: |v, e, _| {
        let [low, high] = e.beside;
        Box::new(Crosstalk { c: v[0], bend: v[1], middle: 0.5 * (low + high), span: high - low })
    },
    sketch: Some(|v, e, signals| {
        let [low, high] = e.beside;
        let unit = &*signals.beside.unit;
        let body = "let z = (e - MIDDLE) / SPAN
            let y = x + C * z * (1 + BEND * z)";
        Sketch::of(signals.x.clone(), body)
            .beside(signals.beside.clone())
            .with_all(&[("C", v[0], &*signals.x.unit), ("BEND", v[1], "1")])
            .with_all(&[("MIDDLE", 0.5 * (low + high), unit), ("SPAN", high - low, unit)])
    }),
    ..Kind::PLAIN
};

/// Crosstalk from the pressure inside the muscle, which stretches the gauge. It is a term separate from [`CROSSTALK`]
/// because its zero is zero pressure, not the middle of the pressure's range.
pub(crate) static PRESSURE_CROSSTALK: Effect = Effect {
    name: "pressure_crosstalk",
    title: "crosstalk from pressure to gauge",
    words: "the pressure itself strains the gauge",
    equation: "e -> e + c x (1 + bend (1 - x)), x = (p - P_atm)/P_ref",
    parameters: &[
        EffectParameter::strength("c", "strain", -0.05, 0.05, 0.01),
        EffectParameter::form("bend", "1", -1.0, 1.0, Form { neutral: 0.0, usual: 0.0 }),
    ],
    acts: Acts::Own {
        action: |v, around| {
            let scale_kpa = around.pressure_scale_kpa;
            let per_kpa = v[0] / scale_kpa;
            Action::At(Place::Strain, Box::new(Pressed { per_kpa, bend: v[1], scale_kpa }))
        },
        sketch: Some(|v, around| {
            let x = around.strain();
            let body = "let u = p / P_REF
                let y = x + C * u * (1 + BEND * (1 - u))";
            Sketch::of(x.clone(), body)
                .beside(Quantity::new("p", "kPa", "pressure above the atmosphere"))
                .with_all(&[("C", v[0], &*x.unit), ("BEND", v[1], "1")])
                .with("P_REF", around.pressure_scale_kpa, "kPa")
        }),
    },
    twins: &["gauge_nonlinearity"],
    needs: Some(Need::Pressure),
    starts: Some(|_| vec![vec![0.003], vec![0.003, -0.4], vec![0.003, 0.4]]),
    live: Some(Live {
        parameters: &[
            EffectParameter::strength("c", "1", -0.6, 0.6, 0.02),
            EffectParameter::form("bend", "1", -0.8, 0.8, Form { neutral: 0.0, usual: 0.0 }),
        ],
        set: |v, target, map| {
            let c = if target.falls { -v[0] } else { v[0] };
            let (bend, scale) = (v[1], target.pressure);
            map.crosstalk = Some(stretch_core::Crosstalk { c, bend, scale });
        },
        ..Live::BY_CURVE
    }),
    ..Effect::PLAIN
};

#[derive(Debug)]
struct Pressed {
    per_kpa: f64,
    bend: f64,
    scale_kpa: f64,
}

impl Operator for Pressed {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (e, p) in signal.iter_mut().zip(span.pressure_kpa) {
            *e += self.per_kpa * p * (1.0 + self.bend * (1.0 - p / self.scale_kpa));
        }
    }
}
