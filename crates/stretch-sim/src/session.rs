//! A session: trials one after the other, with everything that lasts from one to the next.

use stretch_data::{Channel, Trial, TrialEntry};

use crate::{
    Chain, ChainMemory, Key, Openings, Recorded, Rig, RunSettings, SimError, Start,
    protocol::{PAUSE_S, TrialPlan},
    random::Random,
};

/// Simulates trials as they would be recorded: memories of muscle and gauge, travel, drift and the clock go on from
/// trial to trial; in the pause before each the chamber is filled or vented through the fully open valve.
///
/// ```
/// use stretch_sim::{Rig, RunSettings, Session, TrialPlan};
/// let mut rig = Rig::default();
/// rig.effects.insert("gauge_hysteresis", &[("h", 0.2), ("s", 0.012)])?;
/// let mut session = Session::new(&rig, &RunSettings { seed: 7, ..RunSettings::default() })?;
/// let (entry, trial) = session.run(&TrialPlan::inflation(1.0))?;
/// assert_eq!(entry.start_s, 0.0);
/// assert_eq!(trial.len(), 1500);
/// let (entry, _) = session.run(&TrialPlan::deflation(1.0))?;
/// assert_eq!(entry.start_s, 30.0); // 15 s of trial, 15 s of pause
/// # Ok::<(), stretch_sim::SimError>(())
/// ```
#[derive(Debug)]
pub struct Session {
    rig: Rig,
    settings: RunSettings,
    /// Prepared rig, its rate and its memory.
    prepared: Option<(f64, Chain, ChainMemory)>,
    clock_s: f64,
    trials: u64,
    last_kpa: f64,
}

/// What the channels are written to: finer than any converter, coarse enough for short numbers.
const PLACES: [f64; 3] = [1e6, 1e6, 1e7];

impl Session {
    /// A session that has not begun.
    ///
    /// # Errors
    /// A rig that fails its check, settings that make no sense.
    pub fn new(rig: &Rig, settings: &RunSettings) -> Result<Self, SimError> {
        rig.check()?;
        if !(settings.step_s.is_finite() && settings.step_s > 0.0) {
            return Err(SimError::NotPositive {
                name: "step of integration",
                value: settings.step_s,
            });
        }
        Ok(Self {
            rig: rig.clone(),
            settings: *settings,
            prepared: None,
            clock_s: 0.0,
            trials: 0,
            last_kpa: 0.0,
        })
    }

    /// Simulates the next trial; returns its entry for a data set and its recording: `inlet`, `outlet`,
    /// `pressure_kpa`, `length_mm`, `bridge_v`.
    ///
    /// # Errors
    /// Openings outside 0..1, valves with different numbers of samples, a rate that is not positive.
    pub fn run(&mut self, plan: &TrialPlan) -> Result<(TrialEntry, Trial), SimError> {
        let openings = Openings { inlet: &plan.inlet, outlet: &plan.outlet };
        let samples = openings.check()?;
        if !(plan.rate_hz.is_finite() && plan.rate_hz > 0.0) {
            return Err(SimError::NotPositive { name: "rate", value: plan.rate_hz });
        }
        let (rate, mut chain, mut memory) = match self.prepared.take() {
            Some(prepared) => prepared,
            None => self.prepare(plan.rate_hz)?,
        };
        if rate != plan.rate_hz {
            // Same effects, same memory; only the steps of time differ.
            chain = self.prepare(plan.rate_hz)?.1;
        }
        let full_kpa = 1e-3 * self.rig.params[Key::PS];
        let initial_kpa = if plan.full { full_kpa } else { 0.0 };
        let start = self.pause(&chain, &mut memory, plan, initial_kpa)?;
        let mut out = [(); 3].map(|()| vec![0.0; samples]);
        let [pressure, length, bridge] = &mut out;
        let recorded = Recorded { pressure_kpa: pressure, length_mm: length, bridge_v: bridge };
        chain.run(&mut memory, start, self.clock_s, openings, initial_kpa, recorded)?;
        self.last_kpa = out[0].last().copied().unwrap_or(self.last_kpa);
        if self.settings.noise {
            self.record(&mut out);
        }
        for (values, places) in out.iter_mut().zip(PLACES) {
            for x in values {
                *x = (*x * places).round() / places;
            }
        }
        let entry = TrialEntry {
            file: plan.file.clone(),
            kind: plan.kind,
            opening: plan.opening,
            start_s: self.clock_s,
            split: plan.split,
        };
        let names = ["inlet", "outlet", "pressure_kpa", "length_mm", "bridge_v"];
        let columns = [plan.inlet.clone(), plan.outlet.clone()].into_iter().chain(out);
        let trial = Trial {
            name: plan.file.clone(),
            time_s: (0..samples).map(|i| i as f64 / plan.rate_hz).collect(),
            channels: names
                .into_iter()
                .zip(columns)
                .map(|(name, values)| Channel { name: name.to_string(), values })
                .collect(),
        };
        // Rounded to a millionth: sums of sample times would print long.
        self.clock_s =
            ((self.clock_s + samples as f64 / plan.rate_hz + PAUSE_S) * 1e6).round() / 1e6;
        self.trials += 1;
        self.prepared = Some((plan.rate_hz, chain, memory));
        Ok((entry, trial))
    }

    fn prepare(&self, rate_hz: f64) -> Result<(f64, Chain, ChainMemory), SimError> {
        let chain =
            Chain::new(&self.rig.params, &self.rig.effects, 1.0 / rate_hz, self.settings.step_s)?;
        let memory = chain.memory();
        Ok((rate_hz, chain, memory))
    }

    /// Fills or vents the chamber in the pause before a trial; before the first only when it starts full.
    fn pause(
        &self,
        chain: &Chain,
        memory: &mut ChainMemory,
        plan: &TrialPlan,
        initial_kpa: f64,
    ) -> Result<Start, SimError> {
        if self.trials == 0 && initial_kpa == 0.0 {
            return Ok(Start::Settled);
        }
        let samples = (PAUSE_S * plan.rate_hz).ceil() as usize + 1;
        let (open, shut) = (vec![1.0; samples], vec![0.0; samples]);
        let openings = if initial_kpa > 0.0 {
            Openings { inlet: &open, outlet: &shut }
        } else {
            Openings { inlet: &shut, outlet: &open }
        };
        let mut out = [(); 3].map(|()| vec![0.0; samples]);
        let [pressure_kpa, length_mm, bridge_v] = &mut out;
        let recorded = Recorded { pressure_kpa, length_mm, bridge_v };
        let at_s = (self.clock_s - PAUSE_S).max(0.0);
        let on = Start::Carried { rest_s: 0.0 };
        chain.run(memory, on, at_s, openings, self.last_kpa, recorded)?;
        Ok(on)
    }

    /// Adds noise, and lets the converters clip and round.
    fn record(&self, out: &mut [Vec<f64>; 3]) {
        let params = &self.rig.params;
        let levels = libm::exp2(params[Key::Bits]) - 1.0;
        let sigmas = [1e-3 * params[Key::SigmaP], params[Key::SigmaL], params[Key::SigmaV]];
        for (channel, (values, sigma)) in out.iter_mut().zip(sigmas).enumerate() {
            let stream = Random::NOISE + 4 * self.trials + channel as u64;
            let mut random = Random::new(self.settings.seed, stream);
            for x in values {
                *x += sigma * random.gauss();
            }
        }
        let [_, length, bridge] = out;
        let step_mm = params[Key::Travel] / levels;
        for l in length {
            *l = (*l / step_mm).round() * step_mm;
        }
        let full_v = params[Key::VFs];
        for v in bridge {
            *v = (v.clamp(0.0, full_v) / full_v * levels).round() / levels * full_v;
        }
    }
}
