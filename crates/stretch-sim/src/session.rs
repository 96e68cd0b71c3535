//! A session: trials one after the other, with all states that continue from one trial to the next.

use stretch_data::{Channel, Trial, TrialEntry};

use crate::{
    Chain, ChainMemory, Held, Key, Openings, Recorded, Rig, RigParams, RunSettings, Setting,
    SimError, Start,
    protocol::{PAUSE_S, TrialPlan},
    random::Random,
};

/// Simulates trials as they would be recorded: memories of muscle and gauge, travel, drift and the
/// clock continue from trial to trial. In the pause before each trial the chamber is filled or
/// vented through the fully open valve.
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
    /// The prepared rig and its memory, with the sample rate and the excitation for which it was
    /// prepared.
    prepared: Option<([f64; 2], Chain, ChainMemory)>,
    /// Session time at which the last trial ended, s.
    end_s: f64,
    trials: u64,
    last_kpa: f64,
}

/// Inverse resolution of the written channels. It is finer than that of any converter, and coarse
/// enough that the numbers are short.
const PLACES: [f64; 3] = [1e6, 1e6, 1e7];

/// The longest pause that is simulated, in samples: a day at 100 Hz, which takes half a gigabyte.
const MOST_PAUSE: f64 = 8_640_000.0;

impl Session {
    /// A session before its first trial.
    ///
    /// # Errors
    /// A rig that fails its check, or invalid settings.
    pub fn new(rig: &Rig, settings: &RunSettings) -> Result<Self, SimError> {
        rig.check()?;
        if !(settings.step_s.is_finite() && settings.step_s > 0.0) {
            return Err(SimError::not_positive("step of integration", settings.step_s));
        }
        Ok(Self {
            rig: rig.clone(),
            settings: *settings,
            prepared: None,
            end_s: 0.0,
            trials: 0,
            last_kpa: 0.0,
        })
    }

    /// Simulates the next trial. Returns its entry for a data set and its recording: `inlet`,
    /// `outlet`, `pressure_kpa`, `length_mm`, `bridge_v`, and the plan's other inputs.
    ///
    /// # Errors
    /// Openings outside 0..1, valves with different numbers of samples, a rate that is not
    /// positive, a start before the end of the previous trial.
    pub fn run(&mut self, plan: &TrialPlan) -> Result<(TrialEntry, Trial), SimError> {
        let openings = Openings { inlet: &plan.inlet, outlet: &plan.outlet };
        let samples = openings.check()?;
        if !(plan.rate_hz.is_finite() && plan.rate_hz > 0.0) {
            return Err(SimError::not_positive("rate", plan.rate_hz));
        }
        let (start_s, pause_s) = self.clock(plan)?;
        let wanted = [plan.rate_hz, plan.excitation];
        let (found, mut chain, mut memory) = match self.prepared.take() {
            Some(prepared) => prepared,
            None => self.prepare(wanted)?,
        };
        if found != wanted {
            // The effects stay the same, so the memory can still be used. Only the time steps and
            // the excitation change.
            chain = self.prepare(wanted)?.1;
        }
        let full_kpa = 1e-3 * self.rig.params[Key::PS];
        let initial_kpa = if plan.full { full_kpa } else { 0.0 };
        let times = (start_s, pause_s);
        let start = self.pause(&chain, &mut memory, plan, times, initial_kpa)?;
        let mut out = [(); 3].map(|()| vec![0.0; samples]);
        let [pressure, length, bridge] = &mut out;
        let recorded = Recorded { pressure_kpa: pressure, length_mm: length, bridge_v: bridge };
        match &plan.set_length_mm {
            None => chain.run(&mut memory, start, start_s, openings, initial_kpa, recorded)?,
            Some(length_mm) => {
                let (dt_s, step_s) = (1.0 / plan.rate_hz, self.settings.step_s);
                let params = self.excited(plan.excitation);
                let held = Held::new(&params, &self.rig.effects, dt_s, step_s)?;
                let setting = Setting { length_mm, shunt: plan.shunt.as_deref().unwrap_or(&[]) };
                let begun = (start, start_s);
                held.run(&mut memory, begun, openings, setting, initial_kpa, recorded)?;
            }
        }
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
            start_s,
            split: plan.split,
            digest: None,
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
                .chain(plan.more_columns())
                .collect(),
        };
        self.end_s = start_s + samples as f64 / plan.rate_hz;
        self.trials += 1;
        self.prepared = Some((wanted, chain, memory));
        Ok((entry, trial))
    }

    /// Session time at which a trial begins, and the length of the pause before it, s.
    fn clock(&self, plan: &TrialPlan) -> Result<(f64, f64), SimError> {
        // Rounded to a millionth, because sums of sample times would have many digits.
        let rounded = |s: f64| (s * 1e6).round() / 1e6;
        let usual = if self.trials == 0 { 0.0 } else { rounded(self.end_s + PAUSE_S) };
        let start_s = plan.start_s.unwrap_or(usual);
        let pause_s = if self.trials == 0 { PAUSE_S } else { rounded(start_s - self.end_s) };
        if !(start_s.is_finite() && pause_s >= 0.0) {
            return Err(SimError::not_positive("pause before a trial, s", pause_s));
        }
        Ok((start_s, pause_s))
    }

    /// The rig's parameters with the bridge at a share of its excitation.
    fn excited(&self, share: f64) -> RigParams {
        let mut params = self.rig.params;
        params[Key::VExc] *= share;
        params
    }

    /// Prepares the rig for a rate and an excitation.
    fn prepare(&self, wanted: [f64; 2]) -> Result<([f64; 2], Chain, ChainMemory), SimError> {
        let (params, dt_s) = (self.excited(wanted[1]), 1.0 / wanted[0]);
        let chain = Chain::new(&params, &self.rig.effects, dt_s, self.settings.step_s)?;
        let memory = chain.memory();
        Ok((wanted, chain, memory))
    }

    /// Fills or vents the chamber in the pause before a trial; before the first trial only if it
    /// starts full.
    fn pause(
        &self,
        chain: &Chain,
        memory: &mut ChainMemory,
        plan: &TrialPlan,
        (start_s, pause_s): (f64, f64),
        initial_kpa: f64,
    ) -> Result<Start, SimError> {
        if self.trials == 0 && initial_kpa == 0.0 {
            return Ok(Start::Settled);
        }
        let samples = pause_s * plan.rate_hz;
        if samples > MOST_PAUSE {
            let problem = format!(
                "the pause before this trial, {pause_s} s, has {samples} samples; at most {MOST_PAUSE} are simulated"
            );
            return Err(SimError::column("start_s", &problem));
        }
        let samples = samples.ceil() as usize + 1;
        let (open, shut) = (vec![1.0; samples], vec![0.0; samples]);
        let openings = if initial_kpa > 0.0 {
            Openings { inlet: &open, outlet: &shut }
        } else {
            Openings { inlet: &shut, outlet: &open }
        };
        let mut out = [(); 3].map(|()| vec![0.0; samples]);
        let [pressure_kpa, length_mm, bridge_v] = &mut out;
        let recorded = Recorded { pressure_kpa, length_mm, bridge_v };
        let at_s = (start_s - pause_s).max(0.0);
        let on = Start::Carried { rest_s: 0.0 };
        chain.run(memory, on, at_s, openings, self.last_kpa, recorded)?;
        Ok(on)
    }

    /// Adds noise to the three channels, rounds the length to its converter's steps, and clips and
    /// rounds the bridge voltage.
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
