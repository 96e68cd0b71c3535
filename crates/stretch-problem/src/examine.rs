//! The one flow: a problem is diagnosed, and experiment, fix, code and JSON are made from the diagnosis.

use std::{fmt, sync::atomic::AtomicUsize};

use serde_json::{Value, json};
use stretch_data::Trial;
use stretch_gap::{Costly, Diagnosis, Evidence, GapError, Note, Options, diagnose};
use stretch_sim::{Quantity, Sketch};

use crate::{
    black_box::Agreed,
    fix::{Fix, Fixed, NoFix},
    implement::Implementation,
    problem::Problem,
    transfer::transfer,
};

/// A diagnosis, its evidence, and what follows from the diagnosis.
pub struct Examined {
    /// Name of the data.
    pub name: String,
    /// Seed of the intervals.
    pub seed: u64,
    /// The diagnosis, with the notes on the recordings before its own.
    pub diagnosis: Diagnosis,
    /// The evidence for the diagnosis, from which a report draws.
    pub evidence: Evidence,
    /// The experiment that would tell rivals apart; none where no experiment was looked for or found.
    pub experiment: Option<Trial>,
    /// The named effects, as code to type.
    pub implementations: Vec<Implementation>,
    /// Families of effects that the data do not tell apart, with what the members agree on.
    pub families: Vec<Agreed>,
    /// The fixed simulator as a file, or why there is no such file.
    pub fix: Result<Fix, NoFix>,
}

impl fmt::Debug for Examined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Examined").field("diagnosis", &self.diagnosis).finish_non_exhaustive()
    }
}

impl Problem {
    /// Diagnoses the problem; with `looks_on` also looks for the experiment that would tell rivals apart, where there are rivals. `progress`
    /// and `stop` mean what they mean to [`diagnose`].
    ///
    /// # Errors
    /// Those of [`diagnose`] and [`next_experiment`](stretch_gap::next_experiment).
    ///
    /// ```
    /// # use stretch_data::{Channel, SessionTrial, Trial};
    /// # use stretch_problem::{GaugeSetup, GaugeSimulator, Problem};
    /// # use stretch_gap::Options;
    /// # use stretch_sim::Catalogue;
    /// # let rod = |t: f64| 40.0 + 20.0 * (1.3 * t).sin() + 10.0 * (3.1 * t).sin();
    /// # let time_s: Vec<f64> = (0..4000).map(|i| 0.01 * i as f64).collect();
    /// # let noise = |i: usize| 1e-3 * ((i * i * 7919) % 1000) as f64 / 1000.0;
    /// # let channel = |name: &str, values| Channel { name: name.into(), values };
    /// # let length = time_s.iter().map(|t| rod(*t)).collect();
    /// # let signal = time_s.iter().enumerate().map(|(i, t)| 0.02 * rod(t - 0.05) + noise(i)).collect();
    /// # let channels = vec![channel("rod_mm", length), channel("s1", signal)];
    /// # let trials = [SessionTrial::new(Trial { name: "rod.csv".into(), time_s, channels })];
    /// # let catalogue = Catalogue::default();
    /// # let (reference, signal, rig, catalogue) = ("rod_mm", "s1", None, &catalogue);
    /// let gauge = GaugeSimulator::new(&GaugeSetup { trials: &trials, reference, signal, rig, catalogue })?;
    /// let examined = Problem::from(gauge).examine(&Options::default(), false, &|_| (), &|| false)?;
    /// assert_eq!(examined.diagnosis.named, ["channel_skew"]);
    /// assert_eq!(examined.implementations[0].name, "channel_skew");
    /// assert_eq!(examined.to_json()["seed"], 1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn examine(
        &self,
        options: &Options,
        looks_on: bool,
        progress: &(dyn Fn(&str) + Sync),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Examined, GapError> {
        let source = self.source();
        let report = |what: &str| match self.simulator().costly().map(Costly::model_runs) {
            Some(runs) => progress(&format!("{what} ({} model runs)", runs.count)),
            None => progress(what),
        };
        let (mut diagnosis, evidence) = diagnose(self.simulator(), options, &report, stop)?;
        if !diagnosis.named.is_empty() {
            report("what the gap costs a calibration");
            let simulations = AtomicUsize::new(0);
            let asked = (options.seed, &simulations);
            // where runs fail, or may not be made any more, what was found is told without it
            diagnosis.transfer = match transfer(self.simulator(), &evidence, asked) {
                Err(error) if error.is_of_runs() => None,
                found => found?,
            };
            diagnosis.simulations += simulations.into_inner();
        }
        let mut proposal = None;
        if diagnosis.ambiguous.len() > 1 && looks_on {
            report("the next experiment");
            proposal = source.next(&diagnosis, &evidence)?;
        }
        diagnosis.next_experiment = proposal.as_ref().map(|p| p.next.clone());
        let families = source.families(&diagnosis);
        let notes = &mut diagnosis.notes;
        notes.splice(0..0, source.notes().into_iter().map(Note::from));
        notes.extend(families.iter().map(Agreed::note));
        notes.extend(source.afterwards().into_iter().map(Note::from));
        Ok(Examined {
            name: self.name.clone(),
            seed: options.seed,
            experiment: proposal.map(|p| p.trial),
            implementations: source.implementations(&diagnosis, &evidence),
            families,
            fix: source.fixed(&diagnosis, &evidence),
            diagnosis,
            evidence,
        })
    }
}

impl Examined {
    /// Everything as JSON: the diagnosis in its schema, its data set, seed and version, and what follows from the diagnosis.
    ///
    /// Beside the keys of the diagnosis stand `data_set`, `seed`, `version` (of this crate), `implement` (the named effects with equation,
    /// numbers and initial state), `families`, and the fixed simulator as `fixed_rig` or `fixed_problem`; both are null where
    /// there is no fix.
    pub fn to_json(&self) -> Value {
        // Every key of a diagnosis is a text, as JSON demands.
        let mut value = serde_json::to_value(&self.diagnosis).unwrap_or_default();
        let fixed = self.fix.as_ref().ok().map(|fix| &fix.file);
        value["implement"] = self.implementations.iter().map(implementation).collect();
        value["families"] = self.families.iter().map(family).collect();
        value["fixed_rig"] = match fixed {
            Some(Fixed::Rig(rig)) => json!(rig),
            _ => Value::Null,
        };
        value["fixed_problem"] = match fixed {
            Some(Fixed::Problem(file)) => json!(file.to_toml()),
            _ => Value::Null,
        };
        value["data_set"] = self.name.clone().into();
        value["seed"] = self.seed.into();
        value["version"] = env!("CARGO_PKG_VERSION").into();
        value
    }
}

/// A named effect as JSON.
fn implementation(one: &Implementation) -> Value {
    let quantity = |q: &Quantity| json!({ "name": q.name, "unit": q.unit, "meaning": q.meaning });
    let sketch = one.sketch.as_ref();
    json!({
        "effect": one.name,
        "words": one.words,
        "stage": one.stage,
        "equation": one.formula,
        "numbers": one.numbers,
        "inputs": sketch.map(|s| s.inputs.iter().map(quantity).collect::<Vec<_>>()),
        "output": sketch.map(|s| quantity(&s.output)),
        "state": sketch.and_then(Sketch::initial_state),
    })
}

/// A family of effects as JSON.
fn family(agreed: &Agreed) -> Value {
    json!({
        "names": agreed.names,
        "range": agreed.range,
        "unit": agreed.unit,
        "sentence": agreed.note(),
    })
}
