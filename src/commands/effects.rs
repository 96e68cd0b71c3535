//! `stretch effects`: lists the catalogue of effects that can be added to the nominal physics of a
//! rig.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use stretch_data::in_digits;
use stretch_effects::{
    Effect, EffectParameter, Extent, Grid, KINDS, Kind, Language, Quantity, Role, Signals, Sketch,
    kind_named,
};
use stretch_gap::{Options, diagnose};
use stretch_problem::{Reading, notation};
use stretch_report::limit_table;
use stretch_sim::{CATALOGUE, RATE_HZ, RigParams, SimError, effect_named};

use super::{
    diagnose::{announce, open, told_on},
    json::Json,
    shared::{detail, say, say_as_is, spinner},
};
use crate::table::table_text;

/// List the effects that can be added to the simulated rig
///
/// Prints the equation, the parameters and their plausible ranges of every effect.
/// Several effects of one stage act in the order of the list. A parameter marked `form`
/// is optional. It describes a detail in which real rigs differ, such as the width of a
/// knee; `stretch diagnose` fits it around its usual value. Use effects as
///
///   stretch simulate --effect gauge_hysteresis:h=0.2,s=0.012 --out bench
///
/// or print code for your own simulator:
///
///   stretch effects gauge_hysteresis --code python
///
/// `stretch effects kinds` lists the underlying kinds, which `wrap` in a problem file adds before
/// or after any simulator, with ranges for a channel from 0 to 1.
///
/// With --data it lists how strong each effect of a problem must be to be named from its data
/// with probability 0.9, if the simulator is right otherwise:
///
///   stretch effects --data bench
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Effects to list [default: all], or the word kinds and then kinds for any channel
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// List detection limits for these data instead: a folder with dataset.toml, a trial, or problem.toml
    #[arg(long, value_name = "DATASET", conflicts_with = "code")]
    data: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
    /// Print code with typical values, for a recording at 100 Hz
    #[arg(long, value_name = "c|python|matlab", value_parser = language, conflicts_with = "json",
          requires = "names")]
    code: Option<Language>,
}

fn language(name: &str) -> Result<Language, &'static str> {
    let name = if name == "octave" { "matlab" } else { name };
    let of_name = |language: &Language| language.name().eq_ignore_ascii_case(name);
    Language::ALL.into_iter().find(of_name).ok_or("write c, python or matlab")
}

/// An effect of the rig, or a kind of effect for any channel.
enum Entry {
    Effect(&'static Effect),
    Kind(&'static Kind),
}

impl Entry {
    fn named(name: &str, is_kind: bool) -> Result<Self, SimError> {
        let effect = effect_named(name).filter(|_| !is_kind).map(Self::Effect);
        effect.or_else(|| kind_named(name).map(Self::Kind)).ok_or_else(|| {
            let names = CATALOGUE.iter().map(|e| e.name).chain(KINDS.iter().map(|k| k.name));
            let nearest = stretch_data::nearest(name, names).map(str::to_owned);
            SimError::UnknownEffect { name: name.to_owned(), nearest }
        })
    }

    /// Returns name, description, equation, and stage.
    fn columns(&self) -> [&'static str; 4] {
        match self {
            Self::Effect(e) => [e.name, e.words, e.equation, e.stage.name()],
            Self::Kind(k) => [k.name, k.words, k.equation, "any channel"],
        }
    }

    fn parameters(&self) -> Vec<EffectParameter> {
        match self {
            Self::Effect(effect) => effect.parameters.to_vec(),
            Self::Kind(kind) => (kind.parameters)(&CHANNEL, "1"),
        }
    }

    /// Returns the implementation sketch for these parameter values.
    fn sketch(&self, values: &[f64]) -> anyhow::Result<Sketch> {
        let grid = Grid::samples(1.0 / RATE_HZ)?;
        let sketch = match self {
            Self::Effect(effect) => {
                effect.sketch(values, &RigParams::default().surroundings(&grid))
            }
            Self::Kind(kind) => {
                let x = Quantity::new("x", "1", "the channel");
                let beside = Quantity::new("e", "1", "the second signal that the effect reads");
                let signals = Signals { x, beside, load: Quantity::LOAD, dt_s: grid.dt_s() };
                kind.sketch.map(|sketch| sketch(values, &CHANNEL, &signals))
            }
        };
        sketch
            .with_context(|| format!("{}: no code is available for this effect", self.columns()[0]))
    }
}

/// The range of a channel from 0 to 1.
const CHANNEL: Extent = Extent::between(0.0, 1.0);

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    if let Some(data) = &args.data {
        return list_limits(data, &args.names, &args.json);
    }
    let (are_kinds, names) = match args.names.split_first() {
        Some((word, names)) if word == "kinds" => (true, names),
        _ => (false, &args.names[..]),
    };
    let chosen: Vec<Entry> = match (names, are_kinds) {
        ([], true) => KINDS.iter().copied().map(Entry::Kind).collect(),
        ([], false) => CATALOGUE.iter().copied().map(Entry::Effect).collect(),
        _ => names.iter().map(|name| Entry::named(name, are_kinds)).collect::<Result<_, _>>()?,
    };
    if let Some(language) = args.code {
        let code = |entry: &Entry| typical_code(entry, language);
        return chosen.iter().try_for_each(|entry| say_as_is(code(entry)?.trim_end()));
    }
    let answer: Vec<_> = chosen.iter().map(json).collect();
    args.json.answer(&answer, || list(&chosen))
}

/// Prints the catalogue as text.
fn list(chosen: &[Entry]) -> anyhow::Result<()> {
    let mut before = None;
    for entry in chosen {
        let [name, words, equation, place] = entry.columns();
        if before != Some(place) {
            say(format!("{}{place}", if before.is_some() { "\n" } else { "" }))?;
            before = Some(place);
        }
        say(format!("  {name}: {words}"))?;
        say(format!("      {equation}"))?;
        let parameters = entry.parameters();
        let of = |is_form: bool| {
            let own = parameters.iter().filter(|p| p.is_form() == is_form);
            own.map(range).collect::<Vec<_>>().join("; ")
        };
        say(format!("      {}", of(false)))?;
        let forms = of(true);
        if !forms.is_empty() {
            say(format!("      form {forms}"))?;
        }
    }
    match notation(chosen.iter().map(|entry| entry.columns()[2])) {
        Some(words) => say(format!("\n{words}")),
        None => Ok(()),
    }
}

/// Returns the code of an effect with its usual parameter values.
fn typical_code(entry: &Entry, language: Language) -> anyhow::Result<String> {
    let values: Vec<f64> = entry.parameters().iter().map(EffectParameter::usual).collect();
    let [name, words, equation, _] = entry.columns();
    let comments = [format!("{name}: {words}."), equation.to_owned()];
    Ok(entry.sketch(&values)?.code(language, name, &comments))
}

/// Formats the range of a parameter, with its unit if it has one: `h: 0 .. 0.6`.
fn range(p: &EffectParameter) -> String {
    let number = |x: f64| in_digits(x, 4);
    let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
    let default = match p.role {
        Role::Strength { .. } => String::new(),
        Role::Form { usual } if usual != p.typical => {
            format!(" ({} unless given, usually {})", number(p.typical), number(usual))
        }
        _ => format!(" ({} unless given)", number(p.typical)),
    };
    let allowed = p.allowed();
    format!("{}: {} .. {}{unit}{default}", p.name, number(*allowed.start()), number(*allowed.end()))
}

fn json(entry: &Entry) -> serde_json::Value {
    let one = |p: &EffectParameter| {
        serde_json::json!({
            "name": p.name, "role": p.role.name(), "unit": p.unit, "min": p.allowed().start(), "max": p.allowed().end(),
            "off": p.off(), "typical": p.typical, "usual": p.usual(),
        })
    };
    let parameters: Vec<serde_json::Value> = entry.parameters().iter().map(one).collect();
    let [name, words, equation, place] = entry.columns();
    serde_json::json!({
        "name": name, "words": words, "stage": place, "equation": equation, "parameters": parameters,
    })
}

/// Diagnoses the data and prints the detection limits of the named effects, or of all effects if
/// none is named.
fn list_limits(data: &Path, names: &[String], json: &Json) -> anyhow::Result<()> {
    ensure!(data.exists(), "{}: there is no such file or folder", data.display());
    let bar = spinner();
    bar.set_message("reading, and starting your own simulator if there is one");
    let problem = open(data, &Reading { announce: Some(announce), ..Reading::default() })?;
    detail(format!("read {}", data.display()));
    let options = Options { detection_limits: true, ..Options::default() };
    let (diagnosis, _) = diagnose(problem.simulator(), &options, &told_on(&bar), &|| false)
        .with_context(|| data.display().to_string())?;
    bar.finish_and_clear();
    let mut limits = diagnosis.detection_limits;
    ensure!(
        !limits.is_empty(),
        "{}: no effect can be named from these data, whatever its strength: {}",
        data.display(),
        diagnosis.sentence
    );
    for name in names {
        let is_known = limits.iter().any(|limit| limit.effect == *name);
        let all: Vec<&str> = limits.iter().map(|limit| limit.effect.as_str()).collect();
        ensure!(
            is_known,
            "{name}: this effect is not considered for these data, only {}",
            all.join(", ")
        );
    }
    limits.retain(|limit| names.is_empty() || names.contains(&limit.effect));
    json.answer(&limits, || say(table_text(&limit_table(&limits))))
}
