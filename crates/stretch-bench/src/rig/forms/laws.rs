//! Supply and chamber: laws with a free curvature.

use stretch_sim::{Action, Droop, EffectParameter, Law, Stage};

use super::{Form, linear};

/// Pressure at which a leak of any power flows what a linear one would, Pa.
const LEAK_AT_PA: f64 = 620e3;

pub(super) static LEAK: Form = Form {
    name: "leak",
    stage: Stage::Pneumatics,
    equation: "q_leak = c p (p/620 kPa)^(power - 1), p above the atmosphere",
    parameters: &[
        EffectParameter::strength("c", "kg/(s Pa)", 0.0, 2e-10, 5e-11),
        linear("power", 0.4, 2.0, 1.0),
    ],
    needs: None,
    action: |v, _| Action::Leak(Box::new(Leak { c: v[0], power: v[1] - 1.0 })),
};

#[derive(Debug)]
struct Leak {
    c: f64,
    power: f64,
}

impl Law for Leak {
    #[inline]
    fn at(&self, p: f64) -> f64 {
        if p <= 0.0 {
            return self.c * p;
        }
        // A power without a transcendental: two terms that agree at no and at full pressure.
        let x = p / LEAK_AT_PA;
        let shape = if self.power >= 0.0 {
            1.0 + self.power * (x - 1.0)
        } else {
            (1.0 - self.power) / (1.0 - self.power * x)
        };
        self.c * p * shape.max(0.0)
    }
}

pub(super) static CHAMBER_VOLUME: Form = Form {
    name: "chamber_volume",
    stage: Stage::Pneumatics,
    equation: "V = V0 (1 + g y (1 + bend (1 - y))), y = k/k_max",
    parameters: &[
        EffectParameter::strength("g", "1", 0.0, 3.0, 1.0),
        linear("bend", -0.7, 0.7, 0.0),
    ],
    needs: None,
    action: |v, _| Action::Volume(Box::new(Growth { g: v[0], bend: v[1] })),
};

#[derive(Debug)]
struct Growth {
    g: f64,
    bend: f64,
}

impl Law for Growth {
    #[inline]
    fn at(&self, y: f64) -> f64 {
        1.0 + self.g * y * (1.0 + self.bend * (1.0 - y))
    }
}

pub(super) static SUPPLY_SAG: Form = Form {
    name: "supply_sag",
    stage: Stage::Pneumatics,
    equation: "P_s -> P_s - y, y = mean_rev(r q_in, lag_s)",
    parameters: &[
        EffectParameter::strength("r", "Pa s/kg", 0.0, 4e8, 1e8),
        EffectParameter::shape("lag_s", "s", 0.1, 1.5, 0.5),
    ],
    needs: None,
    action: |v, _| Action::Droop(Box::new(Sag { r: v[0], tau_s: v[1] })),
};

#[derive(Debug)]
struct Sag {
    r: f64,
    tau_s: f64,
}

impl Droop for Sag {
    #[inline]
    fn rate(&self, droop_pa: f64, flow_kg_s: f64) -> f64 {
        (self.r * flow_kg_s - droop_pa) / self.tau_s
    }

    fn relaxed(&self, droop_pa: f64, rest_s: f64) -> f64 {
        droop_pa * (-rest_s / self.tau_s).exp()
    }
}
