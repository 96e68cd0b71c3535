//! Simulates a session on a rig: the trials one after the other. States with memory continue
//! through the pauses.

use crate::curve::hermite;
use crate::disturbances::Surroundings;
use crate::effect::{Causes, Kind};
use crate::gauge::{Gauge, Instant, Pot, spoil_samples};
use crate::plant::Plant;
use crate::protocol::{PAUSE_S, RATE_HZ, Script};
use crate::random::RandomGenerator;
use crate::rig::{P_ATM, Rig};
use crate::timing::{Skew, mains};

/// Integration steps per sample while a session is recorded: 0.5 ms each.
pub(crate) const FINE: usize = 20;
/// Integration steps per sample if two sessions are compared: 2 ms each.
pub(crate) const COARSE: usize = 5;
/// Integration steps per sample in the pauses: 2 ms each.
const PAUSE: usize = 5;
/// Length of the preparation before the first trial, s.
const PREPARE_S: f64 = 2.0 * PAUSE_S;
/// Distance between the knots of the supply fluctuation, s.
const KNOT_S: f64 = 0.1;

/// Conditions of a session that no parameter describes: supply fluctuation, start pressures and
/// sampling times.
#[derive(Debug, Clone)]
pub(crate) struct Conditions {
    supply: Vec<f64>,
    /// Error of the start pressure of each trial: Pa above the atmosphere, or the missing share of
    /// the supply if the trial starts filled.
    start_error: Vec<f64>,
    /// Delay of each sample of a trial relative to the grid, s; empty if all are on the grid.
    offsets: Vec<Vec<f64>>,
}

impl Conditions {
    /// Draws the conditions from the disturbances of a case.
    pub(crate) fn draw(
        scripts: &[Script],
        around: &Surroundings,
        random: &mut RandomGenerator,
    ) -> Self {
        let supply = around.supply.knots(knots(scripts), KNOT_S, random);
        let error = |script: &Script| {
            if script.from_full { around.starts.full(random) } else { around.starts.empty(random) }
        };
        let start_error = scripts.iter().map(error).collect();
        let offsets = scripts.iter().map(|s| around.offsets(s.openings.len(), random)).collect();
        Self { supply, start_error, offsets }
    }

    /// Returns the delay of the samples of a trial relative to the grid, s.
    pub(crate) fn offsets(&self, trial: usize) -> &[f64] {
        &self.offsets[trial]
    }

    fn supply(&self, session: f64) -> f64 {
        let at = ((session + PREPARE_S) / KNOT_S).max(0.0);
        let knot = (at as usize).min(self.supply.len() - 2);
        let (low, high) = (self.supply[knot], self.supply[knot + 1]);
        low + (high - low) * (at - knot as f64)
    }
}

/// Returns the number of knots of the supply fluctuation over a session.
fn knots(scripts: &[Script]) -> usize {
    let duration: f64 =
        scripts.iter().map(|s| s.openings.len() as f64 / RATE_HZ as f64 + s.pause_s).sum();
    ((duration + PREPARE_S) / KNOT_S) as usize + 3
}

/// Interpolates values on the grid to the times of the samples.
fn resampled(values: Vec<f64>, offsets: &[f64]) -> Vec<f64> {
    if offsets.is_empty() {
        return values;
    }
    let last = values.len() - 1;
    let at = |i: isize| values[i.clamp(0, last as isize) as usize];
    let value = |(i, late): (usize, &f64)| {
        let share = late * RATE_HZ as f64;
        let low = i as isize + share.floor() as isize;
        hermite([at(low - 1), at(low), at(low + 1), at(low + 2)], share - share.floor())
    };
    offsets.iter().enumerate().map(value).collect()
}

/// Channels of a trial before noise and rounding, with 100 samples per second.
#[derive(Debug, Clone, Default)]
pub(crate) struct Trace {
    /// Gauge pressure, Pa.
    pub(crate) pressure: Vec<f64>,
    /// Length that the potentiometer shows, mm.
    pub(crate) length: Vec<f64>,
    /// Length, mm, of a muscle without effects at the same pressure.
    pub(crate) shadow: Vec<f64>,
    /// Amplified voltage, V.
    pub(crate) volts: Vec<f64>,
    /// Smallest strain of the sleeve.
    pub(crate) least_strain: f64,
}

/// Simulates all trials in order, with `fine` integration steps per sample.
pub(crate) fn run(
    rig: &Rig,
    causes: &Causes,
    scripts: &[Script],
    conditions: &Conditions,
    fine: usize,
) -> Vec<Trace> {
    let oscillation = causes.find(Kind::SupplyOscillation);
    let supply = |session: f64| {
        let mut share = 1.0 + conditions.supply(session);
        if let Some(c) = oscillation {
            let hertz = 0.08 + 0.5 * c.aux[0];
            let phase = std::f64::consts::TAU * (hertz * session + c.aux[1]);
            share += c.strength * (phase.sin() - 1.0) * 0.5;
        }
        rig.p_s() * share + P_ATM
    };
    let mut bench = Bench {
        plant: Plant::new(rig, causes),
        gauge: Gauge::new(rig, causes),
        pot: Pot::new(rig, causes),
        causes,
        skew: causes.find(Kind::ChannelSkew).map(Skew::draw),
        supply: &supply,
    };
    bench.pause(true, P_ATM + rig.p_s(), (-PREPARE_S, PAUSE_S));
    let mut traces = Vec::with_capacity(scripts.len());
    for (trial, script) in scripts.iter().enumerate() {
        let error = conditions.start_error[trial];
        let start =
            if script.from_full { supply(script.start_s) * (1.0 - error) } else { P_ATM + error };
        let pause = (script.start_s - script.pause_s, script.pause_s);
        bench.pause(script.from_full, start, pause);
        if trial == 0 {
            bench.gauge.begin_session();
        }
        traces.push(bench.record(rig, (trial, conditions.offsets(trial)), script, fine));
    }
    traces
}

/// The parts with internal states, and the supply.
struct Bench<'a, S: Fn(f64) -> f64> {
    plant: Plant<'a>,
    gauge: Gauge<'a>,
    pot: Pot<'a>,
    causes: &'a Causes,
    skew: Option<Skew>,
    supply: &'a S,
}

impl<S: Fn(f64) -> f64> Bench<'_, S> {
    /// Simulates a pause, given by its start and its duration: fills or vents for half of it, then
    /// holds the pressure at which the next trial starts.
    fn pause(&mut self, fill: bool, target: f64, (begin, pause_s): (f64, f64)) {
        let h = 1.0 / (RATE_HZ * PAUSE) as f64;
        let steps = (pause_s / h).round() as usize;
        let open = if fill { (1.0, 0.0) } else { (0.0, 1.0) };
        for i in 0..steps {
            let t = i as f64 * h;
            // The valves shut at half of the pause, early enough for the slowest valve.
            let command =
                |time: f64| if (0.0..0.5 * pause_s).contains(&time) { open } else { (0.0, 0.0) };
            self.plant.step(&command, t, h, (self.supply)(begin + t));
            if t > 0.6 * pause_s {
                self.plant.regulate(target);
            }
            let now = self.instant((0.0, 0.0));
            self.pot.step(now.k, h);
            if self.gauge.active() {
                self.gauge.step(now, 0.0, begin + t, h);
            }
        }
    }

    fn instant(&self, openings: (f64, f64)) -> Instant {
        Instant { k: self.plant.contraction(), p: self.plant.pressure(), openings }
    }

    fn record(
        &mut self,
        rig: &Rig,
        (trial, offsets): (usize, &[f64]),
        script: &Script,
        fine: usize,
    ) -> Trace {
        let h = 1.0 / (RATE_HZ * fine) as f64;
        let samples = script.openings.len();
        let command = |time: f64| {
            if time < 0.0 {
                return (0.0, 0.0);
            }
            script.openings[((time * RATE_HZ as f64) as usize).min(samples - 1)]
        };
        let mut trace = Trace { least_strain: f64::INFINITY, ..Trace::default() };
        let mut path = Vec::with_capacity(samples * fine);
        for step in 0..samples * fine {
            let t = step as f64 * h;
            let now = self.instant(command(t + 1e-9));
            let length = self.pot.step(now.k, h);
            path.push(now);
            trace.least_strain = trace.least_strain.min(rig.strain(now.k));
            if step % fine == 0 {
                trace.pressure.push(now.p - P_ATM);
                trace.length.push(length);
                trace.shadow.push(crate::rig::L_0 * (1.0 - self.plant.shadow()));
            }
            self.plant.step(&command, t, h, (self.supply)(script.start_s + t));
        }
        for channel in [&mut trace.pressure, &mut trace.length, &mut trace.shadow] {
            *channel = resampled(std::mem::take(channel), offsets);
        }
        trace.volts = self.volts((trial, offsets), script, &path, fine);
        trace
    }

    /// Computes the voltages of a simulated path. The path is simulated first, because a skew may
    /// read later values.
    fn volts(
        &mut self,
        (trial, offsets): (usize, &[f64]),
        script: &Script,
        path: &[Instant],
        fine: usize,
    ) -> Vec<f64> {
        let h = 1.0 / (RATE_HZ * fine) as f64;
        self.gauge.power_up();
        if let Some(skew) = &mut self.skew {
            skew.begin(trial);
        }
        let every = if self.gauge.active() { 1 } else { fine };
        let mut volts = Vec::with_capacity(path.len() / fine);
        for step in (0..path.len()).step_by(every) {
            let t = step as f64 * h;
            let session = script.start_s + t;
            let shift = self.skew.as_ref().map_or(0.0, |skew| skew.at(t, session)) / h;
            let at = (step as f64 - shift).clamp(0.0, (path.len() - 1) as f64);
            let low = (at as usize).min(path.len() - 2);
            let share = at - low as f64;
            let (a, b) = (path[low], path[low + 1]);
            let seen = Instant {
                k: a.k + (b.k - a.k) * share,
                p: a.p + (b.p - a.p) * share,
                openings: path[step].openings,
            };
            let v = self.gauge.step(seen, t, session, h * every as f64);
            if step % fine == 0 {
                volts.push(v);
            }
        }
        let mut volts = resampled(volts, offsets);
        if let Some(c) = self.causes.find(Kind::MainsHum) {
            let hum = mains(c, trial, volts.len(), offsets);
            volts.iter_mut().zip(hum).for_each(|(v, hum)| *v += hum);
        }
        spoil_samples(self.causes, trial, &mut volts);
        volts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{Cause, Family, KINDS, Stage};
    use crate::protocol::session;
    use approx::assert_abs_diff_eq;
    use testkit::tolerance::{
        BLIND_FILL_PA, BLIND_FULL_PA, BLIND_HYSTERESIS_STATE, BLIND_LENGTH_MM, BLIND_TRIMMED_V,
    };

    fn short_session() -> Vec<Script> {
        let mut scripts = session(&mut RandomGenerator::new(8, 1));
        // A session of one fast inflation, one fast deflation, and 20 s of pulses.
        scripts = vec![scripts[5].clone(), scripts[11].clone(), scripts[13].clone()];
        scripts[2].openings.truncate(2000);
        for (i, script) in scripts.iter_mut().enumerate() {
            script.start_s = 40.0 * i as f64;
        }
        scripts
    }

    /// A constant supply; trials start at its pressure or at that of the atmosphere.
    fn quiet() -> Conditions {
        let offsets = vec![Vec::new(); 3];
        Conditions { supply: vec![0.0; 4000], start_error: vec![0.0; 3], offsets }
    }

    fn changed(a: &[Trace], b: &[Trace], channel: fn(&Trace) -> &Vec<f64>) -> f64 {
        let pairs = a.iter().zip(b).flat_map(|(a, b)| channel(a).iter().zip(channel(b)));
        pairs.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn every_form_acts_in_its_own_stage_and_no_earlier() {
        let scripts = short_session();
        let mut random = RandomGenerator::new(8, 2);
        let rig = Rig::nominal();
        let conditions = quiet();
        let nominal = run(&rig, &Causes::default(), &scripts, &conditions, COARSE);
        for &kind in KINDS {
            let written = (0..kind.spec().forms.len()).map(|form| (Family::Written, form));
            let drawn = Family::ALL[1..].iter().map(|&family| (family, 0));
            let drawn = drawn.filter(|_| kind.is_catalogued());
            for (family, form) in written.chain(drawn) {
                let mut cause = Cause::draw(kind, family, &mut random);
                cause.form = form;
                let causes = Causes::new(&[cause.at(0.5 * cause.most())]);
                let acting = run(&rig, &causes, &scripts, &conditions, COARSE);
                let p = changed(&nominal, &acting, |t| &t.pressure);
                let l = changed(&nominal, &acting, |t| &t.length);
                let v = changed(&nominal, &acting, |t| &t.volts);
                let label = format!("{} {}: {p} {l} {v}", kind.spec().name, cause.form_name());
                assert!(p.is_finite() && l.is_finite() && v.is_finite(), "{label}");
                match kind.spec().stage {
                    Stage::Pneumatics => assert!(p > 100.0, "{label}"),
                    Stage::Muscle => assert!(p == 0.0 && l > 0.05, "{label}"),
                    Stage::Sensing => assert!(p == 0.0 && l == 0.0 && v > 0.002, "{label}"),
                    Stage::Reference => assert!(p == 0.0 && v == 0.0 && l > 0.05, "{label}"),
                }
            }
        }
    }

    /// Returns the sum of squared differences between two sessions over all channels, in multiples
    /// of the noise.
    fn apart(a: &[Trace], b: &[Trace]) -> f64 {
        type Channel = fn(&Trace) -> &Vec<f64>;
        let channels: [(Channel, f64); 3] =
            [(|t| &t.pressure, 1200.0), (|t| &t.length, 0.05), (|t| &t.volts, 0.002)];
        let squares = channels.iter().flat_map(|(channel, noise)| {
            let pairs = a.iter().zip(b).flat_map(|(a, b)| channel(a).iter().zip(channel(b)));
            pairs.map(move |(x, y)| ((x - y) / noise).powi(2))
        });
        squares.sum()
    }

    #[test]
    fn drawn_forms_vanish_with_their_strength_grow_with_it_and_differ_by_family() {
        let mut scripts = short_session();
        // Dead bands differ at small openings.
        scripts[0].openings.iter_mut().for_each(|u| u.0 *= 0.08);
        let mut random = RandomGenerator::new(8, 6);
        let rig = Rig::nominal();
        // The positions of knees are relative to the strain and the voltage at the nominal supply.
        let conditions = quiet();
        let session =
            |causes: &[Cause]| run(&rig, &Causes::new(causes), &scripts, &conditions, COARSE);
        let nominal = session(&[]);
        for &kind in Kind::catalogued() {
            let seed = random.bits();
            let mut strongest: Vec<Vec<Trace>> = Vec::new();
            for family in Family::ALL {
                // The causes are equal except for the family of the form.
                let cause = Cause::draw(kind, family, &mut RandomGenerator::new(seed, 0));
                let name = format!("{} {family}", kind.spec().name);
                let at = |share: f64| session(&[cause.at(share * cause.most())]);
                // The inertia is left out, because its smallest strength still has an effect.
                if kind != Kind::CrossbeamInertia {
                    let none = apart(&nominal, &session(&[cause.at(1e-3 * kind.spec().least)]));
                    assert!(none < 1e-2, "{name}: {none}");
                }
                let weak = apart(&nominal, &at(0.15));
                let strong = at(0.6);
                let grown = apart(&nominal, &strong);
                assert!(grown > weak && weak > 0.0, "{name}: {weak} then {grown}");
                for other in &strongest {
                    // The limit is low, because narrow knees differ in few samples.
                    assert!(apart(&strong, other) > 1e-2, "{name} is as another family");
                }
                strongest.push(strong);
            }
        }
    }

    #[test]
    fn a_finer_step_changes_nothing_that_shows() {
        let scripts = short_session();
        let rig = Rig::nominal();
        let conditions = quiet();
        let fine = run(&rig, &Causes::default(), &scripts, &conditions, FINE);
        let finer = run(&rig, &Causes::default(), &scripts, &conditions, 2 * FINE);
        // 1e-4 of full scale: 62 Pa, 5 um, 0.33 mV.
        assert!(changed(&fine, &finer, |t| &t.pressure) < 62.0);
        assert!(changed(&fine, &finer, |t| &t.length) < 5e-3);
        assert!(changed(&fine, &finer, |t| &t.volts) < 3.3e-4);
    }

    #[test]
    fn the_nominal_rig_behaves_as_its_data_sheet_says() {
        let scripts = short_session();
        let rig = Rig::nominal();
        let conditions = quiet();
        let traces = run(&rig, &Causes::default(), &scripts, &conditions, FINE);
        let inflation = &traces[0];
        let end = inflation.length.len() - 1;
        assert_eq!(inflation.pressure[0], 0.0);
        assert_abs_diff_eq!(inflation.pressure[end], 620e3, epsilon = BLIND_FULL_PA);
        // The contraction is 1.0176 x 0.162, and the resting length 180 mm.
        let length_mm = 180.0 * (1.0 - 1.0176 * 0.162);
        assert_abs_diff_eq!(inflation.length[end], length_mm, epsilon = BLIND_LENGTH_MM);
        // Choked flow: the pressure rises at R T / V0 times C rho0 p1, 28.8 kPa in 10 ms.
        let expected = 84_148.7 / 25e-6 * 1e-9 * 1.185 * 721_325.0 * 0.01;
        assert_abs_diff_eq!(inflation.pressure[101], expected, epsilon = BLIND_FILL_PA);
        // The bridge is trimmed, so its voltage is zero at rest.
        assert_abs_diff_eq!(inflation.volts[0], 1.24, epsilon = BLIND_TRIMMED_V);
        assert!(traces[1].pressure[0] > 619e3 && traces[1].pressure[end] < 1.0);
        assert!(traces.iter().all(|t| t.least_strain > crate::rig::LEAST_STRAIN));
    }

    #[test]
    fn memories_have_a_hysteresis_state_before_a_trial_begins() {
        let scripts = short_session();
        let rig = Rig::nominal();
        let conditions = quiet();
        let random = &mut RandomGenerator::new(8, 5);
        let mut cause = Cause::draw(Kind::SleeveSlip, Family::Written, random);
        cause.form = 0;
        let causes = Causes::new(&[cause.at(0.01)]);
        let traces = run(&rig, &causes, &scripts, &conditions, COARSE);
        // The muscle was vented before the first trial, so the sleeve has slipped by 0.01 strain in
        // the direction of relaxing.
        let offset = traces[0].volts[0] - rig.volts(0.0);
        let slope = (rig.volts(0.01) - rig.volts(0.0)) / 0.01 / (1.0 + rig.e0());
        assert_abs_diff_eq!(
            offset,
            0.01 * slope,
            epsilon = BLIND_HYSTERESIS_STATE * 0.01 * slope.abs()
        );
    }
}
