//! Calibrates each session in several ways, and computes the errors after the seconds of reference.

use stretch_calibrate::{Options, apply, calibrate, choose_model, rank_signals};
use stretch_core::Calibration;
use stretch_data::Trial;
use stretch_sleeve::{
    GaugeCalibration, Prior, Session, SleeveCalibration, SleeveError, SleeveOptions, apply_array,
    calibrate_array,
};

use crate::data::{Set, Worn};

pub(crate) const OWN_ONE: &str = "own calibration, one";
pub(crate) const OWN_ALL: &str = "own calibration, all";

/// Errors of one session.
pub(crate) struct Row {
    pub(crate) errors: Vec<(String, f64)>,
    /// Share of samples within the 95 % interval.
    pub(crate) inside: Vec<(String, f64)>,
}

impl Row {
    pub(crate) fn error(&self, name: &str) -> Option<f64> {
        self.errors.iter().find(|(own, _)| own == name).map(|(_, error)| *error)
    }
}

pub(crate) struct Judge {
    pub(crate) set: Set,
    sessions: Vec<Session>,
    /// Duration at the beginning of a session whose reference may be used, s.
    pub(crate) used_s: f64,
    asked: Asked,
}

/// Options for additional evaluations.
#[derive(Clone, Copy, Default)]
pub(crate) struct Asked {
    /// Also judge the model that `auto` chooses.
    pub(crate) auto: bool,
    /// Judge each sensor with a prior from all other sensors, instead of the best sensor with a prior from the same
    /// sensor.
    pub(crate) leave_sensor: bool,
}

/// Priors that are learnt without the sessions of one wearer: one prior for all channels together (unless there is only
/// one channel, or a channel is left out), and one for each channel alone.
pub(crate) struct Priors {
    pub(crate) all: Option<Prior>,
    each: Vec<Prior>,
}

/// Makes a prior from the sessions. Sessions that are refused, for example because a signal falls that rises in other
/// sessions, are left out.
fn of_accepted(
    mut sessions: Vec<Session>,
    make: impl Fn(&[Session]) -> Result<Prior, SleeveError>,
) -> anyhow::Result<Prior> {
    loop {
        match make(&sessions) {
            Err(SleeveError::Prior { file, .. }) if sessions.iter().any(|s| s.name == file) => {
                sessions.retain(|s| s.name != file);
            }
            done => return Ok(done?),
        }
    }
}

impl Judge {
    /// Creates the judge, and computes the sums of each session for the priors. Refused sessions are printed and left
    /// out.
    pub(crate) fn new(mut set: Set, used_s: f64, asked: Asked) -> Self {
        let mut sessions = Vec::new();
        let (signals, reference) = (set.signals.clone(), set.reference.clone());
        set.worn.retain(|worn| {
            let path = format!("{}/{}", worn.wearer, worn.activity);
            let options = SleeveOptions::new(signals.clone(), &reference).of(&path);
            match Session::new(&worn.name, &worn.trials, &options) {
                Ok((session, _)) => sessions.push(session),
                Err(refusal) => {
                    println!("left out: {}: {refusal}", worn.name);
                    return false;
                }
            }
            true
        });
        Self { set, sessions, used_s, asked }
    }

    /// Returns the wearers in alphabetical order.
    pub(crate) fn wearers(&self) -> Vec<String> {
        let mut wearers: Vec<String> = self.set.worn.iter().map(|w| w.wearer.clone()).collect();
        wearers.sort();
        wearers.dedup();
        wearers
    }

    pub(crate) fn without(&self, wearer: &str) -> anyhow::Result<Priors> {
        let kept: Vec<Session> =
            self.sessions.iter().filter(|s| s.path[0] != wearer).cloned().collect();
        let channels = 0..self.set.signals.len();
        let each = channels
            .map(|k| of_accepted(self.alone(&kept, k)?, Prior::learn))
            .collect::<Result<Vec<_>, _>>()?;
        let is_many = each.len() > 1 && !self.asked.leave_sensor;
        Ok(Priors {
            all: if is_many { Some(of_accepted(kept, Prior::learn)?) } else { None },
            each,
        })
    }

    /// Returns the sessions from which a prior for one channel is learnt: those of the channel itself, or those of all
    /// other channels.
    fn alone(&self, sessions: &[Session], channel: usize) -> anyhow::Result<Vec<Session>> {
        let channels =
            (0..self.set.signals.len()).filter(|k| (*k == channel) != self.asked.leave_sensor);
        let channels: Vec<usize> = channels.collect();
        let one = |session: &Session, k: usize| -> anyhow::Result<Session> {
            let name = format!("{} {}", session.name, session.signals[k]);
            let mut own = session.of_channels(&[k])?;
            own.name = name;
            Ok(own)
        };
        sessions.iter().flat_map(|s| channels.iter().map(move |&k| one(s, k))).collect()
    }

    pub(crate) fn rows(&self, every: usize) -> anyhow::Result<Vec<Row>> {
        let mut rows = Vec::new();
        for wearer in self.wearers() {
            let worn = self.set.worn.iter().enumerate().step_by(every);
            let mut worn = worn.filter(|(_, worn)| worn.wearer == wearer).peekable();
            if worn.peek().is_none() {
                continue;
            }
            let priors = self.without(&wearer)?;
            for (index, worn) in worn {
                let places: Vec<Option<usize>> = match self.asked.leave_sensor {
                    true => (0..self.set.signals.len()).map(Some).collect(),
                    false => vec![None],
                };
                for place in places {
                    match self.row(index, worn, &priors, place) {
                        Ok(row) => {
                            eprintln!("{}: {:?}", worn.name, row.errors);
                            rows.push(row);
                        }
                        Err(refusal) => println!("not judged: {}: {refusal}", worn.name),
                    }
                }
            }
        }
        Ok(rows)
    }

    /// Computes the errors of one session, for the gauge at `place` or for the gauge that is best in the first seconds.
    fn row(
        &self,
        index: usize,
        worn: &Worn,
        priors: &Priors,
        place: Option<usize>,
    ) -> anyhow::Result<Row> {
        let mut errors = Vec::new();
        let half = self.used_s.min(30.0);
        let short = first_seconds(&worn.trials, half);
        let base = Options {
            signal: self.set.signals[0].clone(),
            reference: self.set.reference.clone(),
            ..Options::default()
        };
        let place = match place {
            Some(place) => place,
            None => {
                let ranking = rank_signals(&short, &self.set.signals, &base)?;
                let best = |signal: &String| *signal == ranking[0].signal;
                self.set.signals.iter().position(best).unwrap_or(0)
            }
        };
        let options = Options { signal: self.set.signals[place].clone(), ..base };
        let mut classic = |name: &str, options: &Options| {
            let error = calibrate(&short, options).map(|c| c.calibration);
            let one = |c: Calibration| {
                let gauge = GaugeCalibration::new(c, None).ok()?;
                self.error(&SleeveCalibration::One(Box::new(gauge)), worn).ok()
            };
            let error = error.ok().and_then(one);
            errors.push((format!("{name}, {half} s"), error.unwrap_or(f64::NAN)));
        };
        let model = |name: &str| {
            Ok::<_, anyhow::Error>(Options { model: name.parse()?, ..options.clone() })
        };
        classic("linear", &model("linear")?);
        classic("poly13", &model("poly13")?);
        if self.asked.auto {
            let choice = choose_model(&short, &options)?;
            classic("auto", &Options { model: choice.model, ..options.clone() });
        }
        let mut inside = Vec::new();
        let others: Vec<Session> = self
            .sessions
            .iter()
            .enumerate()
            .filter(|(i, _)| *i != index)
            .map(|(_, s)| s.clone())
            .collect();
        let has_others = others.iter().any(|s| s.path[0] == worn.wearer);
        for (what, prior) in [("one", Some(&priors.each[place])), ("all", priors.all.as_ref())] {
            let Some(prior) = prior else { continue };
            let own = if what == "one" { self.alone(&others, place)? } else { others.clone() };
            let knowing = match has_others {
                true => Some(of_accepted(own, |own| prior.knowing(own))?),
                false => None,
            };
            let told = SleeveOptions::default().of(&format!("{}/{}", worn.wearer, worn.activity));
            let cases = [
                ("new wearer", Some(prior), SleeveOptions::default()),
                ("next session", knowing.as_ref(), told),
            ];
            for (who, prior, options) in cases {
                let Some(prior) = prior else { continue };
                // A prior from other sensors has other column names.
                let signals = if what == "one" {
                    vec![self.set.signals[place].clone()]
                } else {
                    self.set.signals.clone()
                };
                let options = SleeveOptions { signals, ..options };
                let seconds = first_seconds(&worn.trials, 60.0);
                let error = match prior.renew(&seconds, &options, None) {
                    Ok(renewed) => self.error(&renewed.calibration, worn)?,
                    Err(refusal) => {
                        eprintln!("{}: {refusal}", worn.name);
                        f64::NAN
                    }
                };
                errors.push((format!("prior, {what}, {who}, 60 s without reference"), error));
                for seconds in [0.0, 10.0, 30.0, 60.0] {
                    if seconds > self.used_s {
                        continue;
                    }
                    let trials = if seconds > 0.0 {
                        first_seconds(&worn.trials, seconds)
                    } else {
                        Vec::new()
                    };
                    let updated = prior.update(&trials, &options);
                    let error = match &updated {
                        Ok(updated) => self.error(&updated.calibration, worn)?,
                        Err(refusal) => {
                            eprintln!("{}: {refusal}", worn.name);
                            f64::NAN
                        }
                    };
                    if let Ok(updated) = &updated
                        && let Some(half_width) = updated.summary.half_width_95
                    {
                        let share = self.inside(&updated.calibration, worn, half_width)?;
                        inside.push((format!("prior, {what}, {who}, {seconds} s"), share));
                    }
                    errors.push((format!("prior, {what}, {who}, {seconds} s"), error));
                }
            }
        }
        let own = SleeveOptions {
            signals: self.set.signals.clone(),
            reference: self.set.reference.clone(),
            ..SleeveOptions::default()
        };
        let fit = calibrate_array(&worn.trials, &own)?;
        errors
            .push((OWN_ONE.to_owned(), fit.summary.carried[place].rmse_alone.unwrap_or(f64::NAN)));
        let best =
            fit.summary.carried.iter().filter_map(|c| c.rmse_alone).fold(f64::INFINITY, f64::min);
        errors.push(("own calibration, best one".to_owned(), best));
        errors.push((OWN_ALL.to_owned(), fit.summary.rmse));
        Ok(Row { errors, inside })
    }

    /// Returns the errors after the first `used_s` seconds, one for each sample that has an estimate.
    fn differences(
        &self,
        calibration: &SleeveCalibration,
        worn: &Worn,
    ) -> anyhow::Result<Vec<f64>> {
        let mut found = Vec::new();
        let mut before_s = 0.0;
        for trial in &worn.trials {
            let reference = trial.require(&self.set.reference)?;
            let estimates: Vec<Option<f64>> = match calibration {
                SleeveCalibration::One(gauge) => apply(gauge.calibration(), trial)?
                    .readings
                    .iter()
                    .map(|r| r.ok().map(|r| r.estimate))
                    .collect(),
                SleeveCalibration::Many(calibration) => apply_array(calibration, trial)?
                    .readings
                    .iter()
                    .map(|r| r.ok().map(|r| r.estimate))
                    .collect(),
            };
            for (i, (estimate, truth)) in estimates.iter().zip(reference).enumerate() {
                if let Some(estimate) = estimate
                    && before_s + trial.time_s[i] >= self.used_s
                {
                    found.push(estimate - truth);
                }
            }
            before_s += trial.duration_s();
        }
        Ok(found)
    }

    pub(crate) fn error(
        &self,
        calibration: &SleeveCalibration,
        worn: &Worn,
    ) -> anyhow::Result<f64> {
        let found = self.differences(calibration, worn)?;
        Ok((found.iter().map(|e| e * e).sum::<f64>() / found.len() as f64).sqrt())
    }

    fn inside(
        &self,
        calibration: &SleeveCalibration,
        worn: &Worn,
        half_width: f64,
    ) -> anyhow::Result<f64> {
        let found = self.differences(calibration, worn)?;
        Ok(found.iter().filter(|e| e.abs() <= half_width).count() as f64 / found.len() as f64)
    }
}

/// Returns the first seconds of consecutive trials.
pub(crate) fn first_seconds(trials: &[Trial], seconds: f64) -> Vec<Trial> {
    let mut left_s = seconds;
    let mut cut = Vec::new();
    for trial in trials {
        let kept = trial.time_s.iter().take_while(|t| **t - trial.time_s[0] < left_s).count();
        left_s -= trial.duration_s();
        if kept < 50 {
            break;
        }
        let mut own = trial.clone();
        own.time_s.truncate(kept);
        own.channels.iter_mut().for_each(|c| c.values.truncate(kept));
        cut.push(own);
    }
    cut
}
