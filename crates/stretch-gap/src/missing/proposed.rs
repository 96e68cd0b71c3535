//! The report of a sum of terms outside the catalogue.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stretch_data::in_digits;

use crate::missing::{
    course::Course,
    term::{Factor, Passage, RateForm, Term},
    term_inputs::TermInputs,
};

/// A signal of a proposal and its scale: x = (signal - offset)/scale, v = (dx/dt)/`rate_per_s`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SignalScale {
    /// Name of the column. For the stage's own channel, the signal is the simulator's output before
    /// the terms are added.
    pub name: String,
    /// Unit of offset and scale.
    pub unit: String,
    /// Value at x = 0.
    pub offset: f64,
    /// Change for which x changes by 1.
    pub scale: f64,
    /// dx/dt at v = 1, 1/s.
    pub rate_per_s: f64,
    /// Whether the signal is a command. A leak of a term is proportional to the sum of the
    /// commands.
    pub is_command: bool,
}

/// One term with its coefficient.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ProposedTerm {
    /// The term as it is written in the equation, dimensionless.
    pub name: String,
    /// Coefficient.
    pub coefficient: f64,
    /// One standard deviation of the coefficient.
    pub sd: f64,
    /// Unit of the coefficient: that of the channel.
    pub unit: String,
    /// The term as it can be computed.
    pub form: Term,
}

/// A sum of terms that the simulator and the catalogue lack, or a report that none was found.
///
/// The sum can be computed from these fields alone: `channel += sum coefficient form`, with
/// memories at rest at the start of every trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Proposed {
    /// Stage with most of the remaining gap.
    pub stage: String,
    /// Output channel of that stage.
    pub channel: String,
    /// Equation with numbers and units; empty if nothing was found.
    pub equation: String,
    /// Terms, in the order in which they were found.
    pub terms: Vec<ProposedTerm>,
    /// Signals that terms refer to by index.
    pub signals: Vec<SignalScale>,
    /// Units of time in a trial and in the session, s.
    pub time_scales_s: [f64; 2],
    /// Initial state of memories in a trial.
    pub initial: String,
    /// Share of the stage's remaining gap that is closed on the samples by which terms were chosen.
    pub closes_held: f64,
    /// Share of the gap that the sum closes on the test trials, which are read only for this.
    pub closes_test: f64,
    /// Where the sum acts.
    pub acts: String,
    /// Whether the residual is random in time: no function of the recorded signals predicts it.
    pub random: bool,
    /// Course of the residual in time, if the residual is random in time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub course: Option<Course>,
    /// Natural logarithm of the odds that the residual is a function of the recorded signals, and
    /// not random in time.
    pub log_odds: f64,
    /// Share of the remaining gap that many terms of the library predict together on held-out
    /// samples.
    pub predicted: f64,
    /// The proposal in one sentence.
    pub sentence: String,
}

/// Returns the signals of a recording to which terms refer.
pub(crate) fn scales(inputs: &TermInputs) -> Vec<SignalScale> {
    inputs.signals.iter().map(|signal| signal.spec.clone()).collect()
}

/// Returns the equation `channel += ...`, followed by the definitions of its symbols. `time_scales_s` are those of
/// [`Proposed`].
pub(crate) fn equation(
    channel: &str,
    terms: &[ProposedTerm],
    signals: &[SignalScale],
    time_scales_s: [f64; 2],
) -> String {
    if terms.is_empty() {
        return String::new();
    }
    let sum: Vec<String> = terms
        .iter()
        .map(|t| {
            let unit = if t.unit.is_empty() { String::new() } else { format!(" {}", t.unit) };
            format!("{}{unit} {}", in_digits(t.coefficient, 3), t.name)
        })
        .collect();
    let speaks = |letter: &str, s: &SignalScale| {
        terms.iter().any(|t| t.name.contains(&format!("{letter}[{}]", s.name)))
    };
    let mut letters = Vec::new();
    for s in signals.iter().filter(|s| speaks("x", s) || speaks("v", s)) {
        let name = &s.name;
        if speaks("x", s) && !s.is_command {
            let unit = if s.unit == "1" { "" } else { s.unit.as_str() };
            letters.push(format!(
                "x[{name}] = ({name} - {} {unit})/({} {unit})",
                in_digits(s.offset, 3),
                in_digits(s.scale, 3)
            ));
        } else if speaks("x", s) {
            letters.push(format!("x[{name}] = {name}"));
        }
        if speaks("v", s) {
            let rate = in_digits(s.rate_per_s * s.scale, 3);
            letters.push(format!("v[{name}] = (d {name}/dt)/({rate} {}/s)", s.unit));
        }
    }
    for (letter, scale_s) in ["T_trial", "T_session"].into_iter().zip(time_scales_s) {
        if terms.iter().any(|t| t.name.contains(letter)) {
            letters.push(format!("{letter} = {} s", in_digits(scale_s, 3)));
        }
    }
    let with = if letters.is_empty() { String::new() } else { format!("; {}", letters.join(", ")) };
    format!("{channel} += {}{with}", sum.join(" + "))
}

/// Returns a term as text, as it is written in the equation.
pub(crate) fn words(term: &Term, signals: &[SignalScale]) -> String {
    let factors: Vec<String> = term.factors.iter().map(|f| factor(*f, signals)).collect();
    let product = if factors.is_empty() { "1".to_owned() } else { factors.join(" ") };
    match term.passage {
        Passage::Direct => product,
        Passage::Lag { tau_s } => format!("lag({product}, {} s)", in_digits(tau_s, 3)),
        Passage::Leak { tau_s } => format!("leak({product}, {} s)", in_digits(tau_s, 3)),
    }
}

fn factor(factor: Factor, signals: &[SignalScale]) -> String {
    let name = factor.signal().map_or("", |s| signals[s].name.as_str());
    let (x, v) = (format!("x[{name}]"), format!("v[{name}]"));
    let raised = |what: String, p: f64| if p == 1.0 { what } else { format!("{what}^{p}") };
    let short = |number: f64| in_digits(number, 3);
    match factor {
        Factor::Power { power, .. } => raised(format!("max(0, {x})"), power),
        Factor::Centred { at, power, .. } => {
            raised(format!("({x} - {})", short(at)), f64::from(power))
        }
        Factor::Above { at, power, .. } => raised(format!("max(0, {x} - {})", short(at)), power),
        Factor::Below { at, power, .. } => raised(format!("max(0, {} - {x})", short(at)), power),
        Factor::Low { width, .. } => format!("exp(-max(0, {x})/{})", short(width)),
        Factor::High { width, .. } => format!("exp(-max(0, 1 - {x})/{})", short(width)),
        Factor::Sine { turns, .. } => format!("sin(2 pi {} {x})", short(turns)),
        Factor::Cosine { turns, .. } => format!("cos(2 pi {} {x})", short(turns)),
        Factor::Rate { form, .. } => match form {
            RateForm::Linear => v,
            RateForm::Magnitude => format!("|{v}|"),
            RateForm::Square => format!("{v}^2"),
            RateForm::SignedSquare => format!("{v} |{v}|"),
            RateForm::SignedRoot => format!("sign({v}) sqrt|{v}|"),
            RateForm::Sign => format!("sign({v})"),
            RateForm::Striction => format!("sign({v}) exp(-|{v}|/0.3)"),
            RateForm::Rising => format!("max(0, {v})"),
        },
        Factor::Bend { .. } => format!("step({v})"),
        Factor::Play { width, .. } => format!("({x} - play({x}, {}))", short(width)),
        Factor::Lag { tau_s, .. } => format!("({x} - lag({x}, {} s))", short(tau_s)),
        Factor::Late { delay_s, .. } => format!("({x}(t - {} s) - {x})", short(delay_s)),
        Factor::Peak { .. } => format!("(greatest {x} - {x})"),
        Factor::Turned { width, .. } => {
            let travelled = format!("travel since reversal of {x}/{}", short(width));
            format!("sign({v}) (1 - exp(-{travelled}))")
        }
        Factor::Travel { power, .. } => raised(format!("travel({x})"), power),
        Factor::TravelFade { width, .. } => format!("exp(-travel({x})/{})", short(width)),
        Factor::Time { power } => raised("(time in trial/T_trial)".into(), power),
        Factor::TimeFade { tau_s } => format!("exp(-time in trial/{} s)", short(tau_s)),
        Factor::Session { power } => raised("(session time/T_session)".into(), power),
    }
}

/// Returns words for where a sum of terms acts: on the output of the stage, or on its rate.
pub(crate) fn acts(stage: &str, terms: &[ProposedTerm]) -> String {
    let is_rate = |t: &ProposedTerm| matches!(t.form.passage, Passage::Leak { .. });
    match terms.iter().any(is_rate) {
        true => format!("rate of the output of {stage}"),
        false => format!("output of {stage}"),
    }
}

/// Summarises a proposal in one sentence.
pub(crate) fn sentence(proposed: &Proposed, unit: &str) -> String {
    let Proposed { stage, channel, equation, closes_test, .. } = proposed;
    // Leave out the definitions of the symbols, which follow the semicolon.
    let equation = equation.split(';').next().unwrap_or_default();
    match (proposed.random, proposed.terms.is_empty()) {
        (true, _) => {
            let course = proposed.course.map(|c| format!(": {} in {channel}", c.words(unit)));
            format!(
                "No term that was tried explains what is left in {stage}{}. The cause may act inside the simulated equations (friction, a limit of the speed), or not depend on what was recorded.",
                course.unwrap_or_default()
            )
        }
        (false, true) => format!(
            "What is left in {stage} may depend on the recorded signals, but no short sum of terms describes how. A random load looks like this as well."
        ),
        (false, false) => format!(
            "What is missing in {stage} may be {equation}: it closes {:.0} % of what is left there on trials that were not fitted.{}",
            100.0 * closes_test,
            slow(proposed)
        ),
    }
}

/// Says that a time constant is too long to be determined; empty if all are shorter than the longest
/// fitted part of a recording.
fn slow(proposed: &Proposed) -> String {
    let longest_s = proposed.terms.iter().map(|t| t.form.longest_s()).fold(0.0, f64::max);
    let fitted_s = proposed.time_scales_s[0];
    if longest_s <= fitted_s {
        return String::new();
    }
    format!(
        " The time constant of {} s is longer than the {} s that were fitted of the longest recording, so the cause may also be a drift or \
         an integral.",
        in_digits(longest_s, 3),
        in_digits(fitted_s, 3)
    )
}
