//! What a diagnosis found, as a rig file: the simulator that lacked it, fixed.

use std::f64::consts::TAU;

use stretch_data::{Remarks, RigFile};
use stretch_gap::{
    Candidate, Diagnosis, EffectValue, Evidence, Frame, Model, Run, Simulator, VerdictKind,
};
use stretch_sim::{Effect, SimError, Tolerance};

/// A rig file that holds what a diagnosis found: re-tuned parameters with tolerances as found, and the effects with every
/// parameter and form. Comments beside the entries say where each comes from.
///
/// A tolerance is one standard deviation of the fit, never more than it was. It holds if the model does: intervals of parameters
/// that stand in for one another are each told as if the other were free, and together they are narrower.
#[derive(Debug, Clone, PartialEq)]
pub struct Fix {
    /// The file.
    pub file: RigFile,
    /// The comments.
    pub remarks: Remarks,
}

impl Fix {
    /// The text of the file, comments included.
    pub fn text(&self) -> String {
        self.file.to_toml_with(&self.remarks)
    }
}

/// Why a diagnosis leaves nothing to write.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoFix {
    /// The record or the rig file is wrong: whatever was fitted to it is, too.
    #[error("the record or the rig file has to be put right first: {hint}")]
    Record {
        /// What to check.
        hint: String,
    },
    /// The catalogue does not explain the gap.
    #[error(
        "the gap is not explained, so that no rig file closes it; what is known of it stands in the diagnosis"
    )]
    Unknown,
    /// What was found is none that a rig file may hold.
    #[error("what was found is no rig that can be written: {0}")]
    Refused(#[from] SimError),
}

/// What is written of a diagnosis.
#[derive(Clone, Copy)]
pub(crate) struct Chosen<'a> {
    pub(crate) model: &'a Model,
    /// One standard deviation of every nominal parameter.
    pub(crate) sd: &'a [f64],
    diagnosis: &'a Diagnosis,
    /// The set of effects, where it has some.
    found: Option<&'a Candidate>,
}

/// Standard deviations to either side that hold 95 % of a Gaussian.
const COVERS: f64 = 1.96;
/// Least tolerance, a share of the value: a parameter without one would count as exact.
const LEAST: f64 = 1e-6;

impl<'a> Chosen<'a> {
    /// The first candidate where effects are named, the re-tuned nominal where none is missing.
    pub(crate) fn of(diagnosis: &'a Diagnosis, evidence: &'a Evidence) -> Result<Self, NoFix> {
        match diagnosis.verdict {
            VerdictKind::Record => {
                let hints = diagnosis.gross.iter().map(|g| format!("{} {}", g.sentence, g.hint));
                Err(NoFix::Record { hint: hints.take(1).collect() })
            }
            VerdictKind::Unknown => Err(NoFix::Unknown),
            VerdictKind::Effect | VerdictKind::Partial => {
                let first = diagnosis.candidates.first().zip(evidence.candidates.first());
                let (found, model) = first.ok_or(NoFix::Unknown)?;
                let sd = evidence.candidate_sds.first().map_or(&[][..], Vec::as_slice);
                Ok(Self { model, sd, diagnosis, found: Some(found) })
            }
            VerdictKind::NoGap | VerdictKind::Parameters => Ok(Self {
                model: &evidence.retuned,
                sd: &evidence.retuned_sd,
                diagnosis,
                found: None,
            }),
        }
    }

    /// Effects of the set that do something, with values that a file may hold.
    pub(crate) fn effects(
        &self,
        rows: &[&'static Effect],
        allowed: impl Fn(&Effect, &mut [f64]),
    ) -> Vec<(&'static Effect, Vec<f64>)> {
        let Some(found) = self.found else { return Vec::new() };
        let on = self.model.effects.iter().filter_map(|(index, values)| {
            let effect = rows.get(*index).copied()?;
            let is_wanted = found.effects.iter().any(|name| name == effect.name);
            (is_wanted && !effect.is_off(values)).then(|| (effect, values.clone()))
        });
        on.map(|(effect, mut values)| {
            allowed(effect, &mut values);
            (effect, values)
        })
        .collect()
    }

    /// Tolerance of a re-tuned parameter, in the way in which the old one was told.
    pub(crate) fn tolerance(&self, index: usize, value: f64, old: Tolerance) -> Tolerance {
        let found = self.sd.get(index).copied().unwrap_or(0.0);
        let sd = found.min(old.sd(value)).max(LEAST * value.abs()).max(f64::MIN_POSITIVE);
        match old {
            Tolerance::Relative(_) => Tolerance::Relative(sd / value.abs()),
            _ => Tolerance::Absolute(sd),
        }
    }

    /// What is said behind a re-tuned parameter.
    pub(crate) fn told(&self, index: usize, unit: &str, (was, value): (f64, f64)) -> String {
        let sd = self.sd.get(index).copied().unwrap_or(0.0);
        format!(
            "was {}; 95 %: {} .. {}{}",
            digits(was),
            digits(value - COVERS * sd),
            digits(value + COVERS * sd),
            of_unit(unit)
        )
    }

    /// Lines at the top of the file.
    pub(crate) fn head(&self) -> Vec<String> {
        let mut lines = vec![self.diagnosis.sentence.clone()];
        lines.push(match self.diagnosis.verdict {
            VerdictKind::NoGap => {
                "Nothing is missing: parameters are re-tuned within the noise, and no effect is added.".into()
            }
            VerdictKind::Parameters => "Parameters are re-tuned; no effect is added.".into(),
            VerdictKind::Partial => format!(
                "{:.0} % of the gap stay: this file does not close it.",
                100.0 * self.diagnosis.unexplained.as_ref().map_or(0.0, |u| u.share)
            ),
            _ => "Parameters are re-tuned with the effects in place.".to_owned(),
        });
        lines.push(
            "Tolerances are as found: one standard deviation of the fit, if the model is right."
                .into(),
        );
        lines
    }

    /// Adds what is said of an effect and its parameters.
    pub(crate) fn tell(&self, effect: &Effect, remarks: &mut Remarks) {
        let name = effect.name;
        remarks.effects.insert(name.into(), self.lines(effect));
        for p in self.numbers(effect) {
            let key = (name.to_owned(), p.name.clone());
            remarks.effect_parameters.insert(key, told_of_effect(&p));
        }
    }

    /// Parameters and forms of an effect.
    pub(crate) fn numbers(&self, effect: &Effect) -> Vec<EffectValue> {
        let all = self.found.iter().flat_map(|c| &c.parameters);
        all.filter(|p| p.effect == effect.name).cloned().collect()
    }

    fn lines(&self, effect: &Effect) -> Vec<String> {
        let d = self.diagnosis;
        let share = d.shares.iter().find(|s| s.effect == effect.name);
        let closes = share.map_or(String::new(), |s| format!(" closes {:.0} %", 100.0 * s.closes));
        let faint = match d.faint.iter().any(|name| name == effect.name) {
            true => ", faint, and kept because the parameters were fitted beside it",
            false => "",
        };
        let set = self.found.map_or(String::new(), |c| {
            let [low, high] = c.closed_ci.map(|x| 100.0 * x);
            let what = if c.effects.len() > 1 { ", the set" } else { " (95 %:" };
            let end = if c.effects.len() > 1 { "" } else { ")" };
            format!("{what} {low:.0} to {high:.0} %{end}; probability {:.2}", c.probability)
        });
        let mut lines = vec![
            effect.words.to_owned(),
            format!(
                "Found by diagnosis{faint}:{closes} of the gap on trials that were not fitted{set}."
            ),
            effect.equation.to_owned(),
        ];
        if !d.tied.is_empty() && d.named.iter().any(|name| name == effect.name) {
            lines.push(format!("These data cannot rule out {}.", d.tied.join(", ")));
        }
        lines
    }
}

/// What is said behind a parameter of an effect.
fn told_of_effect(p: &EffectValue) -> String {
    let [low, high] = p.interval.map(digits);
    let form = if p.is_form { "form; " } else { "" };
    format!("{form}95 %: {low} .. {high}{}", of_unit(&p.unit))
}

fn of_unit(unit: &str) -> String {
    if unit == "1" || unit.is_empty() { String::new() } else { format!(" {unit}") }
}

/// A number to four digits.
pub(crate) fn digits(x: f64) -> String {
    let rounded = format!("{x:.3e}").parse().unwrap_or(x);
    if rounded != 0.0 && !(1e-3..1e6).contains(&f64::abs(rounded)) {
        format!("{rounded:e}")
    } else {
        format!("{rounded}")
    }
}

/// Phase of an effect's line in what a model leaves without it in the samples that are not tested on; none of an effect that
/// leaves no line. `place` is the stage that shows it, and what an amplitude of one is there.
pub(crate) fn found_phase(
    simulator: &dyn Simulator,
    place: (usize, f64),
    rows: &[&'static Effect],
    model: &Model,
    (effect, values): (&Effect, &[f64]),
) -> Option<f64> {
    let line = effect.line?(values);
    let (stage, unit) = place;
    let is_other = |(index, _): &&(usize, Vec<f64>)| rows[*index].name != effect.name;
    let without = Model {
        effects: model.effects.iter().filter(is_other).cloned().collect(),
        ..model.clone()
    };
    let (trials, measured) = (simulator.trials(), simulator.measured(stage));
    let mut simulated = vec![0.0; measured.len()];
    let run = Run { stage, model: &without, trials: trials.len(), shake: None, step: 1.0 };
    simulator.simulate(run, &mut simulated).ok()?;
    let mut begin = 0;
    let mut left = Vec::new();
    for (trial, fit) in trials.iter().zip(Frame::not_tested(trials)) {
        let at = |i: usize| trial.start_s + i as f64 * simulator.dt_s();
        let apart = |i: usize| (measured[begin + i] - simulated[begin + i]) / unit;
        left.extend((0..fit).map(|i| (at(i), apart(i))));
        begin += trial.samples;
    }
    Some(phase(line.amplitude, line.hertz, left.into_iter()))
}

/// Phase at which a sine of a known amplitude and frequency comes nearest to what is left, in pairs of time (s) and value.
///
/// The cost a^2 (s^2 cc + 2 s c cs + c^2 ss) - 2 a (s rc + c rs), s and c of the phase, is looked for its least value on a
/// grid, then between its neighbours: on samples at twice the frequency one quadrature is never seen and the two have to be weighed.
fn phase(amplitude: f64, hertz: f64, left: impl Iterator<Item = (f64, f64)>) -> f64 {
    let mut sums = [0.0; 5];
    for (t, r) in left {
        let turns = hertz * t;
        let (sin, cos) = (TAU * (turns - turns.floor())).sin_cos();
        for (sum, x) in sums.iter_mut().zip([cos * cos, cos * sin, sin * sin, r * cos, r * sin]) {
            *sum += x;
        }
    }
    let [cc, cs, ss, rc, rs] = sums;
    let cost = |phase: f64| {
        let (s, c) = phase.sin_cos();
        let own = s * s * cc + 2.0 * s * c * cs + c * c * ss;
        amplitude * own - 2.0 * (s * rc + c * rs)
    };
    let least = |from: f64, step: f64, count: i32| {
        let points = (0..=count).map(|k| from + step * f64::from(k));
        points.min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap_or(from)
    };
    let mut step = TAU / 360.0;
    let mut best = least(0.0, step, 359);
    for _ in 0..3 {
        best = least(best - step, step / 20.0, 40);
        step /= 20.0;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn the_phase_of_a_sine_is_found_where_a_quadrature_is_never_seen_too() {
        for (hertz, wanted) in [(60.0, 1.0), (50.0, 0.7)] {
            let wave = |i: u32| {
                let t = 0.01 * f64::from(i);
                (t, 0.02 * (TAU * hertz * t + wanted).sin())
            };
            let found = phase(0.02, hertz, (0..500).map(wave));
            // At twice the frequency pi - phase looks the same.
            let apart = (found - wanted).abs().min((std::f64::consts::PI - found - wanted).abs());
            assert_abs_diff_eq!(apart, 0.0, epsilon = 1e-4);
        }
    }

    #[test]
    fn numbers_have_four_digits() {
        assert_eq!([0.0, 0.123456, 1e-9, 12345.678].map(digits), ["0", "0.1235", "1e-9", "12350"]);
    }
}
