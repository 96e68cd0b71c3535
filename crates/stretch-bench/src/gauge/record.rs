//! The measured trials of a gauge alone: two columns, evenly sampled, and what was noticed of them.

use std::ops::Range;

use stretch_data::{Trial, unit};
use stretch_gap::{TrialSpec, noise_variance};

use crate::error::BenchError;

/// Least samples that may be fitted.
const LEAST: usize = 300;
/// Least samples of a stretch between two gaps in time.
const SHORTEST: usize = 100;
/// A step of more than so many samples is a gap: what lies behind it is a trial of its own.
const GAP: f64 = 4.5;
/// A sample that comes so many samples too early or too late is uneven.
const UNEVEN: f64 = 0.6;
/// Pause assumed between trials that do not say when they began, s.
const PAUSE_S: f64 = 15.0;
/// Column of the pressure.
const PRESSURE: &str = "pressure_kpa";

/// A measured trial of a gauge alone.
#[derive(Debug, Clone, PartialEq)]
pub struct GaugeTrial {
    /// Its columns.
    pub trial: Trial,
    /// When it began, s since the gauge was first stretched.
    pub start_s: f64,
    /// Whether it is tested on and never fitted.
    pub is_test: bool,
}

/// All trials end to end.
#[derive(Debug)]
pub(super) struct Record {
    pub(super) trials: Vec<TrialSpec>,
    pub(super) reference: Vec<f64>,
    pub(super) signal: Vec<f64>,
    /// Empty unless every trial has one.
    pub(super) pressure: Vec<f64>,
    pub(super) dt_s: f64,
    pub(super) notes: Vec<String>,
}

impl Record {
    /// # Errors
    /// Columns that are missing, dead or hold what is no number, rates that differ, too little to fit.
    pub(super) fn read(
        trials: &[GaugeTrial],
        reference: &str,
        signal: &str,
    ) -> Result<Self, BenchError> {
        let rates = || trials.iter().filter_map(|t| Some((&t.trial.name, t.trial.rate_hz()?)));
        let dt_s = rates().next().map_or(0.01, |(_, rate)| 1.0 / rate);
        if let Some((name, rate)) = rates().find(|(_, rate)| (rate * dt_s - 1.0).abs() > 0.02) {
            return Err(BenchError::Implausible {
                column: format!("time_s of {name}"),
                found: format!("{rate:.2} samples a second where {:.2} are usual", 1.0 / dt_s),
                hint: "all trials need the same sample rate: convert them first".into(),
            });
        }
        let has_pressure = trials.iter().all(|t| t.trial.channel(PRESSURE).is_some());
        let mut record = Self {
            trials: Vec::new(),
            reference: Vec::new(),
            signal: Vec::new(),
            pressure: Vec::new(),
            dt_s,
            notes: Vec::new(),
        };
        for (i, start_s) in record.order(trials) {
            let one = &trials[i];
            let columns = [Some(reference), Some(signal), has_pressure.then_some(PRESSURE)];
            record.add(one, start_s, columns)?;
        }
        record.check(reference, signal)?;
        Ok(record)
    }

    /// Trials in order of time, and when each began.
    fn order(&mut self, trials: &[GaugeTrial]) -> Vec<(usize, f64)> {
        let mut order: Vec<usize> = (0..trials.len()).collect();
        order.sort_by(|a, b| trials[*a].start_s.total_cmp(&trials[*b].start_s));
        let start = |i: &usize| trials[*i].start_s;
        if order.windows(2).all(|pair| start(&pair[1]) > start(&pair[0])) {
            return order.into_iter().map(|i| (i, trials[i].start_s)).collect();
        }
        self.notes.push(
            "the trials give no rising start_s: pauses of 15 s in the order of the file are assumed"
                .into(),
        );
        let mut at = 0.0;
        let mut begin = |trial: &GaugeTrial| {
            let begun = at;
            at += trial.trial.duration_s() + PAUSE_S;
            begun
        };
        trials.iter().enumerate().map(|(i, t)| (i, begin(t))).collect()
    }

    fn add(
        &mut self,
        one: &GaugeTrial,
        start_s: f64,
        columns: [Option<&str>; 3],
    ) -> Result<(), BenchError> {
        let trial = &one.trial;
        let mut found = [&[][..]; 3];
        for (values, name) in found.iter_mut().zip(columns) {
            let Some(name) = name else { continue };
            *values = trial.require(name)?;
            if let Some(row) = values.iter().position(|x| !x.is_finite()) {
                return Err(BenchError::Implausible {
                    column: format!("{name} of {}", trial.name),
                    found: format!("{} in sample {}", values[row], row + 1),
                    hint: "give numbers only, or cut the trial there".into(),
                });
            }
        }
        let stretches = self.stretches(trial);
        let several = stretches.len() > 1;
        for (part, stretch) in stretches.into_iter().enumerate() {
            let picked = self.picked(trial, &stretch);
            let begin_s = trial.time_s[stretch.start] - trial.time_s[0];
            self.trials.push(TrialSpec {
                name: match several {
                    true => format!("{} (part {})", trial.name, part + 1),
                    false => trial.name.clone(),
                },
                samples: picked.len(),
                start_s: start_s + begin_s,
                is_test: one.is_test,
            });
            let own = [&mut self.reference, &mut self.signal, &mut self.pressure];
            for (all, values) in own.into_iter().zip(found) {
                if !values.is_empty() {
                    all.extend(picked.iter().map(|&i| values[i]));
                }
            }
        }
        Ok(())
    }

    /// Stretches of a trial between gaps in time.
    fn stretches(&mut self, trial: &Trial) -> Vec<Range<usize>> {
        let mut out = Vec::new();
        let mut from = 0;
        for i in 1..=trial.len() {
            let step = trial.time_s.get(i).map(|t| t - trial.time_s[i - 1]);
            if step.is_some_and(|step| step <= GAP * self.dt_s) {
                continue;
            }
            let (name, long) = (&trial.name, i - from >= SHORTEST);
            if let Some(step) = step {
                let at = trial.time_s[i - 1];
                let lost = step - self.dt_s;
                self.notes.push(format!(
                    "{name}: {lost:.3} s are missing after {at:.2} s; it goes on as a trial of its own"
                ));
            }
            match long {
                true => out.push(from..i),
                false => self.notes.push(format!(
                    "{name}: the {} samples from {:.2} s on are too few and left out",
                    i - from,
                    trial.time_s[from]
                )),
            }
            from = i;
        }
        out
    }

    /// Samples of a stretch at even times: those that are there, or the nearest to each.
    fn picked(&mut self, trial: &Trial, stretch: &Range<usize>) -> Vec<usize> {
        let time_s = &trial.time_s[stretch.clone()];
        let apart = |i: usize, k: usize| (time_s[i] - time_s[0]) / self.dt_s - k as f64;
        if (0..time_s.len()).all(|i| apart(i, i).abs() < UNEVEN) {
            return stretch.clone().collect();
        }
        let count = ((time_s[time_s.len() - 1] - time_s[0]) / self.dt_s).round() as usize + 1;
        let mut at = 0;
        let picked = (0..count)
            .map(|k| {
                while at + 1 < time_s.len() && apart(at + 1, k).abs() <= apart(at, k).abs() {
                    at += 1;
                }
                stretch.start + at
            })
            .collect();
        let note = format!(
            "{}: its samples come unevenly; the nearest to every {:.4} s is taken",
            trial.name, self.dt_s
        );
        if self.notes.last() != Some(&note) {
            self.notes.push(note);
        }
        picked
    }

    /// Samples that may be looked at before the end.
    pub(super) fn fitted(&self) -> impl Iterator<Item = Range<usize>> {
        let mut begin = 0;
        self.trials.iter().filter_map(move |t| {
            let own = begin..begin + t.samples;
            begin = own.end;
            (!t.is_test).then_some(own)
        })
    }

    /// Least and greatest of a column over the trials that are fitted.
    pub(super) fn range(&self, values: &[f64]) -> (f64, f64) {
        self.fitted()
            .flat_map(|r| &values[r])
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)))
    }

    /// Noise of a column (1 sd) from the median of its second differences in the trials that are fitted.
    pub(super) fn noise(&self, values: &[f64]) -> f64 {
        noise_variance(self.fitted().map(|r| &values[r]), self.dt_s).sqrt()
    }

    fn check(&mut self, reference: &str, signal: &str) -> Result<(), BenchError> {
        let samples: usize = self.fitted().map(|r| r.len()).sum();
        if samples < LEAST {
            return Err(BenchError::TooLittle {
                what: format!("the trials to fit have {samples} samples"),
                hint: format!("at least {LEAST} are needed to tell anything"),
            });
        }
        if reference == "bridge_v" || signal == "length_mm" {
            return Err(BenchError::Implausible {
                column: format!("--reference {reference}, --signal {signal}"),
                found: "the two look swapped".into(),
                hint: "the reference is the length, the signal what the gauge says".into(),
            });
        }
        let mut shares = Vec::new();
        for (name, values) in [(reference, &self.reference), (signal, &self.signal)] {
            let (low, high) = self.range(values);
            if high <= low {
                return Err(BenchError::Implausible {
                    column: name.into(),
                    found: format!("{low} in every sample"),
                    hint: "the channel is dead: check the sensor and its cable".into(),
                });
            }
            shares.push(self.noise(values) / (high - low));
        }
        let mut notes = Vec::new();
        if shares[0] > 3.0 * shares[1] {
            notes.push(format!(
                "{reference} is noisier than {signal}, each held against its own range: are reference and signal swapped?"
            ));
        }
        for (name, values) in [(reference, &self.reference), (signal, &self.signal)] {
            let (low, high) = self.range(values);
            if unit(name) == Some("mm") && high.abs().max(low.abs()) < 1.0 {
                notes.push(format!(
                    "{name} goes from {low} to {high}: this looks like metres; the verdict does not depend on it"
                ));
            }
            for (end, which) in [(low, "least"), (high, "greatest")] {
                let share = self.standing(values, end);
                if share > 0.01 {
                    notes.push(format!(
                        "{name} stands at its {which} value, {end}, in {:.1} % of the samples: if that is an end of its converter, what happened there is lost",
                        100.0 * share
                    ));
                }
            }
        }
        self.notes.append(&mut notes);
        Ok(())
    }

    /// Share of the samples at a value, in rows of at least five.
    fn standing(&self, values: &[f64], end: f64) -> f64 {
        let (mut count, mut all) = (0, 0);
        for range in self.fitted() {
            all += range.len();
            let rows = values[range].chunk_by(|a, b| (*a == end) == (*b == end));
            count += rows.filter(|r| r[0] == end && r.len() >= 5).map(<[f64]>::len).sum::<usize>();
        }
        count as f64 / all.max(1) as f64
    }
}
