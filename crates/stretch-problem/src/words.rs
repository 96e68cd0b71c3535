//! Describes the effects of a diagnosis in words, instead of the names used in files and options.

use stretch_effects::kind_named;
use stretch_gap::Diagnosis;
use stretch_sim::{RigStage, effect_named};

/// Returns a noun phrase for an effect: `the gauge's hysteresis` for `gauge_hysteresis`,
/// `backlash at the output` for `output.backlash`. A name that is in no catalogue, such as that of
/// an effect in a user's simulator, is returned unchanged.
pub fn effect_in_words(name: &str, diagnosis: &Diagnosis) -> String {
    if !name.contains('.') {
        let is_ours = |stage: &str| RigStage::ALL.iter().any(|own| own.name() == stage);
        // a user's simulator may use the same name for another effect
        let is_ours = diagnosis.location.stages.iter().all(|s| is_ours(&s.stage));
        let own = effect_named(name).filter(|_| is_ours);
        let of_gauge = OF_GAUGE.iter().find(|(effect, _)| *effect == name);
        if let Some((_, title)) = of_gauge.filter(|_| diagnosis.gauge_alone) {
            return (*title).to_owned();
        }
        return own.map_or(name, |effect| effect.title).to_owned();
    }
    wrapper_in_words(name)
}

/// Returns a noun phrase for an effect at a place: `backlash at the input` for `input.backlash`. Another name is returned
/// unchanged.
pub(crate) fn wrapper_in_words(name: &str) -> String {
    let Some((place, kind)) = name.rsplit_once('.') else { return name.to_owned() };
    let (kind, from) = match kind.trim_end_matches(')').split_once('(') {
        Some((kind, other)) => (kind, format!(" from {other}")),
        None => (kind, String::new()),
    };
    let Some(kind) = kind_named(kind) else { return name.to_owned() };
    let side = |side: &str| match side {
        "input" | "output" => format!("the {side}"),
        column => column.to_owned(),
    };
    let place = match place.rsplit_once('.') {
        Some((stage, place)) => format!("{} of {stage}", side(place)),
        None => side(place),
    };
    format!("{}{from} at {place}", kind.title)
}

/// Effects of the reference, described for a gauge whose reference may be another instrument than a potentiometer.
const OF_GAUGE: [(&str, &str); 2] = [
    ("pot_nonlinearity", "a bend of signal against reference (in either instrument)"),
    ("pot_backlash", "the backlash of the reference"),
];

/// Returns a copy of a diagnosis for display, in which effects are described in words. Computations
/// and stored files keep the names.
pub fn in_words(diagnosis: &Diagnosis) -> Diagnosis {
    let mut out = diagnosis.clone();
    out.rename(&|name| effect_in_words(name, diagnosis));
    out
}

/// Returns a sentence to show below equations, which explains `mean_rev`, `play` and braces. `None`
/// if no equation contains `mean_rev(` or `play(`.
///
/// ```
/// use stretch_problem::notation;
/// assert_eq!(notation(["y = x + offset"]), None);
/// let words = notation(["y = x + offset", "y = mean_rev(x, tau_s)"]).expect("words");
/// assert!(words.contains("tau dy/dt = x - y"));
/// ```
pub fn notation<'a>(equations: impl IntoIterator<Item = &'a str>) -> Option<&'static str> {
    let needs = |equation: &str| equation.contains("play(") || equation.contains("mean_rev(");
    equations.into_iter().any(needs).then_some(
        "In equations, y = mean_rev(x, tau) follows x with a time constant, tau dy/dt = x - y; y = play(x, w) stays constant while x is \
         within w of it, and otherwise follows x at the distance w; {a, b, c} means three such operators, of which the mean is taken.",
    )
}
