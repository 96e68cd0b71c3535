//! Drawn laws of the electrical side: knees, static laws, settling, softening, filters.

use crate::curve::Curve;
use crate::effect::{Cause, Causes, Kind};
use crate::family::Family;
use crate::filter::LowPass;
use crate::knee::Knee;
use crate::laws::{bump, path, rising, settling};
use crate::random::RandomGenerator;

/// Length of a session that a drift is tabled for, s.
const SESSION_S: f64 = 735.0;

/// Drawn laws of the active causes; `None` if a cause is absent or written.
#[derive(Debug, Clone)]
pub(crate) struct Electric {
    pub(crate) slack: Option<Knee>,
    pub(crate) saturation: Option<Saturation>,
    pub(crate) crosstalk: Option<Curve>,
    pub(crate) nonlinearity: Option<Curve>,
    pub(crate) drift: Option<Curve>,
    pub(crate) heating: Option<Curve>,
    pub(crate) softening: Option<Softening>,
    pub(crate) lowpass: Option<LowPass>,
}

/// An amplifier that clips at the top, the bottom, or both.
#[derive(Debug, Clone)]
pub(crate) struct Saturation {
    knee: Knee,
    /// Depth at top and bottom in units of the strength; `None` where it does not clip.
    top: Option<f64>,
    bottom: Option<f64>,
}

/// A gauge that gets weaker with travel.
#[derive(Debug, Clone)]
pub(crate) struct Softening {
    law: Curve,
    travel: f64,
    /// Weight of stretching; relaxing has the rest of 2.
    stretching: f64,
    /// Time in which travel is forgotten, s.
    memory_s: f64,
}

impl Softening {
    fn draw(family: Family, random: &mut RandomGenerator) -> Self {
        let law = settling(family, random);
        let stretching = match family {
            Family::Asymmetric => 2.0 * f64::from(u8::from(random.unit() < 0.5)),
            _ => 1.0,
        };
        let memory_s = match family {
            Family::RateLaws => random.log_between(500.0, 5000.0),
            _ => f64::INFINITY,
        };
        Self { law, travel: 0.0, stretching, memory_s }
    }

    /// Share of the softening that is reached after a strain moved, `turn` being its scale.
    pub(crate) fn push(&mut self, moved: f64, turn: f64, h: f64) -> f64 {
        let counts = if moved > 0.0 { self.stretching } else { 2.0 - self.stretching };
        self.travel += counts * moved.abs() - self.travel * h / self.memory_s;
        self.law.at(-(-self.travel / turn).exp_m1())
    }
}

impl Electric {
    pub(crate) fn of(causes: &Causes) -> Self {
        let find = |kind| causes.find(kind).filter(Cause::is_drawn);
        Self {
            slack: find(Kind::SleeveSlack)
                .map(|c| Knee::draw(c.family, 0.003, 0.04, &mut c.random(1)).within(c.strength)),
            saturation: find(Kind::AmplifierSaturation).map(saturation),
            crosstalk: find(Kind::PressureCrosstalk).map(|c| rising(c.family, &mut c.random(1))),
            nonlinearity: find(Kind::GaugeNonlinearity).map(|c| bump(c.family, &mut c.random(1))),
            drift: find(Kind::ThermalDrift).map(|c| path(c.family, &mut c.random(1))),
            heating: find(Kind::SelfHeating).map(|c| settling(c.family, &mut c.random(1))),
            softening: find(Kind::GaugeSoftening)
                .map(|c| Softening::draw(c.family, &mut c.random(1))),
            lowpass: find(Kind::AmplifierLowpass)
                .map(|c| LowPass::draw(c.family, c.strength, &mut c.random(1))),
        }
    }

    /// The excitation is switched on.
    pub(crate) fn power_up(&mut self) {
        if let Some(filter) = &mut self.lowpass {
            filter.reset();
        }
    }

    /// Travel counts from here.
    pub(crate) fn begin_session(&mut self) {
        if let Some(softening) = &mut self.softening {
            softening.travel = 0.0;
        }
    }

    /// Drift so far, in seconds of a steady one.
    pub(crate) fn drift(&self, session: f64) -> f64 {
        self.drift.as_ref().map_or(0.0, |law| SESSION_S * law.at(session.max(0.0) / SESSION_S))
    }

    /// Share of the heating that is reached after this many time constants.
    pub(crate) fn warmth(&self, times: f64) -> f64 {
        self.heating.as_ref().map_or(0.0, |law| law.at(-(-times.max(0.0)).exp_m1()))
    }

    /// A voltage whose range is clipped by `strength`.
    pub(crate) fn clip(&self, volts: f64, strength: f64, bottom: f64, top: f64) -> f64 {
        let Some(Saturation { knee, top: above, bottom: below }) = &self.saturation else {
            return volts;
        };
        let mut v = volts;
        if let Some(depth) = above {
            v = -knee.at_least(-v, depth * strength - top);
        }
        if let Some(depth) = below {
            v = knee.at_least(v, bottom + depth * strength);
        }
        v
    }
}

fn saturation(c: Cause) -> Saturation {
    let mut random = c.random(1);
    let knee = Knee::draw(c.family, 0.008, 0.15, &mut random).within(0.5 * c.strength);
    let both = if c.family == Family::Asymmetric { 0.5 } else { 0.15 };
    let (top, bottom) = match random.unit() {
        x if x < both => (Some(1.0), Some(random.between(0.3, 0.9))),
        x if x < both + 0.65 * (1.0 - both) => (Some(1.0), None),
        _ => (None, Some(1.0)),
    };
    Saturation { knee, top, bottom }
}
