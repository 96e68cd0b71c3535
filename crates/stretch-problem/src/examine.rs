//! Examines a problem: diagnoses it, and derives the next experiment, the fix, the code and the
//! JSON from the diagnosis.

use std::{fmt, sync::atomic::AtomicUsize};

use schemars::{JsonSchema, Schema, generate::SchemaSettings, transform::RecursiveTransform};
use serde::Serialize;
use serde_json::{Value, json};
use stretch_data::{RigFile, Trial};
use stretch_gap::{
    Diagnosis, EffectValue, Evidence, GapError, Note, NoteCode, Options, diagnose, next_experiment,
};
use stretch_sim::{Quantity, Sketch};

use crate::{
    fix::{Fix, Fixed, NoFix},
    implement::Implementation,
    problem::Problem,
    ranges::Ranges,
    transfer::transfer,
};

/// A diagnosis, its evidence, and the results derived from the diagnosis.
pub struct Examined {
    /// Name of the data.
    pub name: String,
    /// Seed of the random numbers from which intervals are computed.
    pub seed: u64,
    /// The diagnosis. Its notes begin with the notes on the recordings.
    pub diagnosis: Diagnosis,
    /// The evidence for the diagnosis, which a report shows.
    pub evidence: Evidence,
    /// The experiment that would distinguish the alternatives; `None` if no experiment was looked for or found.
    pub experiment: Option<Trial>,
    /// Code for the named effects.
    pub implementations: Vec<Implementation>,
    /// The fixed simulator as a file, or why there is no such file.
    pub fix: Result<Fix, NoFix>,
    /// Joint distribution of the parameters, or why there is none.
    pub ranges: Result<Ranges, NoFix>,
}

impl fmt::Debug for Examined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Examined").field("diagnosis", &self.diagnosis).finish_non_exhaustive()
    }
}

impl Problem {
    /// Diagnoses the problem. If `looks_on` is set and there are several alternatives, it also
    /// looks for the experiment that would distinguish them. `progress` and `stop` are those of
    /// [`diagnose`].
    ///
    /// # Errors
    /// Those of [`diagnose`] and [`next_experiment`].
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
    /// assert_eq!(examined.diagnosis.named(), ["channel_skew"]);
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
        let report = |what: &str| match self.simulator().model_runs() {
            Some(runs) => progress(&format!("{what} ({} model runs)", runs.count)),
            None => progress(what),
        };
        let (mut diagnosis, evidence) = diagnose(self.simulator(), options, &report, stop)?;
        if !diagnosis.named().is_empty() {
            report("computing the calibration error that the gap causes");
            let simulations = AtomicUsize::new(0);
            let asked = (options.seed, &simulations);
            // if a run fails or the run budget is spent, the diagnosis is reported without the
            // transfer errors
            diagnosis.transfer = match transfer(self.simulator(), &evidence, asked) {
                Err(error) if error.is_of_runs() => None,
                found => found?,
            };
            diagnosis.simulations += simulations.into_inner();
        }
        let mut proposal = None;
        if diagnosis.ambiguous.len() > 1 && looks_on {
            report("looking for the next experiment");
            proposal = match next_experiment(source, &diagnosis, &evidence) {
                // There is no prediction if the run budget is spent or a model cannot be run on other
                // inputs.
                Err(error) if error.is_of_runs() => None,
                proposal => proposal?,
            };
        }
        diagnosis.set_next_experiment(proposal.as_ref().map(|p| p.next.clone()));
        let of = |code, sentences: Vec<String>| {
            sentences.into_iter().map(move |text| Note::new(code, text))
        };
        let doubts = of(NoteCode::Doubt, source.doubts());
        let notes = &mut diagnosis.notes;
        notes.splice(0..0, doubts.chain(of(NoteCode::Recording, source.notes())));
        notes.extend(of(NoteCode::Simulator, source.afterwards()));
        Ok(Examined {
            name: self.name.clone(),
            seed: options.seed,
            experiment: proposal.map(|p| p.trial),
            implementations: source.implementations(&diagnosis, &evidence),
            fix: source.fixed(&diagnosis, &evidence),
            ranges: Ranges::of(&diagnosis, &evidence, self.simulator().description()),
            diagnosis,
            evidence,
        })
    }
}

impl Examined {
    /// Returns everything as JSON, in the form of [`diagnosis_schema`]: the diagnosis, its data
    /// set, seed and version, and the results derived from it.
    pub fn to_json(&self) -> Value {
        let fixed = self.fix.as_ref().ok().map(|fix| &fix.file);
        let written = Written {
            diagnosis: &self.diagnosis,
            implement: self.implementations.iter().map(WrittenEffect::of).collect(),
            fixed_rig: fixed.and_then(|file| match file {
                Fixed::Rig(rig) => Some(rig),
                Fixed::Problem(_) => None,
            }),
            fixed_problem: fixed.and_then(|file| match file {
                Fixed::Rig(_) => None,
                Fixed::Problem(file) => Some(file.to_toml()),
            }),
            ranges: self.ranges.as_ref().ok(),
            data_set: &self.name,
            seed: self.seed,
            version: env!("CARGO_PKG_VERSION"),
        };
        // This cannot fail, because every key is a string.
        serde_json::to_value(written).unwrap_or_default()
    }
}

/// The JSON Schema of the value that [`Examined::to_json`] returns.
///
/// ```
/// let schema = stretch_problem::diagnosis_schema();
/// assert_eq!(schema["properties"]["sentence"]["type"], "string");
/// assert_eq!(schema["$defs"]["Closed"]["properties"]["share"]["type"][0], "null");
/// ```
pub fn diagnosis_schema() -> Value {
    let settings = SchemaSettings::draft2020_12()
        .for_serialize()
        .with_transform(RecursiveTransform(numbers_may_be_null));
    settings.into_generator().into_root_schema_for::<Written<'_>>().to_value()
}

/// Allows null for a number, because a number that is not finite is written as null.
fn numbers_may_be_null(schema: &mut Schema) {
    schema.remove("format");
    // examples in Rust help no reader of JSON
    if let Some(Value::String(words)) = schema.get_mut("description") {
        let end = words.find("\n\n```").unwrap_or(words.len());
        *words = words[..end].replace('\n', " ");
    }
    if schema.get("type").is_some_and(|kind| kind == "number") {
        schema.insert("type".into(), json!(["null", "number"]));
    }
}

/// A diagnosis as `stretch diagnose --json` writes it. A number that is not finite is written as null.
#[derive(Serialize, JsonSchema)]
#[schemars(title = "Diagnosis")]
struct Written<'a> {
    #[serde(flatten)]
    diagnosis: &'a Diagnosis,
    /// The named effects with equation, numbers, meaning of input and output, and initial state.
    implement: Vec<WrittenEffect<'a>>,
    /// The rig file that `--fix` writes, or null.
    #[schemars(with = "Option<serde_json::Map<String, Value>>")]
    fixed_rig: Option<&'a RigFile>,
    /// The text of the problem file that `--fix` writes, or null.
    fixed_problem: Option<String>,
    /// Joint distribution of the parameters for domain randomisation, which `--ranges` writes, or null.
    ranges: Option<&'a Ranges>,
    /// Name of the data set or recording.
    data_set: &'a str,
    /// Seed of the intervals.
    seed: u64,
    /// Version of the crate that wrote this.
    version: &'a str,
}

/// A named effect, ready to be typed into a simulator.
#[derive(Serialize, JsonSchema)]
struct WrittenEffect<'a> {
    /// Name of the effect.
    effect: &'a str,
    /// What the effect does.
    words: &'a str,
    /// The stage that the effect belongs to.
    stage: &'a str,
    /// Equation, in the names of the numbers.
    equation: &'a str,
    /// Parameters and forms of the effect, with intervals.
    numbers: &'a [EffectValue],
    /// Inputs of the effect; null for an effect that is not described as code.
    inputs: Option<Vec<WrittenQuantity<'a>>>,
    /// Output of the effect.
    output: Option<WrittenQuantity<'a>>,
    /// Initial state of the effect.
    state: Option<String>,
}

/// An input or the output of an effect.
#[derive(Serialize, JsonSchema)]
struct WrittenQuantity<'a> {
    /// Name in the code.
    name: &'a str,
    /// Unit.
    unit: &'a str,
    /// Meaning of the quantity.
    meaning: &'a str,
}

impl<'a> WrittenEffect<'a> {
    fn of(one: &'a Implementation) -> Self {
        let sketch = one.sketch.as_ref();
        Self {
            effect: &one.name,
            words: &one.words,
            stage: &one.stage,
            equation: &one.formula,
            numbers: &one.numbers,
            inputs: sketch.map(|s| s.inputs.iter().map(WrittenQuantity::of).collect()),
            output: sketch.map(|s| WrittenQuantity::of(&s.output)),
            state: sketch.and_then(Sketch::initial_state),
        }
    }
}

impl<'a> WrittenQuantity<'a> {
    fn of(quantity: &'a Quantity) -> Self {
        let Quantity { name, unit, meaning, .. } = quantity;
        Self { name, unit, meaning }
    }
}
