//! Makes one case: draws a rig, sets its effects to the requested strengths, and records a session.

use std::collections::BTreeMap;

use crate::disturbances::Surroundings;
use crate::effect::{Cause, Causes, Family, Kind};
use crate::error::BlindError;
use crate::excess::Yardstick;
use crate::plan::{Order, Plan};
use crate::protocol::{RATE_HZ, Script, session, with_pauses};
use crate::random::RandomGenerator;
use crate::rig::{L_STEP, LEAST_STRAIN, Rig, UNCERTAIN, V_FS, V_STEP};
use crate::session::{Conditions, FINE, Trace, run};
use crate::truth::{Acting, CaseKind, Label};

/// Largest number of rigs that are drawn for a case before [`BlindError::NoRig`] is returned.
const TRIES: usize = 60;

/// Measured samples of one trial: pressure in kPa (`None` if it was not recorded), length in mm,
/// voltage in V.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Recording {
    pub(crate) script: Script,
    pub(crate) pressure_kpa: Option<Vec<f64>>,
    pub(crate) length_mm: Vec<f64>,
    pub(crate) bridge_v: Vec<f64>,
    /// Time of each sample, s; `None` if the samples are on the grid or if `time_s` does not show
    /// that they are not.
    pub(crate) stamps: Option<Vec<f64>>,
    /// Whether each sample is missing; empty if no sample is.
    pub(crate) missing: Vec<bool>,
}

/// A recorded session and its label.
#[derive(Debug, Clone)]
pub(crate) struct Case {
    pub(crate) label: Label,
    pub(crate) recordings: Vec<Recording>,
    /// Noise of pressure in Pa, length in mm and voltage in V, if a rig file states it.
    pub(crate) noise: Option<[f64; 3]>,
}

impl Case {
    /// Makes case `number` of `seed`.
    pub(crate) fn make(
        number: usize,
        seed: u64,
        plan: &Plan,
        order: Order,
    ) -> Result<Self, BlindError> {
        // Separate random streams for every case, so that the order in which cases are made does
        // not matter.
        let base = 16 * (number as u64 + 1);
        let mut protocol_random = RandomGenerator::new(seed, base);
        let mut rig_random = RandomGenerator::new(seed, base + 1);
        let mut effect_random = RandomGenerator::new(seed, base + 2);
        let mut noise_random = RandomGenerator::new(seed, base + 3);
        let mut disturbances_random = RandomGenerator::new(seed, base + 4);
        let around = Surroundings::draw(&mut disturbances_random);
        let scripts = session(&mut protocol_random);
        let scripts = with_pauses(scripts, || around.pause(&mut disturbances_random));
        for _ in 0..TRIES {
            let rig = Rig::draw(&mut rig_random);
            let conditions = Conditions::draw(&scripts, &around, &mut rig_random);
            let column = order.pressure_column;
            let mut yardstick = Yardstick::new(&rig, &scripts, &conditions, &around, column);
            let chosen = choose(order, plan, &mut yardstick, &mut effect_random);
            let causes = Causes::new(&chosen.iter().map(|c| c.0).collect::<Vec<_>>());
            let (excess, least) = match chosen.as_slice() {
                [] => (0.0, f64::INFINITY),
                _ => yardstick.excess(&causes),
            };
            if least <= LEAST_STRAIN {
                continue;
            }
            let mut label = label(order, &rig, &chosen, excess);
            label.disturbances = around.facts();
            let traces = run(&rig, &causes, &scripts, &conditions, FINE);
            let recordings =
                scripts.iter().zip(traces).enumerate().map(|(trial, (script, trace))| {
                    let offsets = conditions.offsets(trial);
                    record(script, trace, offsets, (&around, column), &mut noise_random)
                });
            let recordings = recordings.collect();
            let noise = around.stated.then(|| around.noise.map(|noise| noise.sigma));
            return Ok(Self { label, recordings, noise });
        }
        Err(BlindError::NoRig { case: number, tries: TRIES })
    }
}

/// Adds the effects of a recorder to a trial: noise, converters and lost rows.
fn record(
    script: &Script,
    trace: Trace,
    offsets: &[f64],
    (around, pressure_column): (&Surroundings, bool),
    random: &mut RandomGenerator,
) -> Recording {
    let count = script.openings.len();
    let [p, l, v] = around.noise;
    let noisy = |values: &[f64], noise: Vec<f64>| -> Vec<f64> {
        values.iter().zip(noise).map(|(x, n)| x + n).collect()
    };
    let pressure = noisy(&trace.pressure, p.samples(count, random));
    let length = noisy(&trace.length, l.samples(count, random));
    let volts = noisy(&trace.volts, v.samples(count, random));
    let shown = |v: f64| (v.clamp(0.0, V_FS) / V_STEP).round() * V_STEP;
    let stamped = around.stamped && !offsets.is_empty();
    let stamp = |(i, late): (usize, &f64)| i as f64 / RATE_HZ as f64 + late;
    Recording {
        script: script.clone(),
        pressure_kpa: pressure_column.then(|| pressure.iter().map(|p| p / 1000.0).collect()),
        length_mm: length.iter().map(|l| (l / L_STEP).round() * L_STEP).collect(),
        bridge_v: volts.into_iter().map(shown).collect(),
        stamps: stamped.then(|| offsets.iter().enumerate().map(stamp).collect()),
        missing: around.missing(count, random),
    }
}

fn label(order: Order, rig: &Rig, chosen: &[(Cause, f64)], excess: f64) -> Label {
    let mut chosen = chosen.to_vec();
    if order.kind != CaseKind::Dominant {
        chosen.sort_by(|a, b| b.1.total_cmp(&a.1));
    }
    let name = |cause: &Cause| cause.kind.spec().name.to_owned();
    let lead = chosen.first().map(|c| name(&c.0));
    let parameters: BTreeMap<String, f64> =
        UNCERTAIN.iter().zip(rig.values).map(|(p, value)| (p.name.to_owned(), value)).collect();
    Label {
        kind: order.kind,
        effects: chosen.iter().map(|c| name(&c.0)).collect(),
        stages: chosen.iter().map(|c| c.0.kind.spec().stage).collect(),
        pressure_column: order.pressure_column,
        excess,
        struck: lead.clone().filter(|_| order.kind == CaseKind::Struck),
        dominant: lead.filter(|_| order.kind == CaseKind::Dominant),
        acting: chosen
            .iter()
            .map(|(cause, alone)| Acting {
                name: name(cause),
                stage: cause.kind.spec().stage,
                form: cause.form_name().to_owned(),
                strength: cause.signed(),
                excess: *alone,
            })
            .collect(),
        parameters,
        family: order.family,
        disturbances: BTreeMap::new(),
    }
}

/// Draws the causes of a case. Returns each with the excess that it causes alone.
fn choose(
    order: Order,
    plan: &Plan,
    yardstick: &mut Yardstick<'_>,
    random: &mut RandomGenerator,
) -> Vec<(Cause, f64)> {
    let Some(lead) = order.lead else { return Vec::new() };
    let (least, most) = plan.excess;
    let family = order.family;
    match order.kind {
        CaseKind::Null => Vec::new(),
        CaseKind::Single | CaseKind::OutOfCatalogue | CaseKind::Struck => {
            vec![tuned(Cause::draw(lead, family, random), least, most, yardstick, random)]
        }
        CaseKind::Compound => {
            // Each effect is visible alone, and neither hides the other.
            let first =
                tuned(Cause::draw(lead, family, random), 1.0, most.max(1.0), yardstick, random);
            let range = ((0.2 * first.1).max(0.5), 5.0 * first.1.max(1.0));
            let other = companion(&[lead], family, range, yardstick, random);
            vec![first, other]
        }
        CaseKind::Dominant => {
            let first =
                tuned(Cause::draw(lead, family, random), 8.0, most.max(8.0), yardstick, random);
            let range = (0.02 * first.1, 0.12 * first.1);
            let mut kinds = vec![lead];
            let mut chosen = vec![first];
            while chosen.len() < 4 {
                let small = companion(&kinds, family, range, yardstick, random);
                kinds.push(small.0.kind);
                chosen.push(small);
            }
            chosen
        }
    }
}

/// Draws a further cause of another kind. Its excess lies in `range`, within a factor of 1.5.
fn companion(
    taken: &[Kind],
    family: Family,
    range: (f64, f64),
    yardstick: &mut Yardstick<'_>,
    random: &mut RandomGenerator,
) -> (Cause, f64) {
    let mut last = None;
    for _ in 0..12 {
        let cause = Cause::draw(partner(taken, random), family, random);
        let found = tuned(cause, range.0, range.1, yardstick, random);
        if found.1 >= range.0 / 1.5 && found.1 <= range.1 * 1.5 {
            return found;
        }
        last = Some(found);
    }
    last.unwrap_or_else(|| (Cause::draw(partner(taken, random), family, random), 0.0))
}

/// Draws a kind of the catalogue that is not in `taken`.
fn partner(taken: &[Kind], random: &mut RandomGenerator) -> Kind {
    let free: Vec<Kind> =
        Kind::catalogued().iter().copied().filter(|kind| !taken.contains(kind)).collect();
    random.pick(&free)
}

/// Sets the strength of a cause such that its excess is log-uniform between `low` and `high`. If
/// the largest strength causes less, this strength is used.
fn tuned(
    cause: Cause,
    low: f64,
    high: f64,
    yardstick: &mut Yardstick<'_>,
    random: &mut RandomGenerator,
) -> (Cause, f64) {
    let mut measure = |strength: f64| yardstick.excess(&Causes::new(&[cause.at(strength)])).0;
    let spec = cause.kind.spec();
    let full = measure(cause.most());
    let target = random.log_between(low, high.min(full).max(1.01 * low));
    if full <= target {
        return (cause, full);
    }
    // Bisects the logarithm of the strength. Two of three steps assume that the excess is
    // proportional to strength^2.
    let (mut weak, mut strong) = (spec.least.ln(), cause.most().ln());
    let mut guess = strong - 0.5 * (full / target).ln();
    let mut best = (cause, full);
    for round in 0..9 {
        if guess <= weak || guess >= strong || round % 3 == 2 {
            guess = 0.5 * (weak + strong);
        }
        let found = measure(guess.exp());
        if (found / target).ln().abs() < (best.1 / target).ln().abs() {
            best = (cause.at(guess.exp()), found);
        }
        if (found / target).ln().abs() < 0.15 {
            break;
        }
        if found < target {
            weak = guess;
        } else {
            strong = guess;
        }
        guess -= 0.5 * (found.max(1e-9) / target).ln();
    }
    if (best.1 / target).ln().abs() > 0.9 {
        let faintest = measure(spec.least);
        if faintest >= target {
            return (cause.at(spec.least), faintest);
        }
        // The excess jumps over the target, because the effect has a threshold. Any strength beyond
        // the jump is accepted.
        let strength = random.log_between(strong.exp(), cause.most());
        return (cause.at(strength), measure(strength));
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::truth::TWINS;

    #[test]
    fn strengths_span_the_range_wanted_for_every_effect() {
        let scripts = session(&mut RandomGenerator::new(2, 1));
        let mut random = RandomGenerator::new(2, 2);
        let rig = Rig::draw(&mut random);
        let around = Surroundings::draw(&mut random);
        let conditions = Conditions::draw(&scripts, &around, &mut random);
        let mut yardstick = Yardstick::new(&rig, &scripts, &conditions, &around, true);
        let kinds = Kind::catalogued().iter().filter(|&&k| k != Kind::ValveDeadband);
        for (i, &kind) in kinds.enumerate() {
            // The kinds use the families in turn.
            let family = Family::ALL[i % Family::ALL.len()];
            for (low, high) in [(0.05, 0.06), (5.0, 6.0)] {
                let cause = Cause::draw(kind, family, &mut random);
                let (tuned, excess) = tuned(cause, low, high, &mut yardstick, &mut random);
                assert!(tuned.strength <= tuned.most());
                let name = kind.spec().name;
                // The excess is within a factor of two, or the strength is at the end of its range.
                let reached = excess > 0.5 * low && excess < 2.0 * high;
                let ended = tuned.strength == tuned.most() && excess < high;
                assert!(reached || ended, "{name}: {excess} for {low} .. {high}");
            }
        }
    }

    #[test]
    fn compounds_hold_two_visible_effects_and_dominants_one_strong() {
        let plan = Plan::of(100);
        for (kind, count) in [(CaseKind::Compound, 2), (CaseKind::Dominant, 4)] {
            let family = Family::Splines;
            let order = Order { kind, lead: Some(Kind::MainsHum), pressure_column: true, family };
            let case = Case::make(3, 5, &plan, order).expect("a case");
            let label = &case.label;
            assert_eq!(label.effects.len(), count);
            assert_eq!(label.acting.len(), count);
            let alone: Vec<f64> = label.acting.iter().map(|a| a.excess).collect();
            if kind == CaseKind::Compound {
                assert!(alone.iter().all(|&x| x > 0.3), "{alone:?}");
            } else {
                assert_eq!(label.dominant.as_deref(), Some("mains_hum"));
                assert!(alone[1..].iter().all(|&x| x < 0.2 * alone[0]), "{alone:?}");
            }
            assert!(case.recordings.iter().all(|r| r.pressure_kpa.is_some()));
        }
    }

    #[test]
    fn twins_are_of_the_catalogue() {
        for (a, b) in TWINS {
            for name in [a, b] {
                let kind = Kind::named(name).expect("a known effect");
                assert!(Kind::catalogued().contains(&kind), "{name}");
            }
        }
    }
}
