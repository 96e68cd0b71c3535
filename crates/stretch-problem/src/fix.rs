//! The fix of a simulator: a file that contains the findings of a diagnosis.

use std::{f64::consts::TAU, path::Path};

use stretch_data::{Remarks, RigFile, after_number, in_digits};
use stretch_effects::EffectParameter;
use stretch_gap::{
    Candidate, Diagnosis, EffectSpec, EffectValue, Evidence, Model, Spread, VerdictKind,
};
use stretch_sim::{SimError, Tolerance};

use crate::black_box::ProblemSpec;

/// A rig file or a problem's file that holds the findings of a diagnosis: re-tuned parameters with
/// tolerances from the fit, and the effects with every parameter and form. Comments at the entries
/// say where each entry comes from.
///
/// A tolerance is one standard deviation of the fit, and never wider than the tolerance before the fix. It is valid
/// only if the model with the named effects is right. If two parameters can replace one another, the interval of each
/// is computed with the other one free; the two together are known more exactly than the two intervals suggest.
#[derive(Debug, Clone, PartialEq)]
pub struct Fix {
    /// The file.
    pub file: Fixed,
    /// Names of the effects that were added.
    pub effects: Vec<String>,
    /// The comments.
    pub remarks: Remarks,
}

/// The file that a fix is written as.
#[derive(Debug, Clone, PartialEq)]
pub enum Fixed {
    /// The built-in rig, or a gauge alone.
    Rig(RigFile),
    /// The problem's file of a user's own simulator, with re-tuned parameters, and with the effects around the
    /// simulator under `[[wrapped]]`.
    Problem(Box<ProblemSpec>),
}

impl Fix {
    /// The text of the file as it is written at `path`, comments included.
    pub fn text(&self, path: &Path) -> String {
        match &self.file {
            Fixed::Rig(rig) => rig.to_toml_with(&self.remarks),
            Fixed::Problem(problem) => problem.to_toml_with(path, &self.remarks),
        }
    }
}

/// Reasons why a diagnosis gives no file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoFix {
    /// The recording or the rig file is wrong, and so is whatever was fitted to the recording.
    #[error("the recording or the rig file has to be corrected first: {hint}")]
    Record {
        /// What to check.
        hint: String,
    },
    /// The catalogue does not explain the gap.
    #[error(
        "the gap is not explained, so no file can close it; read the diagnosis for what is known about it"
    )]
    Unknown,
    /// A rig file cannot express the effects or values that were found.
    #[error("what was found cannot be written as a rig file: {0}")]
    Refused(#[from] SimError),
}

/// The part of a diagnosis that a fix writes.
#[derive(Clone, Copy)]
pub(crate) struct Chosen<'a> {
    pub(crate) model: &'a Model,
    /// How precisely the parameters are known.
    pub(crate) spread: &'a Spread,
    diagnosis: &'a Diagnosis,
    /// The candidate whose effects are written; `None` if the diagnosis names no effects.
    pub(crate) found: Option<&'a Candidate>,
}

/// Standard deviations to either side that hold 95 % of a Gaussian.
pub(crate) const COVERS: f64 = 1.96;
/// Smallest tolerance as a share of the value, because a parameter without a tolerance would count as
/// exact.
const LEAST: f64 = 1e-6;

impl<'a> Chosen<'a> {
    /// Selects the first candidate if effects are named, or the re-tuned nominal model if no effect
    /// is missing.
    pub(crate) fn of(diagnosis: &'a Diagnosis, evidence: &'a Evidence) -> Result<Self, NoFix> {
        match diagnosis.verdict() {
            VerdictKind::Record => {
                let hints =
                    diagnosis.answer.gross().iter().map(|g| format!("{} {}", g.sentence, g.hint));
                Err(NoFix::Record { hint: hints.take(1).collect() })
            }
            VerdictKind::Unknown => Err(NoFix::Unknown),
            VerdictKind::Effect | VerdictKind::Partial => {
                let first = diagnosis.candidates.first().zip(evidence.candidates.first());
                let (found, model) = first.ok_or(NoFix::Unknown)?;
                let spread = evidence.candidate_spreads.first().ok_or(NoFix::Unknown)?;
                Ok(Self { model, spread, diagnosis, found: Some(found) })
            }
            VerdictKind::NoGap | VerdictKind::Parameters => Ok(Self {
                model: &evidence.retuned,
                spread: &evidence.retuned_spread,
                diagnosis,
                found: None,
            }),
        }
    }

    /// Effects of the candidate that are not at their off values: index in a simulator's catalogue, and values.
    pub(crate) fn effects(
        &self,
        catalogue: &'a [EffectSpec],
    ) -> impl Iterator<Item = (usize, &'a [f64])> {
        let wanted = self.found.map_or(&[][..], |found| &found.effects);
        self.model.effects.iter().filter_map(move |(index, values)| {
            let spec = catalogue.get(*index)?;
            let is_off = EffectParameter::are_off(&spec.parameters, values);
            (wanted.contains(&spec.name) && !is_off).then_some((*index, values.as_slice()))
        })
    }

    /// Effects that the diagnosis names, in the order of the diagnosis.
    pub(crate) fn named(&self, catalogue: &'a [EffectSpec]) -> Vec<(usize, &'a [f64])> {
        let place = |index: usize| {
            self.diagnosis.named().iter().position(|name| *name == catalogue[index].name)
        };
        let named = self.effects(catalogue).filter(|(index, _)| place(*index).is_some());
        let mut named: Vec<_> = named.collect();
        named.sort_by_key(|(index, _)| place(*index));
        named
    }

    /// Tolerance of a re-tuned parameter, relative if the old tolerance was relative.
    pub(crate) fn tolerance(&self, index: usize, value: f64, old: Tolerance) -> Tolerance {
        let sd = self
            .spread
            .of_parameter(index)
            .min(old.sd(value))
            .max(LEAST * value.abs())
            .max(f64::MIN_POSITIVE);
        match old {
            Tolerance::Relative(_) => Tolerance::Relative(sd / value.abs()),
            _ => Tolerance::Absolute(sd),
        }
    }

    /// The comment behind a re-tuned parameter.
    pub(crate) fn remark(&self, index: usize, unit: &str, (was, value): (f64, f64)) -> String {
        let sd = self.spread.of_parameter(index);
        format!(
            "was {}; 95 %: {} .. {}{}",
            in_digits(was, 4),
            in_digits(value - COVERS * sd, 4),
            in_digits(value + COVERS * sd, 4),
            after_number(unit)
        )
    }

    /// Lines at the top of the file.
    pub(crate) fn head(&self) -> Vec<String> {
        let tolerances =
            "Each tolerance is one standard deviation of the fit, if the model is right.";
        vec![self.diagnosis.sentence.clone(), self.diagnosis.fix_in_words(), tolerances.into()]
    }

    /// Adds the comments on an effect, which is described `in_words` and by its equation, and on its parameters.
    pub(crate) fn describe(&self, name: &str, in_words: [&str; 2], remarks: &mut Remarks) {
        remarks.effects.insert(name.into(), self.lines(name, in_words));
        for p in self.numbers(name) {
            let key = (name.to_owned(), p.name.clone());
            remarks.parameters.insert(key, effect_remark(&p));
        }
    }

    /// Parameters and forms of an effect.
    pub(crate) fn numbers(&self, effect: &str) -> Vec<EffectValue> {
        let all = self.found.iter().flat_map(|c| &c.parameters);
        all.filter(|p| p.effect == effect).cloned().collect()
    }

    fn lines(&self, effect: &str, [words, equation]: [&str; 2]) -> Vec<String> {
        let d = self.diagnosis;
        let share = d.shares.iter().find(|s| s.effect == effect);
        let closes = share.map_or(String::new(), |s| format!(" closes {:.0} %", 100.0 * s.closes));
        let faint = match d.answer.faint().iter().any(|name| name == effect) {
            true => ", faint, and kept because the parameters were fitted together with it",
            false => "",
        };
        let set = self.found.map_or(String::new(), |c| {
            let [low, high] = c.closed_ci.map(|x| 100.0 * x);
            let what = if c.effects.len() > 1 { ", the set" } else { " (95 %:" };
            let end = if c.effects.len() > 1 { "" } else { ")" };
            format!("{what} {low:.0} to {high:.0} %{end}; probability {:.2}", c.probability)
        });
        let mut lines = vec![
            words.to_owned(),
            format!(
                "Found by diagnosis{faint}:{closes} of the gap on trials that were not fitted{set}."
            ),
            equation.to_owned(),
        ];
        if !d.answer.tied().is_empty() && d.named().iter().any(|name| name == effect) {
            lines.push(format!("These data cannot rule out {}.", d.answer.tied().join(", ")));
        }
        lines
    }
}

/// Names of the effects of a rig file.
pub(crate) fn names(file: &RigFile) -> Vec<String> {
    file.effects.iter().map(|effect| effect.name.clone()).collect()
}

/// The comment behind a parameter of an effect.
fn effect_remark(p: &EffectValue) -> String {
    let [low, high] = p.interval.map(|x| in_digits(x, 4));
    let form = if p.is_form { "form; " } else { "" };
    format!("{form}95 %: {low} .. {high}{}", after_number(&p.unit))
}

/// Time over which the phase of the mains is assumed constant, s.
const STEADY_S: f64 = 1.0;

/// Amplitude and phase of a sine that is fitted to pairs of time (s) and value. One sine is fitted to all samples, and
/// one to each second. If the sine of all samples has at least half of the mean power of the sines of the seconds, its
/// amplitude and phase are returned. Otherwise the amplitude is the root of that mean power, and the phase is that of
/// the sine of all samples.
///
/// If the sample rate is twice the frequency, one quadrature cannot be observed and counts as zero.
pub(crate) fn sine(hertz: f64, left: &[(f64, f64)]) -> [f64; 2] {
    let of = |part: &[(f64, f64)]| -> [f64; 2] {
        let mut sums = [0.0; 5];
        for (t, r) in part {
            let turns = hertz * t;
            let (sin, cos) = (TAU * (turns - turns.floor())).sin_cos();
            let products = [cos * cos, cos * sin, sin * sin, r * cos, r * sin];
            sums.iter_mut().zip(products).for_each(|(sum, x)| *sum += x);
        }
        let [cc, cs, ss, rc, rs] = sums;
        // A quadrature that cannot be observed has no power, which would make the matrix singular:
        // a millionth of the total power is added.
        let ridge = 1e-6 * (cc + ss) + f64::MIN_POSITIVE;
        let (cc, ss) = (cc + ridge, ss + ridge);
        let determinant = cc * ss - cs * cs;
        [(rc * ss - rs * cs) / determinant, (rs * cc - rc * cs) / determinant]
    };
    let power = |[p, q]: [f64; 2]| p * p + q * q;
    let whole = of(left);
    let seconds: Vec<f64> = left
        .chunk_by(|a, b| (a.0 / STEADY_S).floor() == (b.0 / STEADY_S).floor())
        .map(|part| power(of(part)))
        .collect();
    let mean = seconds.iter().sum::<f64>() / seconds.len().max(1) as f64;
    let amplitude = if power(whole) >= 0.5 * mean { power(whole) } else { mean }.sqrt();
    [amplitude, whole[0].atan2(whole[1])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn a_sine_is_found_with_a_steady_or_a_drifting_phase() {
        let wave = |hertz: f64, phase: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
            let at = |i: u32| 0.01 * f64::from(i);
            (0..1000).map(at).map(|t| (t, 0.02 * (TAU * hertz * t + phase(t)).sin())).collect()
        };
        let [a, phase] = sine(60.0, &wave(60.0, &|_| 1.0));
        assert_abs_diff_eq!(a, 0.02, epsilon = 1e-6);
        assert_abs_diff_eq!(phase, 1.0, epsilon = 1e-4);
        // At a sample rate of twice the frequency, only the sine of the phase can be observed.
        let [a, phase] = sine(50.0, &wave(50.0, &|_| 0.7));
        assert_abs_diff_eq!(a * phase.sin(), 0.02 * 0.7_f64.sin(), epsilon = 1e-6);
        let [a, _] = sine(60.0, &wave(60.0, &|t| 2.0 * t));
        assert!(a > 0.015, "{a}");
    }
}
