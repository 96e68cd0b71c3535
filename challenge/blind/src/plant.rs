//! Simulates valves, chamber and muscle by the classical Runge-Kutta method.

use crate::curve::Curve;
use crate::effect::{Cause, Causes, Kind};
use crate::friction::Friction;
use crate::lags::Lags;
use crate::laws::{damping, rising};
use crate::pneumatics::{DeadBand, Delay, Q_REF, Sag};
use crate::rig::{P_ATM, P_REF, R_T, RHO_0, Rig, V_0};

/// Absolute pressure divided by (1 + theta), lagged contraction, contraction, rate of the
/// contraction, sag of the supply (Pa), and theta, the relative excess of the gas temperature.
type State = [f64; 6];

/// Pneumatics and muscle with their internal states.
#[derive(Debug, Clone)]
pub(crate) struct Plant<'a> {
    rig: &'a Rig,
    pub(crate) state: State,
    shadow: f64,
    valve_lag: [f64; 2],
    shut_s: [f64; 2],
    stuck_s: [f64; 2],
    snap: (bool, f64),
    travel: f64,
    last_static: Option<f64>,
    hysteresis: Option<(f64, Friction)>,
    creep: Option<(f64, Lags)>,
    deadband: Option<(f64, DeadBand)>,
    delay: Option<(f64, Delay)>,
    causes: Causes,
    /// Laws of drawn forms; `None` for hand-written forms and for causes that are not active.
    sag: Option<Sag>,
    leak: Option<Curve>,
    volume: Option<Curve>,
    damping: Option<Curve>,
}

/// Inputs of a step: conductances of the two valves as shares of the full conductance, and the
/// absolute supply pressure, Pa.
#[derive(Debug, Clone, Copy)]
struct Drive {
    inlet: f64,
    outlet: f64,
    supply: f64,
}

impl<'a> Plant<'a> {
    pub(crate) fn new(rig: &'a Rig, causes: &Causes) -> Self {
        let drawn = |kind| causes.find(kind).filter(Cause::is_drawn);
        let law = |kind| drawn(kind).map(|c| rising(c.family, &mut c.random(1)));
        Self {
            rig,
            state: [P_ATM, 0.0, 0.0, 0.0, 0.0, 0.0],
            shadow: 0.0,
            valve_lag: [0.0; 2],
            shut_s: [10.0; 2],
            stuck_s: [0.0; 2],
            snap: (false, 0.0),
            travel: 0.0,
            last_static: None,
            hysteresis: causes.find(Kind::MuscleHysteresis).map(|c| Friction::with_strength(&c)),
            creep: causes
                .find(Kind::MuscleCreep)
                .map(|c| (c.strength, Lags::relaxation(&c, c.log_aux(0, 0.7, 25.0), 0.16))),
            deadband: causes.find(Kind::ValveDeadband).map(|c| (c.strength, DeadBand::of(&c))),
            delay: causes.find(Kind::ValveDelay).map(|c| (c.strength, Delay::of(&c))),
            sag: drawn(Kind::SupplySag).map(|c| Sag::draw(c.family, c.strength, &mut c.random(1))),
            leak: law(Kind::Leak),
            volume: law(Kind::ChamberVolume),
            damping: drawn(Kind::CrossbeamInertia).map(|c| damping(c.family, &mut c.random(1))),
            causes: causes.clone(),
        }
    }

    /// Absolute pressure, Pa.
    pub(crate) fn pressure(&self) -> f64 {
        self.state[0] * (1.0 + self.state[5])
    }

    /// Contraction.
    pub(crate) fn contraction(&self) -> f64 {
        self.state[2]
    }

    /// Contraction of a muscle without effects at the same pressure.
    pub(crate) fn shadow(&self) -> f64 {
        self.shadow
    }

    /// Sets the pressure, as if a regulator held it.
    pub(crate) fn regulate(&mut self, p: f64) {
        self.state[0] = p;
        self.state[4] = 0.0;
        self.state[5] = 0.0;
        if let Some(sag) = &mut self.sag {
            sag.reset();
        }
    }

    /// Returns the conductance at an opening (0..1), as a share of the full conductance.
    fn share(&self, u: f64, side: usize) -> f64 {
        let u = match &self.deadband {
            Some((strength, law)) => law.pass(u, *strength, side),
            None => u,
        };
        if u <= 0.0 { 0.0 } else { self.rig.u_min() + (1.0 - self.rig.u_min()) * u }
    }

    /// Returns the mean conductance over the step that begins at `t`, if commands act `late`
    /// seconds late.
    fn mean_share(
        &self,
        command: &impl Fn(f64) -> (f64, f64),
        t: f64,
        h: f64,
        late: f64,
        side: usize,
    ) -> f64 {
        let at = |time: f64| {
            let (inlet, outlet) = command(time);
            self.share(if side == 0 { inlet } else { outlet }, side)
        };
        // Commands change only at samples, so at most one change falls in a step.
        let rate = crate::protocol::RATE_HZ as f64;
        let begin = t - late;
        let change = (((begin + 1e-9) * rate).floor() + 1.0) / rate;
        let before = ((change - begin) / h).clamp(0.0, 1.0);
        let first = at(begin + 1e-9);
        if before >= 1.0 { first } else { before * first + (1.0 - before) * at(change + 1e-9) }
    }

    /// Returns the conductance of a valve over a step, including delays and sticking.
    fn valve(&mut self, command: &impl Fn(f64) -> (f64, f64), t: f64, h: f64, side: usize) -> f64 {
        let late = |late| self.mean_share(command, t, h, late, side);
        let mut lag = self.valve_lag[side];
        let mut share = match &self.delay {
            Some((strength, law)) => {
                let (inlet, outlet) = command(t + 1e-9);
                let opening = if side == 0 { inlet } else { outlet };
                law.share(*strength, (side, opening, h), late, &mut lag)
            }
            None => late(0.0),
        };
        self.valve_lag[side] = lag;
        if let Some(c) = self.causes.find(Kind::ValveSticking) {
            if c.form == 0 {
                // The longer the valve was shut, the later it opens.
                if share > 0.0 && self.shut_s[side] > 0.0 {
                    self.stuck_s[side] = c.strength * (1.0 - (-self.shut_s[side] / 1.2).exp());
                    self.shut_s[side] = 0.0;
                }
                if share <= 0.0 {
                    self.shut_s[side] += h;
                } else if self.stuck_s[side] > 0.0 {
                    let held = (self.stuck_s[side] / h).min(1.0);
                    self.stuck_s[side] -= h;
                    share *= 1.0 - held;
                }
            } else {
                let z = &mut self.valve_lag[side];
                *z = share.max(*z + (share - *z) * (h / (0.4 * c.strength + h)));
                share = *z;
            }
        }
        share
    }

    /// Returns the change of the static contraction by effects with memory. They are advanced once
    /// per step.
    fn offset(&mut self, h: f64) -> f64 {
        let k = self.rig.static_contraction(self.pressure());
        let mut offset = 0.0;
        if let Some((strength, memory)) = &mut self.hysteresis {
            offset -= *strength * memory.push(k, h);
        }
        if let Some((share, lags)) = &mut self.creep {
            offset += *share * (lags.push(k, h) - k);
        }
        if let Some(c) = self.causes.find(Kind::SnapThrough) {
            let level = k / self.rig.k_max();
            let threshold = if self.snap.0 { 0.35 } else { 0.5 } + 0.2 * c.aux[0];
            self.snap.0 = level > threshold;
            let target = if self.snap.0 { c.strength } else { 0.0 };
            self.snap.1 += (target - self.snap.1) * (h / 0.012).min(1.0);
            offset += self.snap.1;
        }
        if let Some(c) = self.causes.find(Kind::MuscleFatigue) {
            // The muscle weakens with the distance travelled and recovers with time.
            let moved = (k - self.last_static.unwrap_or(k)).abs();
            self.travel += moved - self.travel * h / (20.0 + 100.0 * c.aux[0]);
            offset -= c.strength * k * (self.travel / 1.5).tanh();
        }
        self.last_static = Some(k);
        offset
    }

    /// Returns the flow through the leak at an absolute pressure, kg/s.
    fn leak_flow(&self, c: Cause, p: f64) -> f64 {
        if let Some(law) = &self.leak {
            return c.strength * P_REF * law.at((p - P_ATM) / P_REF);
        }
        match c.form {
            0 => self.rig.flow(c.strength * P_REF / (RHO_0 * (P_REF + P_ATM)), p, P_ATM),
            _ => {
                let scale = (P_REF + P_ATM).powi(2) - P_ATM.powi(2);
                c.strength * P_REF * (p * p - P_ATM * P_ATM) / scale
            }
        }
    }

    /// Returns the acceleration of the crossbeam.
    fn acceleration(&self, c: Cause, y: &State) -> f64 {
        let omega = 1.0 / c.strength;
        let spring = omega * omega * (y[1] - y[2]);
        if let Some(law) = &self.damping {
            // The speed is in tenths of the natural angular frequency.
            let u = y[3] / (0.1 * omega);
            return spring - 0.2 * omega * omega * law.at((u + 2.0) / 4.0);
        }
        let damping = match c.form {
            0 => 0.17 + 0.1 * c.aux[0] + 0.12 * y[3].abs() / (0.1 * omega),
            _ if y[3] > 0.0 => 0.2,
            _ => 0.33,
        };
        spring - 2.0 * damping * omega * y[3]
    }

    fn derivative(&self, y: &State, drive: Drive, offset: f64) -> State {
        let rig = self.rig;
        let p = y[0] * (1.0 + y[5]);
        let q_in = rig.flow(rig.c_in() * drive.inlet, drive.supply - y[4], p);
        let mut q_out = rig.flow(rig.c_out() * drive.outlet, p, P_ATM);
        if let Some(c) = self.causes.find(Kind::Leak) {
            q_out += self.leak_flow(c, p);
        }
        let mut d = [0.0; 6];
        let target = rig.static_contraction(p) + offset;
        let mut tau = rig.tau_m();
        if let Some(c) = self.causes.find(Kind::AsymmetricLag) {
            let slower = if c.form == 0 { target < y[1] } else { target > y[1] };
            tau *= if slower { 1.0 + c.strength } else { 1.0 };
        }
        d[1] = (target - y[1]) / tau;
        if let Some(c) = self.causes.find(Kind::CrossbeamInertia) {
            d[2] = y[3];
            d[3] = self.acceleration(c, y);
        } else {
            d[2] = d[1];
        }
        let mut flow = R_T * (q_in - q_out);
        let mut volume = V_0;
        if let Some(c) = self.causes.find(Kind::ChamberVolume) {
            let x = y[2] / rig.k_max();
            let law = self.volume.as_ref();
            let (shape, slope) = match c.form {
                _ if law.is_some() => law.map_or((0.0, 0.0), |v| (v.at(x), v.slope(x))),
                0 => (1.35 * x - 0.35 * x * x, 1.35 - 0.7 * x),
                _ => {
                    let quarter = std::f64::consts::FRAC_PI_2 * 0.9;
                    let top = quarter.sin();
                    ((quarter * x).sin() / top, quarter * (quarter * x).cos() / top)
                }
            };
            volume = V_0 * (1.0 + c.strength * shape);
            flow -= p * V_0 * c.strength * slope * d[2] / rig.k_max();
        }
        d[0] = flow / volume;
        if let Some(c) = self.causes.find(Kind::AdiabaticGas) {
            d[5] = 0.4 * d[0] / y[0] - y[5] / c.strength;
        }
        // A drawn sag is constant within a step and not computed here.
        if let Some(c) = self.causes.find(Kind::SupplySag).filter(|c| !c.is_drawn()) {
            let tau = 0.25 + 0.5 * c.aux[0];
            let scale = c.strength * Q_REF;
            d[4] = match c.form {
                // A reservoir behind a regulator, whose flow is proportional to the square root of
                // the pressure drop.
                0 => {
                    let back = (y[4] / scale) / (y[4].abs() / scale + 0.01).sqrt();
                    scale / tau * (q_in / Q_REF - back)
                }
                _ => {
                    let load = q_in / Q_REF;
                    (scale * load * (0.5 + 0.5 * load) - y[4]) / tau
                }
            };
        }
        d
    }

    /// Advances by one step of `h` seconds from `t`. `command` returns the openings at a time.
    pub(crate) fn step(
        &mut self,
        command: &impl Fn(f64) -> (f64, f64),
        t: f64,
        h: f64,
        supply: f64,
    ) {
        let inlet = self.valve(command, t, h, 0);
        let mut outlet = self.valve(command, t, h, 1);
        if let Some(c) = self.causes.find(Kind::OutletCrossflow) {
            outlet += c.strength * inlet;
        }
        let drive = Drive { inlet, outlet, supply };
        let offset = self.offset(h);
        if self.sag.is_some() {
            let conductance = self.rig.c_in() * inlet;
            let flow = self.rig.flow(conductance, supply - self.state[4], self.pressure());
            self.state[4] = self.sag.as_mut().map_or(0.0, |sag| sag.push(flow, h));
        }
        let y = self.state;
        let add = |d: &State, s: f64| -> State { std::array::from_fn(|i| y[i] + s * d[i]) };
        let before = self.pressure();
        let k1 = self.derivative(&y, drive, offset);
        let k2 = self.derivative(&add(&k1, 0.5 * h), drive, offset);
        let k3 = self.derivative(&add(&k2, 0.5 * h), drive, offset);
        let k4 = self.derivative(&add(&k3, h), drive, offset);
        self.state =
            std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        self.state[0] = self.state[0].max(P_ATM);
        if self.causes.find(Kind::CrossbeamInertia).is_none() {
            self.state[2] = self.state[1];
        }
        let rig = self.rig;
        let (first, last) =
            (rig.static_contraction(before), rig.static_contraction(self.pressure()));
        // Exact for an input that changes linearly over the step.
        let (tau, slope) = (rig.tau_m(), (last - first) / h);
        let decay = (-h / tau).exp();
        self.shadow = last - slope * tau + (self.shadow - first + slope * tau) * decay;
    }
}
