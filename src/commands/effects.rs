//! `stretch effects`: the catalogue of what a rig may do beside its nominal physics.

use anyhow::Context;
use stretch_sim::{
    CATALOGUE, Effect, EffectParameter, Grid, Language, RATE_HZ, RigParams, Role, SimError,
    Surroundings, effect_named,
};

use super::{
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
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Effects to list [default: all]
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    #[command(flatten)]
    json: Json,
    /// Print code with the typical numbers, for a record at 100 Hz
    #[arg(
        long,
        value_enum,
        value_name = "c|python|matlab",
        hide_possible_values = true,
        conflicts_with_all = ["json", "json_out"],
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

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let chosen: Vec<&Effect> = if args.names.is_empty() {
        CATALOGUE.to_vec()
    } else {
        let find = |name: &String| {
            effect_named(name).ok_or_else(|| {
                let names = CATALOGUE.iter().map(|e| e.name);
                let nearest = stretch_data::nearest(name, names).map(str::to_owned);
                SimError::UnknownEffect { name: name.clone(), nearest }
            })
        };
        args.names.iter().map(find).collect::<Result<_, _>>()?
    };
    if let Some(code) = args.code {
        let language = match code {
            Code::C => Language::C,
            Code::Python => Language::Python,
            Code::Matlab => Language::Matlab,
        };
        return chosen
            .iter()
            .try_for_each(|effect| say_as_is(typical_code(effect, language)?.trim_end()));
    }
    let answer: Vec<_> = chosen.iter().map(|effect| json(effect)).collect();
    args.json.answer(&answer, || list(&chosen))
}

/// The catalogue as text.
fn list(chosen: &[&Effect]) -> anyhow::Result<()> {
    let mut stage = None;
    for effect in chosen {
        if stage != Some(effect.stage) {
            say(format!("{}{}", if stage.is_some() { "\n" } else { "" }, effect.stage))?;
            stage = Some(effect.stage);
        }
        say(format!("  {}: {}", effect.name, effect.words))?;
        say(format!("      {}", effect.equation))?;
        let of = |is_form: bool| {
            let own = effect.parameters.iter();
            own.filter(move |p| matches!(p.role, Role::Form { .. }) == is_form).map(range)
        };
        say(format!("      {}", of(false).collect::<Vec<_>>().join("; ")))?;
        let forms: Vec<String> = of(true).collect();
        if !forms.is_empty() {
            say(format!("      form {}", forms.join("; ")))?;
        }
    }
    Ok(())
}

/// The code of an effect as a usual rig has it.
fn typical_code(effect: &Effect, language: Language) -> anyhow::Result<String> {
    let (params, grid) = (RigParams::default(), Grid::samples(1.0 / RATE_HZ)?);
    let values: Vec<f64> = effect.parameters.iter().map(EffectParameter::usual).collect();
    let sketch = effect.sketch.context("nobody has written its code down")?;
    let sketch = sketch(&values, &Surroundings::of_rig(&params, &grid));
    let comments = [format!("{}: {}.", effect.name, effect.words), effect.equation.to_owned()];
    Ok(sketch.code(language, effect.name, &comments))
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
            format!(" (else {}, usually {})", number(p.typical), number(usual))
        }
        _ => format!(" (else {})", number(p.typical)),
    };
    let allowed = p.allowed();
    format!("{}: {} .. {}{unit}{default}", p.name, number(*allowed.start()), number(*allowed.end()))
}

fn json(effect: &Effect) -> serde_json::Value {
    let parameters: Vec<serde_json::Value> = effect
        .parameters
        .iter()
        .map(|p| {
            serde_json::json!({
                "name": p.name, "role": p.role.name(), "unit": p.unit, "min": p.allowed().start(), "max": p.allowed().end(),
                "off": p.off(), "typical": p.typical, "usual": p.usual(),
            })
        })
        .collect();
    serde_json::json!({
        "name": effect.name, "words": effect.words, "stage": effect.stage.name(), "equation": effect.equation,
        "parameters": parameters,
    })
}
