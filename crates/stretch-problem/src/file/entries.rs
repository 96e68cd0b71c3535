//! The tables of a problem's file, one by one.

use stretch_data::{DataError, Split, TomlView};
use stretch_sim::Tolerance;

use super::keys::{ARGUMENT, EFFECT, INPUT, PARAMETER, STAGE, TRIAL};
use crate::black_box::spec::{Argument, Input, OwnEffect, Parameter, StageEntry, Wrapped, share};

/// A trial of a problem's file.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialFile {
    /// File, relative to the problem's folder.
    pub file: String,
    /// Session time of its first sample, s; where it is 0, the trial follows the one before.
    pub start_s: f64,
    /// Whether the trial may be fitted or is only tested on.
    pub split: Split,
}

pub(super) fn stage(view: &TomlView<'_>) -> Result<StageEntry, DataError> {
    view.only(&STAGE.names())?;
    let noise = view.optional_number("noise")?;
    if noise.is_some_and(|noise| noise < 0.0) {
        return view.fail("noise", "it is below 0; give one standard deviation");
    }
    let output = view.text("output")?;
    Ok(StageEntry {
        name: view.optional_text("name")?.unwrap_or(output).to_owned(),
        unit: unit(view)?,
        inputs: view.texts("inputs")?,
        velocity: view.optional_text("velocity")?.map(str::to_owned),
        position: view.optional_text("position")?.map(str::to_owned),
        output: output.to_owned(),
        noise,
    })
}

pub(super) fn input(view: &TomlView<'_>) -> Result<Input, DataError> {
    view.only(&INPUT.names())?;
    let noise = view.optional_number("noise")?.unwrap_or(0.0);
    if noise < 0.0 {
        return view.fail("noise", format!("{noise} is below 0; give one standard deviation"));
    }
    Ok(Input { column: view.text("column")?.to_owned(), unit: unit(view)?, noise })
}

pub(super) fn parameter(view: &TomlView<'_>) -> Result<Parameter, DataError> {
    view.only(&PARAMETER.names())?;
    Ok(Parameter {
        name: view.text("name")?.to_owned(),
        unit: unit(view)?,
        value: view.number("value")?,
        tolerance: tolerance(view)?,
        least: view.optional_number("least")?,
        greatest: view.optional_number("greatest")?,
        stages: view.texts("stages")?,
        alone: view.optional_number("alone")?,
    })
}

/// A tolerance: a number in the parameter's unit, or a text with a per cent sign; a parameter without a tolerance is exact.
fn tolerance(view: &TomlView<'_>) -> Result<Tolerance, DataError> {
    const KEY: &str = "tolerance";
    if !view.has(KEY) {
        return Ok(Tolerance::Exact);
    }
    let tolerance = match view.text(KEY) {
        Ok(text) => match share(text) {
            Some(share) => Tolerance::Relative(share),
            None => {
                return view.fail(
                    KEY,
                    format!("{text:?} is no share; write \"10 %\", or a number in its unit"),
                );
            }
        },
        Err(_) => Tolerance::Absolute(view.number(KEY)?),
    };
    match tolerance {
        Tolerance::Absolute(x) | Tolerance::Relative(x) if x < 0.0 => {
            view.fail(KEY, "it is below 0; give one standard deviation")
        }
        tolerance => Ok(tolerance),
    }
}

pub(super) fn effect(view: &TomlView<'_>) -> Result<OwnEffect, DataError> {
    let several = view.tables("argument")?;
    let arguments = match several.is_empty() {
        true => {
            view.only(&EFFECT.names())?;
            vec![argument(view, "")?]
        }
        false => {
            view.only(&["name", "argument", "stages", "twins"])?;
            let one = |own: TomlView<'_>| {
                let own = own.called(view.name());
                own.only(&ARGUMENT.names())?;
                argument(&own, own.text("name")?)
            };
            several.into_iter().map(one).collect::<Result<_, _>>()?
        }
    };
    Ok(OwnEffect {
        name: view.text("name")?.to_owned(),
        arguments,
        stages: view.texts("stages")?,
        twins: view.texts("twins")?,
    })
}

fn argument(view: &TomlView<'_>, name: &str) -> Result<Argument, DataError> {
    let [min, max] = view.range("range")?;
    let is_log = view.flag("log")?;
    if is_log && min <= 0.0 {
        return view.fail(
            "range",
            format!("it begins at {min}; what is searched in equal ratios is above 0"),
        );
    }
    let (off, value) = (view.optional_number("off")?, view.optional_number("value")?);
    Ok(Argument { name: name.to_owned(), unit: unit(view)?, min, max, off, is_log, value })
}

pub(super) fn wrapped(view: &TomlView<'_>) -> Result<Wrapped, DataError> {
    let values = view.keys().filter(|key| *key != "name");
    let values = values.map(|key| Ok((key.to_owned(), view.number(key)?)));
    let values = values.collect::<Result<_, DataError>>()?;
    Ok(Wrapped { name: view.text("name")?.to_owned(), values })
}

pub(super) fn trial(view: &TomlView<'_>) -> Result<TrialFile, DataError> {
    view.only(&TRIAL.names())?;
    let split = match view.optional_text("split")?.unwrap_or("fit") {
        "fit" => Split::Fit,
        "test" => Split::Test,
        other => return view.fail("split", format!("{other:?} is none of fit, test")),
    };
    let start_s = view.optional_number("start_s")?.unwrap_or(0.0);
    Ok(TrialFile { file: view.text("file")?.to_owned(), start_s, split })
}

/// The unit of an entry, empty where none is given.
fn unit(view: &TomlView<'_>) -> Result<String, DataError> {
    Ok(view.optional_text("unit")?.unwrap_or_default().to_owned())
}
