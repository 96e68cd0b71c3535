//! Sleeve, gauge, bridge and amplifier, and the potentiometer.

use crate::curve::Curve;
use crate::effect::{Cause, Causes, Kind, Stage};
use crate::electric::Electric;
use crate::friction::Friction;
use crate::knee::at_least;
use crate::laws::bump;
use crate::random::RandomGenerator;
use crate::relaxation::Relaxation;
use crate::rig::{L_0, P_ATM, P_REF, Rig, V_STEP};

/// One instant of the mechanics: contraction, absolute pressure, openings.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant {
    pub(crate) k: f64,
    pub(crate) p: f64,
    pub(crate) openings: (f64, f64),
}

/// The electrical side with its memories.
#[derive(Debug, Clone)]
pub(crate) struct Gauge<'a> {
    rig: &'a Rig,
    causes: Causes,
    active: bool,
    slip: Option<Friction>,
    hysteresis: Option<(f64, Friction)>,
    relaxation: Option<(f64, Relaxation)>,
    travel: f64,
    last_strain: Option<f64>,
    poles: Option<[f64; 2]>,
    slewed: Option<f64>,
    late: Vec<f64>,
    pickup: (f64, (f64, f64)),
    contact: (bool, RandomGenerator),
    drawn: Electric,
    /// Share of the nominal excitation.
    excitation: f64,
}

impl<'a> Gauge<'a> {
    pub(crate) fn new(rig: &'a Rig, causes: &Causes) -> Self {
        let contact_seed = causes.find(Kind::IntermittentContact).map_or(0, |c| c.seed);
        Self {
            rig,
            active: causes.any_in(Stage::Sensing),
            slip: causes.find(Kind::SleeveSlip).map(|c| Friction::of(&c, c.strength, true)),
            hysteresis: causes.find(Kind::GaugeHysteresis).map(|c| {
                let reach = 0.58 * c.log_aux(0, 0.006, 0.05);
                (c.strength, Friction::of(&c, reach, false))
            }),
            relaxation: causes
                .find(Kind::GaugeRelaxation)
                .map(|c| (c.signed(), Relaxation::of(&c, c.log_aux(0, 0.03, 3.0), 0.2))),
            travel: 0.0,
            last_strain: None,
            poles: None,
            slewed: None,
            late: Vec::new(),
            pickup: (0.0, (0.0, 0.0)),
            contact: (false, RandomGenerator::new(contact_seed, 7)),
            drawn: Electric::of(causes),
            excitation: 1.0,
            causes: causes.clone(),
        }
    }

    /// Whether any cause acts here; without one the voltage is a function of contraction.
    pub(crate) fn active(&self) -> bool {
        self.active
    }

    /// Excitation on at a share of its nominal value: the amplifier settles, the travel counts on.
    pub(crate) fn power_up(&mut self, excitation: f64) {
        self.excitation = excitation;
        self.drawn.power_up();
        self.poles = None;
        self.slewed = None;
        self.late.clear();
        self.pickup = (0.0, (0.0, 0.0));
    }

    /// The session begins: travel counts from here.
    pub(crate) fn begin_session(&mut self) {
        self.travel = 0.0;
        self.drawn.begin_session();
    }

    /// Analogue voltage after `h` seconds; `t` since the trial's, `session` since the session's
    /// start.
    pub(crate) fn step(&mut self, now: Instant, t: f64, session: f64, h: f64) -> f64 {
        if !self.active {
            return self.rig.volts(now.k, self.excitation);
        }
        let e = self.gauge_strain(now, h);
        let ohm = self.resistance(e, t, session, h);
        let mut excitation = self.rig.v_exc() * self.excitation;
        if let Some(c) = self.causes.find(Kind::CoilDroop) {
            let current = now.openings.0 + now.openings.1;
            excitation *= 1.0 - c.strength * current.sqrt();
        }
        self.amplify(self.rig.bridge(ohm, excitation), now, h)
    }

    fn gauge_strain(&mut self, now: Instant, h: f64) -> f64 {
        let mut e = self.rig.strain(now.k);
        if let Some(c) = self.causes.find(Kind::SleeveSlack) {
            let least = self.rig.strain(self.rig.static_contraction(self.rig.p_s() + P_ATM));
            let width = if c.form == 0 { 0.0 } else { 0.012_f64.min(c.strength) };
            e = match &self.drawn.slack {
                Some(knee) => knee.at_least(e, least + c.strength),
                None => at_least(e, least + c.strength, width),
            };
        }
        if let Some(slip) = &mut self.slip {
            e -= slip.push(e, h);
        }
        if let Some(c) = self.causes.find(Kind::PressureCrosstalk) {
            let ratio = (now.p - P_ATM) / P_REF;
            let shape = match &self.drawn.crosstalk {
                Some(law) => law.at(ratio),
                None if c.form == 0 => (1.1 * ratio).tanh() / 1.1_f64.tanh(),
                None => ratio.powf(1.35),
            };
            e += c.signed() * shape;
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
        self.travel += moved.abs();
        if let Some((c, law)) =
            self.causes.find(Kind::GaugeSoftening).zip(self.drawn.softening.as_mut())
        {
            let done = law.push(moved, c.log_aux(0, 0.5, 12.0), h);
            ohm = r0 + (ohm - r0) * (1.0 - c.strength * done);
        } else if let Some(c) = self.causes.find(Kind::GaugeSoftening) {
            let turns = self.travel / c.log_aux(0, 0.5, 12.0);
            let done = match c.form {
                0 => 1.0 - (1.0 + turns / 0.8).powf(-0.8),
                _ => turns / (0.6 + turns),
            };
            ohm = r0 + (ohm - r0) * (1.0 - c.strength * done);
        }
        if let Some(c) = self.causes.find(Kind::GaugeNonlinearity) {
            let x = e / self.rig.e0();
            let bump = match c.form {
                _ if self.drawn.nonlinearity.is_some() => {
                    self.drawn.nonlinearity.as_ref().map_or(0.0, |law| law.at(x))
                }
                0 => (std::f64::consts::PI * x).sin(),
                _ => 4.0 * x * (1.0 - x) * (0.75 + 0.5 * x),
            };
            ohm *= 1.0 + c.signed() * bump;
        }
        if let Some(c) = self.causes.find(Kind::ThermalDrift) {
            let shape = match c.form {
                _ if self.drawn.drift.is_some() => self.drawn.drift(session),
                0 => 900.0 * (1.0 - (-session / 900.0).exp()),
                _ => 735.0 * (session.max(0.0) / 735.0).powf(0.8),
            };
            ohm *= 1.0 + c.signed() * shape;
        }
        if let Some(c) = self.causes.find(Kind::SelfHeating) {
            let tau = c.log_aux(0, 1.5, 30.0);
            let warm = match c.form {
                _ if self.drawn.heating.is_some() => self.drawn.warmth(t / tau),
                0 => 1.0 - 0.5 * (-t / (0.5 * tau)).exp() - 0.5 * (-t / (2.0 * tau)).exp(),
                _ => 1.0 - (-(t.max(0.0) / tau).powf(0.65)).exp(),
            };
            // Heat is the square of the excitation.
            ohm *= 1.0 + c.signed() * warm * self.excitation.powi(2);
        }
        if let Some(c) = self.causes.find(Kind::IntermittentContact) {
            let (open, random) = &mut self.contact;
            // Mean stay: 80 ms open, 1.5 s made.
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
        if let Some(c) = self.causes.find(Kind::AmplifierSaturation) {
            let full = self.rig.static_contraction(self.rig.p_s() + P_ATM);
            let (bottom, top) = (self.rig.nominal_volts(0.0), self.rig.nominal_volts(full));
            v = match c.form {
                _ if self.drawn.saturation.is_some() => self.drawn.clip(v, c.strength, bottom, top),
                0 => v.min(top - c.strength),
                1 => -at_least(-v, c.strength - top, 0.05_f64.min(c.strength)),
                _ => v.max(bottom + c.strength),
            };
        }
        if let Some(c) = self.causes.find(Kind::CapacitivePickup) {
            let (spike, last) = &mut self.pickup;
            let edge = (now.openings.0 - last.0) - 0.7 * (now.openings.1 - last.1);
            *last = now.openings;
            *spike = *spike * (-h / (0.01 + 0.05 * c.aux[0])).exp() + c.strength * edge;
            v += *spike;
        }
        if let Some(c) = self.causes.find(Kind::AmplifierLowpass) {
            v = match &mut self.drawn.lowpass {
                Some(filter) => filter.push(v, h),
                None => self.low_pass(v, c, h),
            };
        }
        if let Some(c) = self.causes.find(Kind::AmplifierSlew) {
            let last = self.slewed.unwrap_or(v);
            // The strength is the inverse of the rate: a larger strength is slower.
            let most = h * 10.0 / c.strength;
            v = last + (v - last).clamp(-most, most);
            self.slewed = Some(v);
        }
        v
    }

    fn low_pass(&mut self, v: f64, c: Cause, h: f64) -> f64 {
        let poles = self.poles.get_or_insert([v; 2]);
        if c.form == 0 {
            let shares = [0.7, 0.3];
            let mut x = v;
            for (z, share) in poles.iter_mut().zip(shares) {
                *z += (x - *z) * (1.0 - (-h / (share * c.strength)).exp());
                x = *z;
            }
            return x;
        }
        poles[0] += (v - poles[0]) * (1.0 - (-h / (0.85 * c.strength)).exp());
        self.late.push(poles[0]);
        // The value of 0.15 tau ago, interpolated; the first one before that.
        let last = self.late.len() - 1;
        let at = (last as f64 - 0.15 * c.strength / h).max(0.0);
        let low = at as usize;
        let (early, next) = (self.late[low], self.late[(low + 1).min(last)]);
        early + (next - early) * (at - low as f64)
    }
}

/// Effects of the converter on the samples: missing codes and frozen runs, V.
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

/// The potentiometer with its memories.
#[derive(Debug, Clone)]
pub(crate) struct Pot<'a> {
    rig: &'a Rig,
    nonlinearity: Option<(Cause, Option<Curve>)>,
    backlash: Option<Friction>,
    stiction: Option<(f64, Option<f64>)>,
}

impl<'a> Pot<'a> {
    pub(crate) fn new(rig: &'a Rig, causes: &Causes) -> Self {
        Self {
            rig,
            nonlinearity: causes
                .find(Kind::PotNonlinearity)
                .map(|c| (c, c.is_drawn().then(|| bump(c.family, &mut c.random(1))))),
            backlash: causes.find(Kind::PotBacklash).map(|c| Friction::of(&c, c.strength, true)),
            stiction: causes.find(Kind::PotStiction).map(|c| (c.strength, None)),
        }
    }

    /// Shown length in mm at a contraction, `h` seconds after the last.
    pub(crate) fn step(&mut self, k: f64, h: f64) -> f64 {
        let mut length = L_0 * (1.0 - k);
        if let Some((c, law)) = &self.nonlinearity {
            let y = k / self.rig.k_max();
            let pi = std::f64::consts::PI;
            length += c.signed()
                * match c.form {
                    _ if law.is_some() => law.as_ref().map_or(0.0, |law| law.at(y)),
                    0 => (pi * y).sin() + 0.12 * (2.0 * pi * y).sin(),
                    _ => 4.0 * y * (1.0 - y) * (0.8 + 0.4 * y),
                };
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
