//! `stretch effects`: the catalogue of what a rig may do beside its nominal physics.

use std::path::PathBuf;

use anyhow::Context;
use stretch_effects::{
    Effect, EffectParameter, Extent, Grid, KINDS, Kind, Language, Quantity, Role, Signals, Sketch,
    kind_named,
};
use stretch_problem::notation;
use stretch_sim::{CATALOGUE, RATE_HZ, RigParams, SimError, effect_named};

use super::{
    detectable,
    json::Json,
    shared::{say, say_as_is},
};

/// List the effects that can be added to the simulated rig
///
/// With equation, parameters and plausible ranges, in the order in which several
/// effects of one stage act. A form is a freedom that measured rigs ask for: it is
/// neutral when it is not given, and `stretch diagnose` fits it around its usual
/// value. Use them as
///
///   stretch simulate --effect gauge_hysteresis:h=0.2,s=0.012 --out bench
///
/// or type them into a simulator of your own:
///
///   stretch effects gauge_hysteresis --code python
///
/// With --kinds the kinds that they are made of: what `wrap` in a problem file puts in
/// front of or behind any simulator, with ranges for a channel from 0 to 1.
///
/// With --data how strong each effect of a problem would have to be to be named on its data
/// with probability 0.9, its simulator being right otherwise:
///
///   stretch effects --data bench
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Effects to list [default: all]
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// List kinds, for any channel, in place of the rig's effects
    #[arg(long)]
    kinds: bool,
    /// List what would be named on these data instead: a folder with dataset.toml, a trial, or problem.toml
    #[arg(long, value_name = "DATASET", conflicts_with_all = ["kinds", "code"])]
    data: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
    /// Print code with the typical numbers, for a record at 100 Hz
    #[arg(
        long,
        value_enum,
        value_name = "c|python|matlab",
        hide_possible_values = true,
        conflicts_with = "json",
        requires = "names"
    )]
    code: Option<Code>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Code {
    C,
    Python,
    #[value(alias = "octave")]
    Matlab,
}

/// An effect of the rig, or a kind for any channel.
enum Entry {
    Effect(&'static Effect),
    Kind(&'static Kind),
}

impl Entry {
    fn named(name: &str, kinds: bool) -> Result<Self, SimError> {
        let effect = effect_named(name).filter(|_| !kinds).map(Self::Effect);
        effect.or_else(|| kind_named(name).map(Self::Kind)).ok_or_else(|| {
            let names = CATALOGUE.iter().map(|e| e.name).chain(KINDS.iter().map(|k| k.name));
            let nearest = stretch_data::nearest(name, names).map(str::to_owned);
            SimError::UnknownEffect { name: name.to_owned(), nearest }
        })
    }

    /// Name, words, equation, and where it acts.
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

    /// How it is typed with these values.
    fn sketch(&self, values: &[f64]) -> anyhow::Result<Sketch> {
        let grid = Grid::samples(1.0 / RATE_HZ)?;
        let sketch = match self {
            Self::Effect(effect) => {
                effect.sketch(values, &RigParams::default().surroundings(&grid))
            }
            Self::Kind(kind) => {
                let x = Quantity::new("x", "1", "the channel");
                let beside = Quantity::new("e", "1", "what is beside it");
                let signals = Signals { x, beside, load: Quantity::LOAD, dt_s: grid.dt_s() };
                kind.sketch.map(|sketch| sketch(values, &CHANNEL, &signals))
            }
        };
        sketch.context("nobody has written its code down")
    }
}

/// A channel from 0 to 1.
const CHANNEL: Extent = Extent::between(0.0, 1.0);

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    if let Some(data) = &args.data {
        return detectable::run(data, &args.names, &args.json);
    }
    let chosen: Vec<Entry> = match (args.names.is_empty(), args.kinds) {
        (true, true) => KINDS.iter().copied().map(Entry::Kind).collect(),
        (true, false) => CATALOGUE.iter().copied().map(Entry::Effect).collect(),
        (false, kinds) => {
            args.names.iter().map(|name| Entry::named(name, kinds)).collect::<Result<_, _>>()?
        }
    };
    if let Some(code) = args.code {
        let language = match code {
            Code::C => Language::C,
            Code::Python => Language::Python,
            Code::Matlab => Language::Matlab,
        };
        return chosen
            .iter()
            .try_for_each(|entry| say_as_is(typical_code(entry, language)?.trim_end()));
    }
    let answer: Vec<_> = chosen.iter().map(json).collect();
    args.json.answer(&answer, || list(&chosen))
}

/// The catalogue as text.
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

/// The code of an effect as a usual rig has it.
fn typical_code(entry: &Entry, language: Language) -> anyhow::Result<String> {
    let values: Vec<f64> = entry.parameters().iter().map(EffectParameter::usual).collect();
    let [name, words, equation, _] = entry.columns();
    let comments = [format!("{name}: {words}."), equation.to_owned()];
    Ok(entry.sketch(&values)?.code(language, name, &comments))
}

/// `h: 0 .. 0.6`, with the unit where there is one.
fn range(p: &EffectParameter) -> String {
    let number = |x: f64| {
        // Four digits are enough for a third.
        let x = format!("{x:.3e}").parse().unwrap_or(x);
        if x != 0.0 && x.abs() < 1e-3 || x.abs() >= 1e6 { format!("{x:e}") } else { format!("{x}") }
    };
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
