//! Air leaks out of the chamber.

use stretch_effects::{
    Action, Acts, Effect, EffectParameter, Form, Law, Quantity, RigStage, Sketch, each,
};

/// Air leaks out of the chamber.
pub(super) static LEAK: Effect = Effect {
    name: "leak",
    title: "the chamber's leak",
    words: "air leaks from the chamber",
    stage: RigStage::Pneumatics,
    equation: "q_leak = c p (p/620 kPa)^(power - 1), p above the atmosphere",
    parameters: &[
        EffectParameter::strength("c", "kg/(s Pa)", 0.0, 2e-10, 5e-11),
        EffectParameter::form("power", "1", 0.4, 2.0, Form { neutral: 1.0, usual: 1.0 }),
    ],
    acts: Acts::Own {
        action: |values, _| Action::Leak(Box::new(Leak { c: values[0], excess: values[1] - 1.0 })),
        sketch: Some(|v, _| sketch([v[0], v[1]])),
    },
    starts: Some(|_| each([1e-11])),
    ..Effect::PLAIN
};

/// Pressure at which a leak of any power has the flow of a linear one, Pa.
const AT_PA: f64 = 620e3;

#[derive(Debug)]
struct Leak {
    c: f64,
    /// Power minus one.
    excess: f64,
}

impl Law for Leak {
    #[inline]
    fn at(&self, p: f64) -> f64 {
        if p <= 0.0 {
            return self.c * p;
        }
        // A power without a transcendental function: two terms that agree at zero and at full
        // pressure.
        let x = p / AT_PA;
        let shape = if self.excess >= 0.0 {
            1.0 + self.excess * (x - 1.0)
        } else {
            (1.0 - self.excess) / (1.0 - self.excess * x)
        };
        self.c * p * shape.max(0.0)
    }
}

fn sketch([c, power]: [f64; 2]) -> Sketch {
    let shape = if power >= 1.0 {
        "1 + (POWER - 1) * (p / P_AT - 1)"
    } else {
        "(2 - POWER) / (1 - (POWER - 1) * p / P_AT)"
    };
    let body = format!(
        "var y = C * p
        if p > 0
        y = C * p * max(0, {shape})
        end"
    );
    let flow = "mass flow out of the chamber; less it from the net inflow of m' = q_in - q_out";
    Sketch::of(Quantity::new("p", "Pa", "pressure in the chamber above the atmosphere"), body)
        .giving(Quantity::new("y", "kg/s", flow))
        .with_all(&[("C", c, "kg/(s Pa)"), ("POWER", power, "1"), ("P_AT", AT_PA, "Pa")])
}
