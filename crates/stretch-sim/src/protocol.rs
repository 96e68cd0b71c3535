//! Protocols: commands of the valves, trial after trial.

use stretch_data::{Channel, Split, Trial, TrialKind};

use crate::{Key, RigParams, SimError, StaticLaw, random::Random, stages::check_length};

/// Samples per second of every protocol of the paper.
pub const RATE_HZ: f64 = 100.0;
/// Openings of the paper's ramps.
pub const OPENINGS: [f64; 6] = [0.0025, 0.125, 0.25, 0.5, 0.75, 1.0];
/// Seconds between trials. In the pause the clock runs, the excitation is off, and the muscle is filled or vented.
pub const PAUSE_S: f64 = 15.0;
/// Samples of rest at every trial's start, both valves shut.
const REST: usize = 100;
const RAMP_S: f64 = 15.0;
const LONG_S: f64 = 60.0;

/// Commands of the valves in one trial, and the names of the trial.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialPlan {
    /// File to be written.
    pub file: String,
    /// Kind of the trial.
    pub kind: TrialKind,
    /// The opening that is held, if there is only one.
    pub opening: Option<f64>,
    /// Whether the trial is for fitting or for testing.
    pub split: Split,
    /// Whether the chamber starts full (settled at the supply pressure); otherwise it starts
    /// vented.
    pub full: bool,
    /// Samples per second.
    pub rate_hz: f64,
    /// Opening of the inlet, one value per sample.
    pub inlet: Vec<f64>,
    /// Opening of the outlet, one value per sample.
    pub outlet: Vec<f64>,
    /// Excitation of the bridge, as a share of the rig's.
    pub excitation: f64,
    /// Length that is imposed from outside (clamped, or held by gauge blocks), mm, one value per
    /// sample; `None` if the muscle moves freely.
    pub set_length_mm: Option<Vec<f64>>,
    /// Share by which a shunt lowers the trim of the bridge, one value per sample; `None` without a
    /// shunt.
    pub shunt: Option<Vec<f64>>,
    /// Session time at which the trial begins, s; `None` if it follows the previous trial after the
    /// usual pause.
    pub start_s: Option<f64>,
}

/// Columns of a trial with inputs other than the valve openings.
const EXCITATION: &str = "excitation_share";
const SET_LENGTH: &str = "set_length_mm";
const SHUNT: &str = "shunt_share";

impl TrialPlan {
    /// Plans a trial at [`RATE_HZ`] that begins vented, with both valves shut for `seconds`.
    ///
    /// ```
    /// use stretch_data::TrialKind;
    /// use stretch_sim::TrialPlan;
    /// let rest = TrialPlan::new("rest.csv".into(), TrialKind::Other, 2.0);
    /// assert_eq!((rest.inlet, rest.outlet), (vec![0.0; 200], vec![0.0; 200]));
    /// ```
    pub fn new(file: String, kind: TrialKind, seconds: f64) -> Self {
        let samples = (seconds * RATE_HZ) as usize;
        Self {
            file,
            kind,
            opening: None,
            split: Split::Fit,
            full: false,
            rate_hz: RATE_HZ,
            inlet: vec![0.0; samples],
            outlet: vec![0.0; samples],
            excitation: 1.0,
            set_length_mm: None,
            shunt: None,
            start_s: None,
        }
    }

    /// Plans an inflation from atmospheric pressure: 1 s of rest, then the inlet held at an opening; 15 s in total.
    pub fn inflation(opening: f64) -> Self {
        let mut plan = Self::new(ramp_file("inflation", opening), TrialKind::Inflation, RAMP_S);
        plan.inlet[REST..].fill(opening);
        Self { opening: Some(opening), ..plan }
    }

    /// Plans a deflation from full contraction: 1 s of rest, then the outlet held at an opening; 15 s in total.
    pub fn deflation(opening: f64) -> Self {
        let mut plan = Self::new(ramp_file("deflation", opening), TrialKind::Deflation, RAMP_S);
        plan.outlet[REST..].fill(opening);
        Self { opening: Some(opening), full: true, ..plan }
    }

    /// Plans 60 s of random segments of 0.15 .. 1.5 s. Each inflates, deflates or holds (with probabilities 0.42, 0.42,
    /// 0.16) at a random opening of 0.125 .. 1. `number` chooses the file's name and an independent stream of the seed.
    pub fn arbitrary(number: usize, seed: u64) -> Self {
        let mut plan = Self::new(format!("arbitrary_{number}.csv"), TrialKind::Arbitrary, LONG_S);
        let mut random = Random::new(seed, stream(number, 0));
        let mut at = REST;
        while at < plan.inlet.len() {
            let length = (random.between(0.15, 1.5) * RATE_HZ).round() as usize;
            let end = (at + length).min(plan.inlet.len());
            let what = random.uniform();
            let opening = OPENINGS[1 + ((random.uniform() * 5.0) as usize).min(4)];
            if what < 0.42 {
                plan.inlet[at..end].fill(opening);
            } else if what < 0.84 {
                plan.outlet[at..end].fill(opening);
            }
            at = end;
        }
        plan
    }

    /// Plans 60 s of pairs of pulses. A pulse opens the inlet fully for 0.25 s. In the gap between the two pulses of a
    /// pair the outlet is open. The gap lasts 1.4 s at first, becomes 18 % shorter with each pair down to 0.15 s, and
    /// then starts over. After a pair the outlet stays open for 1 s, then both valves are shut for 0.3 .. 1 s.
    pub fn pulses(number: usize, seed: u64) -> Self {
        let mut plan = Self::new(format!("pulses_{number}.csv"), TrialKind::Pulses, LONG_S);
        let mut random = Random::new(seed, stream(number, 1));
        let total = plan.inlet.len();
        let mut at = REST;
        let mut hold = |inlet: f64, outlet: f64, seconds: f64| {
            let end = (at + (seconds * RATE_HZ).round() as usize).min(total);
            plan.inlet[at..end].fill(inlet);
            plan.outlet[at..end].fill(outlet);
            at = end;
            at < total
        };
        let mut gap: f64 = 1.4;
        while hold(1.0, 0.0, 0.25)
            && hold(0.0, 1.0, gap)
            && hold(1.0, 0.0, 0.25)
            && hold(0.0, 1.0, 1.0)
            && hold(0.0, 0.0, random.between(0.3, 1.0))
        {
            gap = if gap <= 0.15 { 1.4 } else { (0.82 * gap).max(0.15) };
        }
        plan
    }

    /// The paper's session: six inflations, six deflations, an arbitrary and a pulse trial for fitting, and two
    /// arbitrary trials and one pulse trial for testing. The session lasts 12 min and has 480 s of recordings.
    ///
    /// ```
    /// let plans = stretch_sim::TrialPlan::paper(1);
    /// assert_eq!(plans.len(), 17);
    /// assert_eq!(plans.iter().map(|p| p.inlet.len()).sum::<usize>(), 48_000);
    /// ```
    pub fn paper(seed: u64) -> Vec<Self> {
        let test = |plan: Self| Self { split: Split::Test, ..plan };
        let mut plans: Vec<Self> = OPENINGS.map(Self::inflation).into();
        plans.extend(OPENINGS.map(Self::deflation));
        plans.extend([Self::arbitrary(1, seed), Self::pulses(1, seed)]);
        plans.extend(
            [Self::arbitrary(2, seed), Self::arbitrary(3, seed), Self::pulses(2, seed)].map(test),
        );
        plans
    }

    /// The plan of a recorded (or invented) trial, for a replay.
    ///
    /// | column | use |
    /// | --- | --- |
    /// | `inlet`, `outlet` | the openings; required |
    /// | `excitation_share` | excitation of the bridge, a share of the rig's, constant; 1 if it is missing |
    /// | `set_length_mm` | the length is imposed from outside, mm |
    /// | `shunt_share` | a shunt lowers the trim of the bridge by this share; only at an imposed length |
    /// | another `set_...` or `..._share` | refused: this rig cannot do it |
    /// | any other | ignored, because it is a recorded channel |
    ///
    /// The replay starts full if the first `pressure_kpa` is above half of the rig's supply pressure or, without a
    /// pressure column, if the first `length_mm` is below the length at half of the full contraction. Without both
    /// columns it starts vented.
    ///
    /// # Errors
    /// A missing `inlet` or `outlet`, an opening outside 0..1, fewer than two samples, time that is
    /// not uniform, and columns as above.
    ///
    /// ```
    /// use stretch_data::{Channel, Trial};
    /// use stretch_sim::{RigParams, TrialPlan};
    /// let column = |name: &str, x: f64| Channel { name: name.into(), values: vec![x; 3] };
    /// let rig = RigParams::default();
    /// let mut trial = Trial { name: "next.csv".into(), time_s: vec![0.0, 0.01, 0.02], ..Trial::default() };
    /// trial.channels = vec![column("inlet", 0.0), column("outlet", 0.0), column("excitation_share", 0.7)];
    /// assert_eq!(TrialPlan::from_trial(&trial, &rig)?.excitation, 0.7);
    /// trial.channels.push(column("set_pressure_kpa", 100.0));
    /// let error = TrialPlan::from_trial(&trial, &rig).unwrap_err().to_string();
    /// assert!(error.contains("set_pressure_kpa"), "{error}");
    /// # Ok::<(), stretch_sim::SimError>(())
    /// ```
    pub fn from_trial(trial: &Trial, rig: &RigParams) -> Result<Self, SimError> {
        check_columns(trial)?;
        check_lengths(trial)?;
        let missing = |name: &str| SimError::Refused(format!("the trial has no column `{name}`"));
        let column = |name: &str| trial.channel(name).ok_or_else(|| missing(name));
        let (inlet, outlet) = (column("inlet")?.to_vec(), column("outlet")?.to_vec());
        crate::Openings { inlet: &inlet, outlet: &outlet }.check()?;
        let time = &trial.time_s;
        if time.len() < 2 {
            check_length("time_s", 2, time.len())?;
        }
        let mut steps: Vec<f64> = time.windows(2).map(|t| t[1] - t[0]).collect();
        steps.sort_by(f64::total_cmp);
        let expected = steps[steps.len() / 2];
        let even = |step: f64| (step - expected).abs() <= 0.01 * expected;
        // Times are written with a few decimals. A deviation of up to a hundredth of a step is rounding, a larger one
        // is a gap.
        if let Some(i) = time.windows(2).position(|t| !even(t[1] - t[0])) {
            let (sample, found) = (i + 1, time[i + 1] - time[i]);
            return Err(SimError::Refused(format!(
                "sample {sample}: time advances by {found} s, but the trial's step is {expected} s"
            )));
        }
        // The mean rate, rounded to a whole number if rounding of the times explains the
        // difference.
        let rate = (time.len() - 1) as f64 / (time[time.len() - 1] - time[0]);
        let rate_hz = if (rate - rate.round()).abs() < 1e-6 * rate { rate.round() } else { rate };
        let supply_kpa = 1e-3 * rig[Key::PS];
        let half_mm = rig[Key::L0] * (1.0 - 0.5 * StaticLaw::new(rig).contraction(supply_kpa));
        let full = match (trial.channel("pressure_kpa"), trial.channel("length_mm")) {
            (Some(pressure), _) => pressure[0] > 0.5 * supply_kpa,
            (None, Some(length)) => length[0] < half_mm,
            (None, None) => false,
        };
        let file =
            if trial.name.is_empty() { "commands.csv".to_string() } else { trial.name.clone() };
        Ok(Self {
            full,
            rate_hz,
            inlet,
            outlet,
            excitation: excitation_share(trial)?,
            set_length_mm: trial.channel(SET_LENGTH).map(<[f64]>::to_vec),
            shunt: shunt(trial)?,
            ..Self::new(file, TrialKind::Other, 0.0)
        })
    }

    /// Inputs other than the valve openings, as columns of a trial. A replay reads these columns.
    pub fn more_columns(&self) -> Vec<Channel> {
        let column =
            |name: &str, values: &[f64]| Channel { name: name.to_owned(), values: values.to_vec() };
        let excited = vec![self.excitation; self.inlet.len()];
        let excitation = (self.excitation != 1.0).then(|| column(EXCITATION, &excited));
        let length = self.set_length_mm.as_ref().map(|values| column(SET_LENGTH, values));
        let shunt = self.shunt.as_ref().map(|values| column(SHUNT, values));
        [excitation, length, shunt].into_iter().flatten().collect()
    }
}

/// Returns the random stream of the commands of a numbered trial of a kind. Beyond 2^39 trials these streams overlap
/// those of the noise.
fn stream(number: usize, kind: u64) -> u64 {
    Random::PROTOCOL.wrapping_add((number as u64).wrapping_mul(2)).wrapping_add(kind)
}

/// Refuses columns whose length differs from that of the time.
fn check_lengths(trial: &Trial) -> Result<(), SimError> {
    let expected = trial.len();
    match trial.channels.iter().find(|channel| channel.values.len() != expected) {
        None => Ok(()),
        Some(Channel { name, values }) => Err(SimError::column(
            name,
            &format!("it has {} values for {expected} samples", values.len()),
        )),
    }
}

/// Refuses columns that request something the rig cannot do.
fn check_columns(trial: &Trial) -> Result<(), SimError> {
    let known = [EXCITATION, SET_LENGTH, SHUNT];
    let asks = |name: &str| name.starts_with("set_") || name.ends_with("_share");
    let other = trial.channels.iter().find(|c| asks(&c.name) && !known.contains(&c.name.as_str()));
    match other {
        None => Ok(()),
        Some(other) => Err(SimError::column(
            &other.name,
            &format!(
                "the simulated rig does not know this command; except for inlet and outlet, it takes only {}",
                known.join(", ")
            ),
        )),
    }
}

/// Returns the excitation of the bridge as a share of the rig's: the column `excitation_share` of a trial, or 1.
///
/// # Errors
/// Values that differ from row to row, or are outside 0 .. 2.
pub fn excitation_share(trial: &Trial) -> Result<f64, SimError> {
    let Some(shares) = trial.channel(EXCITATION) else { return Ok(1.0) };
    let share = shares.first().copied().unwrap_or(1.0);
    match shares.iter().find(|s| **s != share || !(**s > 0.0 && **s <= 2.0)) {
        None => Ok(share),
        Some(other) => Err(SimError::column(
            EXCITATION,
            &format!(
                "it contains {other}, and {share} in the first row; it must be the same number in every row, above 0 and at most 2"
            ),
        )),
    }
}

/// Shares of a shunt, if there is one.
fn shunt(trial: &Trial) -> Result<Option<Vec<f64>>, SimError> {
    let Some(shares) = trial.channel(SHUNT) else { return Ok(None) };
    let fail = |problem: String| Err(SimError::column(SHUNT, &problem));
    if let Some(share) = shares.iter().find(|s| !(0.0..1.0).contains(*s)) {
        return fail(format!("{share} is outside 0 .. 1"));
    }
    if trial.channel(SET_LENGTH).is_none() {
        return fail(format!(
            "a shunt is simulated only at a set length; add the column {SET_LENGTH}"
        ));
    }
    Ok(Some(shares.to_vec()))
}

/// Name of a ramp's file, such as `inflation_0_25.csv` for an opening of 0.25 %.
fn ramp_file(kind: &str, opening: f64) -> String {
    let percent = (1e4 * opening).round() / 100.0;
    format!("{kind}_{}.csv", percent.to_string().replace('.', "_"))
}
