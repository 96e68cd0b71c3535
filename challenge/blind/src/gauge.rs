//! Simulates sleeve, gauge, bridge and amplifier, and the potentiometer.

use std::f64::consts::PI;

use crate::effect::{Causes, Kind, Stage};
use crate::electric::{Knee, Saturation, Softening};
use crate::friction::Friction;
use crate::lags::Lags;
use crate::laws::{Law, bump, path, rising, settling};
use crate::random::RandomGenerator;
use crate::rig::{L_0, P_ATM, P_REF, Rig, V_STEP};

/// Length of a session in the table of a drift, s.
const SESSION_S: f64 = 735.0;

/// State of the mechanics at one time: contraction, absolute pressure, openings.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant {
    pub(crate) k: f64,
    pub(crate) p: f64,
    pub(crate) openings: (f64, f64),
}

/// The electrical side with its internal states.
#[derive(Debug, Clone)]
pub(crate) struct Gauge<'a> {
    rig: &'a Rig,
    causes: Causes,
    active: bool,
    /// Difference between the strain at which the sleeve goes slack and the smallest nominal
    /// strain, and the form of the knee.
    slack: Option<(f64, Knee)>,
    slip: Option<Friction>,
    crosstalk: Option<(f64, Law)>,
    hysteresis: Option<(f64, Friction)>,
    relaxation: Option<(f64, Lags)>,
    softening: Option<Softening>,
    nonlinearity: Option<(f64, Law)>,
    drift: Option<(f64, Law)>,
    /// Time constant, s, with the strength and the law of the heating.
    heating: Option<(f64, (f64, Law))>,
    contact: (bool, RandomGenerator),
    saturation: Option<Saturation>,
    pickup: (f64, (f64, f64)),
    lowpass: Option<Lags>,
    last_strain: Option<f64>,
    slewed: Option<f64>,
}

impl<'a> Gauge<'a> {
    pub(crate) fn new(rig: &'a Rig, causes: &Causes) -> Self {
        let find = |kind| causes.find(kind);
        let contact_seed = find(Kind::IntermittentContact).map_or(0, |c| c.seed);
        Self {
            rig,
            active: causes.any_in(Stage::Sensing),
            slack: find(Kind::SleeveSlack).map(|c| (c.strength, Knee::of_slack(&c))),
            slip: find(Kind::SleeveSlip).map(|c| Friction::of(&c, c.strength, true)),
            crosstalk: Law::find(
                causes,
                Kind::PressureCrosstalk,
                rising,
                [|x| (1.1 * x).tanh() / 1.1_f64.tanh(), |x| x.powf(1.35)],
            ),
            hysteresis: find(Kind::GaugeHysteresis).map(|c| Friction::with_strength(&c)),
            relaxation: find(Kind::GaugeRelaxation)
                .map(|c| (c.signed(), Lags::relaxation(&c, c.log_aux(0, 0.03, 3.0), 0.2))),
            softening: find(Kind::GaugeSoftening).map(|c| Softening::of(&c)),
            nonlinearity: Law::find(
                causes,
                Kind::GaugeNonlinearity,
                bump,
                [|x| (PI * x).sin(), |x| 4.0 * x * (1.0 - x) * (0.75 + 0.5 * x)],
            ),
            drift: Law::find(
                causes,
                Kind::ThermalDrift,
                path,
                [
                    |t| 900.0 * (1.0 - (-t / 900.0).exp()),
                    |t| SESSION_S * (t.max(0.0) / SESSION_S).powf(0.8),
                ],
            ),
            heating: find(Kind::SelfHeating).map(|c| c.log_aux(0, 1.5, 30.0)).zip(Law::find(
                causes,
                Kind::SelfHeating,
                settling,
                [
                    |times| 1.0 - 0.5 * (-2.0 * times).exp() - 0.5 * (-0.5 * times).exp(),
                    |times| 1.0 - (-times.max(0.0).powf(0.65)).exp(),
                ],
            )),
            contact: (false, RandomGenerator::new(contact_seed, 7)),
            saturation: find(Kind::AmplifierSaturation).map(|c| Saturation::of(&c)),
            pickup: (0.0, (0.0, 0.0)),
            lowpass: find(Kind::AmplifierLowpass).map(|c| Lags::low_pass(&c)),
            last_strain: None,
            slewed: None,
            causes: causes.clone(),
        }
    }

    /// Whether any cause acts here. Otherwise the voltage is a function of the contraction.
    pub(crate) fn active(&self) -> bool {
        self.active
    }

    /// Switches the excitation on: the amplifier settles, and the travel is kept.
    pub(crate) fn power_up(&mut self) {
        if let Some(lags) = &mut self.lowpass {
            lags.reset();
        }
        self.slewed = None;
        self.pickup = (0.0, (0.0, 0.0));
    }

    /// Begins a session: sets the travel to 0.
    pub(crate) fn begin_session(&mut self) {
        if let Some(softening) = &mut self.softening {
            softening.begin_session();
        }
    }

    /// Returns the analogue voltage after `h` seconds. `t` is the time since the start of the
    /// trial, `session` that since the start of the session.
    pub(crate) fn step(&mut self, now: Instant, t: f64, session: f64, h: f64) -> f64 {
        if !self.active {
            return self.rig.volts(now.k);
        }
        let e = self.gauge_strain(now, h);
        let ohm = self.resistance(e, t, session, h);
        let mut excitation = self.rig.v_exc();
        if let Some(c) = self.causes.find(Kind::CoilDroop) {
            let current = now.openings.0 + now.openings.1;
            excitation *= 1.0 - c.strength * current.sqrt();
        }
        self.amplify(self.rig.bridge(ohm, excitation), now, h)
    }

    fn gauge_strain(&mut self, now: Instant, h: f64) -> f64 {
        let mut e = self.rig.strain(now.k);
        if let Some((strength, knee)) = &self.slack {
            let least = self.rig.strain(self.rig.static_contraction(self.rig.p_s() + P_ATM));
            e = knee.at_least(e, least + strength);
        }
        if let Some(slip) = &mut self.slip {
            e -= slip.push(e, h);
        }
        if let Some((strength, law)) = &self.crosstalk {
            e += strength * law.at((now.p - P_ATM) / P_REF);
        }
        if let Some((strength, memory)) = &mut self.hysteresis {
            e -= *strength * memory.push(e, h);
        }
        if let Some((share, lags)) = &mut self.relaxation {
            e += *share * (e - lags.push(e, h));
        }
        e
    }

    fn resistance(&mut self, e: f64, t: f64, session: f64, h: f64) -> f64 {
        let r0 = self.rig.r0();
        let mut ohm = r0 * (1.0 + e).powi(2);
        let moved = e - self.last_strain.replace(e).unwrap_or(e);
        if let Some(softening) = &mut self.softening {
            ohm = r0 + (ohm - r0) * (1.0 - softening.push(moved, h));
        }
        if let Some((strength, law)) = &self.nonlinearity {
            ohm *= 1.0 + strength * law.at(e / self.rig.e0());
        }
        if let Some((strength, law)) = &self.drift {
            ohm *= 1.0
                + strength
                    * match law {
                        // The result is in seconds, because the strength is a rate per second.
                        Law::Drawn(law) => SESSION_S * law.at(session.max(0.0) / SESSION_S),
                        Law::Written(law) => law(session),
                    };
        }
        if let Some((tau, (strength, law))) = &self.heating {
            let times = t / tau;
            let warm = match law {
                Law::Drawn(law) => law.at(-(-times.max(0.0)).exp_m1()),
                Law::Written(law) => law(times),
            };
            ohm *= 1.0 + strength * warm;
        }
        if let Some(c) = self.causes.find(Kind::IntermittentContact) {
            let (open, random) = &mut self.contact;
            // On average the contact stays open for 80 ms and closed for 1.5 s.
            let leave = h / if *open { 0.08 } else { 1.5 };
            if random.unit() < leave {
                *open = !*open;
            }
            ohm *= 1.0 + if *open { c.strength } else { 0.0 };
        }
        ohm
    }

    fn amplify(&mut self, volts: f64, now: Instant, h: f64) -> f64 {
        let mut v = volts;
        if let Some(saturation) = &self.saturation {
            let full = self.rig.static_contraction(self.rig.p_s() + P_ATM);
            v = saturation.clip(v, self.rig.volts(0.0), self.rig.volts(full));
        }
        if let Some(c) = self.causes.find(Kind::CapacitivePickup) {
            let (spike, last) = &mut self.pickup;
            let edge = (now.openings.0 - last.0) - 0.7 * (now.openings.1 - last.1);
            *last = now.openings;
            *spike = *spike * (-h / (0.01 + 0.05 * c.aux[0])).exp() + c.strength * edge;
            v += *spike;
        }
        if let Some(lags) = &mut self.lowpass {
            v = lags.push(v, h);
        }
        if let Some(c) = self.causes.find(Kind::AmplifierSlew) {
            let last = self.slewed.unwrap_or(v);
            // The rate limit is 10/strength, so a larger strength is slower.
            let most = h * 10.0 / c.strength;
            v = last + (v - last).clamp(-most, most);
            self.slewed = Some(v);
        }
        v
    }
}

/// Applies the effects of the converter to the samples, V: missing codes and frozen runs.
pub(crate) fn spoil_samples(causes: &Causes, trial: usize, volts: &mut [f64]) {
    if let Some(c) = causes.find(Kind::MissingCodes) {
        let bit = 5 + (c.aux[0] * 3.0) as u32;
        for v in volts.iter_mut() {
            let code = (*v / V_STEP).round().max(0.0) as u32;
            if code >> bit & 1 == 1 {
                *v += c.strength * V_STEP;
            }
        }
    }
    if let Some(c) = causes.find(Kind::FrozenSamples) {
        let mut random = RandomGenerator::new(c.seed, 100 + trial as u64);
        let mut held = 0.0;
        let mut left = 0usize;
        for v in volts.iter_mut() {
            if left > 0 {
                *v = held;
                left -= 1;
            } else if random.unit() < 0.004 {
                held = *v;
                left = (c.strength * 100.0 * (0.5 + random.unit())).round() as usize;
            }
        }
    }
}

/// The potentiometer with its internal states.
#[derive(Debug, Clone)]
pub(crate) struct Pot<'a> {
    rig: &'a Rig,
    nonlinearity: Option<(f64, Law)>,
    backlash: Option<Friction>,
    stiction: Option<(f64, Option<f64>)>,
}

impl<'a> Pot<'a> {
    pub(crate) fn new(rig: &'a Rig, causes: &Causes) -> Self {
        Self {
            rig,
            nonlinearity: Law::find(
                causes,
                Kind::PotNonlinearity,
                bump,
                [
                    |y| (PI * y).sin() + 0.12 * (2.0 * PI * y).sin(),
                    |y| 4.0 * y * (1.0 - y) * (0.8 + 0.4 * y),
                ],
            ),
            backlash: causes.find(Kind::PotBacklash).map(|c| Friction::of(&c, c.strength, true)),
            stiction: causes.find(Kind::PotStiction).map(|c| (c.strength, None)),
        }
    }

    /// Returns the length that the potentiometer shows, mm, at a contraction, `h` seconds after the
    /// previous call.
    pub(crate) fn step(&mut self, k: f64, h: f64) -> f64 {
        let mut length = L_0 * (1.0 - k);
        if let Some((strength, law)) = &self.nonlinearity {
            length += strength * law.at(k / self.rig.k_max());
        }
        if let Some(backlash) = &mut self.backlash {
            length -= backlash.push(length, h);
        }
        if let Some((reach, shown)) = &mut self.stiction {
            let stuck = shown.get_or_insert(length);
            if (length - *stuck).abs() > *reach {
                *stuck = length;
            }
            length = *stuck;
        }
        length
    }
}
