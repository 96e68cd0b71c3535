//! Families of wrappers that the data cannot distinguish, and the quantity on which the members of
//! a family agree.

use stretch_effects::Family;
use stretch_gap::{Candidate, Diagnosis, Note};

use super::checked::Checked;

/// Wrappers of one family, any of which may be the missing effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Agreed {
    /// Names of the wrappers, the most probable first.
    pub names: Vec<String>,
    /// The family, which determines the quantity on which the wrappers agree.
    pub family: Family,
    /// Range of the agreed quantity, from the least to the greatest value of any wrapper, uncertainties included.
    pub range: [f64; 2],
    /// Unit of the range.
    pub unit: String,
}

impl Agreed {
    /// The family as a note.
    pub fn note(&self) -> Note {
        let [low, high] = self.range;
        let unit = &self.unit;
        let by = |low: f64, high: f64| format!("by {} to {} {unit}", digits(low), digits(high));
        let range = match self.family {
            Family::Late if high < 0.0 => format!("early {}", by(-high, -low)),
            Family::Late if low < 0.0 => {
                let (early, late) = (digits(-low), digits(high));
                format!("at most {early} {unit} early and at most {late} {unit} late")
            }
            Family::Late => format!("late {}", by(low, high)),
            Family::Loop => format!("behind after a turn {}", by(low, high)),
        };
        let names =
            Note::default().text("these data cannot distinguish ").effects(&self.names, " from ");
        names.text(format!("; all of them agree on: {}", range.trim_end()))
    }
}

fn digits(x: f64) -> String {
    let places = (2.0 - x.abs().max(1e-12).log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{x:.places$}")
}

/// Families among the effects that a diagnosis names and those that may replace them.
pub fn agreed(problem: &Checked, diagnosis: &Diagnosis) -> Vec<Agreed> {
    let effects = &problem.description().effects;
    let kind = |name: &str| {
        let at = effects.iter().position(|e| e.name == name)?;
        Some((at, problem.wrapper(at)?.family?))
    };
    let mut out: Vec<Agreed> = Vec::new();
    for name in &diagnosis.named {
        let Some((own, (family, _))) = kind(name) else { continue };
        let stage = &effects[own].touches;
        let is_rival = |other: &&String| {
            *other != name
                && kind(other)
                    .is_some_and(|(at, (f, _))| f == family && effects[at].touches == *stage)
        };
        let mut rivals: Vec<&String> = Vec::new();
        for other in diagnosis.tied.iter().chain(&diagnosis.ambiguous).filter(is_rival) {
            if !rivals.contains(&other) {
                rivals.push(other);
            }
        }
        if rivals.is_empty() {
            continue;
        }
        let names: Vec<&String> = std::iter::once(name).chain(rivals).collect();
        let ranges =
            names.iter().filter_map(|n| kind(n).and_then(|(_, (_, of))| said(diagnosis, n, of)));
        let range = ranges.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], [low, high]| {
            [a.min(low), b.max(high)]
        });
        let unit = match family {
            Family::Late => "s".to_owned(),
            Family::Loop => problem.description().stages[stage[0]].unit.clone(),
        };
        if range[0] <= range[1] {
            out.push(Agreed { names: names.into_iter().cloned().collect(), family, range, unit });
        }
    }
    out
}

/// The range of a family's quantity from the most probable candidate that contains the effect. For the range, the
/// effect's first value is varied by 1.96 standard deviations to either side.
fn said(diagnosis: &Diagnosis, name: &str, of: fn(&[f64]) -> f64) -> Option<[f64; 2]> {
    let holds = |c: &&Candidate| c.effects.iter().any(|e| e == name);
    let candidate = diagnosis.candidates.iter().find(holds)?;
    let own: Vec<_> = candidate.parameters.iter().filter(|p| p.effect == name).collect();
    let with = |shift: f64| {
        let values: Vec<f64> = own
            .iter()
            .enumerate()
            .map(|(i, p)| if i == 0 { p.value + shift * p.sd } else { p.value })
            .collect();
        of(&values)
    };
    let ends = [with(-1.96), with(1.96)];
    Some([ends[0].min(ends[1]), ends[0].max(ends[1])])
}
