//! A rig file: nominal parameters by stage, with tolerances, and effects that are on.

use std::{collections::BTreeMap, fmt::Write, path::Path};

use serde::{Deserialize, Serialize};

use stretch_files::write_whole;

use crate::{
    DataError, TomlFile, TomlView,
    toml_text::{key_text, number_text, string_text},
};

/// The contents of a `rig.toml`: names are checked by whoever simulates it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RigFile {
    /// `"gauge"` for a gauge alone; absent for a whole rig.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// Effects that are on, in the file's order.
    #[serde(rename = "effect", default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<EffectEntry>,
    /// A table a stage; in it a parameter a key.
    #[serde(flatten)]
    pub stages: BTreeMap<String, BTreeMap<String, Parameter>>,
}

/// A nominal parameter and how far it may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Nominal value, SI unless the name says otherwise.
    pub value: f64,
    /// One standard deviation as a share of the value; exact when neither is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// One standard deviation in the unit of the value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance_abs: Option<f64>,
}

/// One `[[effect]]`: its name and its parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectEntry {
    /// Name in the catalogue.
    pub name: String,
    /// Parameters by name.
    #[serde(flatten)]
    pub parameters: BTreeMap<String, f64>,
}

/// What is said beside the entries of a rig file: comments, which no reader takes for anything else.
///
/// ```
/// use stretch_data::{Remarks, RigFile};
/// let rig = RigFile::parse("rig.toml", "[muscle]\ntau_m = { value = 0.03 }")?;
/// let mut remarks = Remarks::default();
/// remarks.head.push("Found on Monday.".into());
/// remarks.parameters.insert(("muscle".into(), "tau_m".into()), "lag, s".into());
/// let text = rig.to_toml_with(&remarks);
/// assert_eq!(text, "# Found on Monday.\n\n[muscle]\ntau_m = { value = 0.03 } # lag, s\n");
/// assert_eq!(RigFile::parse("copy", &text)?, rig);
/// # Ok::<(), stretch_data::DataError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Remarks {
    /// Lines at the top of the file.
    pub head: Vec<String>,
    /// Behind a parameter: by stage and name.
    pub parameters: BTreeMap<(String, String), String>,
    /// Lines above an effect: by its name.
    pub effects: BTreeMap<String, Vec<String>>,
    /// Behind a parameter of an effect: by the effect's name and its own.
    pub effect_parameters: BTreeMap<(String, String), String>,
}

impl RigFile {
    /// Reads a rig file. Whether the names are those of a rig is for whoever simulates it.
    ///
    /// # Errors
    /// [`DataError::File`], [`DataError::NotToml`], or [`DataError::Key`] with table and key.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, DataError> {
        Self::from_file(&TomlFile::read(path)?)
    }

    /// Parses the text of a rig file; `name` stands for the file in messages.
    ///
    /// # Errors
    /// As [`RigFile::read`].
    ///
    /// ```
    /// use stretch_data::RigFile;
    /// let rig = RigFile::parse("rig.toml", "[muscle]\ntau_m = { value = 0.03, tolerance = 0.5 }")?;
    /// assert_eq!(rig.stages["muscle"]["tau_m"].value, 0.03);
    /// assert_eq!(RigFile::parse("copy", &rig.to_toml())?, rig);
    /// let error = RigFile::parse("rig.toml", "[muscle]\ntau_m = { value = 'long' }").unwrap_err();
    /// assert_eq!(
    ///     error.to_string(),
    ///     "rig.toml, [muscle] tau_m, key value: \"long\" is not a finite number"
    /// );
    /// # Ok::<(), stretch_data::DataError>(())
    /// ```
    pub fn parse(name: &str, text: &str) -> Result<Self, DataError> {
        Self::from_file(&TomlFile::parse(name, text)?)
    }

    /// Writes the rig file, whole or not at all; numbers read back to the same bits.
    ///
    /// # Errors
    /// As [`write_whole`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), DataError> {
        Ok(write_whole(path, |out| out.write_all(self.to_toml().as_bytes()))?)
    }

    /// The text of the rig file.
    pub fn to_toml(&self) -> String {
        self.to_toml_with(&Remarks::default())
    }

    /// The text of the rig file with comments beside its entries; it reads back to the same.
    pub fn to_toml_with(&self, remarks: &Remarks) -> String {
        let mut text = String::new();
        self.write_toml(remarks, &mut text).expect("a String takes everything");
        text
    }

    fn write_toml(&self, remarks: &Remarks, out: &mut String) -> std::fmt::Result {
        for line in &remarks.head {
            writeln!(out, "# {}", one_line(line))?;
        }
        if let Some(kind) = &self.kind {
            writeln!(out, "kind = {}", string_text(kind))?;
        }
        for (stage, parameters) in &self.stages {
            let gap = gap(out);
            writeln!(out, "{gap}[{}]", key_text(stage))?;
            for (name, parameter) in parameters {
                write!(out, "{} = {{ value = {}", key_text(name), number_text(parameter.value))?;
                for (key, value) in
                    [("tolerance", parameter.tolerance), ("tolerance_abs", parameter.tolerance_abs)]
                {
                    if let Some(value) = value {
                        write!(out, ", {key} = {}", number_text(value))?;
                    }
                }
                let remark = remarks.parameters.get(&(stage.clone(), name.clone()));
                writeln!(out, " }}{}", behind(remark))?;
            }
        }
        for effect in &self.effects {
            let gap = gap(out);
            writeln!(out, "{gap}[[effect]]")?;
            for line in remarks.effects.get(&effect.name).into_iter().flatten() {
                writeln!(out, "# {}", one_line(line))?;
            }
            writeln!(out, "name = {}", string_text(&effect.name))?;
            for (name, value) in &effect.parameters {
                let remark = remarks.effect_parameters.get(&(effect.name.clone(), name.clone()));
                writeln!(out, "{} = {}{}", key_text(name), number_text(*value), behind(remark))?;
            }
        }
        Ok(())
    }

    fn from_file(file: &TomlFile) -> Result<Self, DataError> {
        let top = file.top();
        let mut rig =
            Self { kind: top.optional_text("kind")?.map(str::to_owned), ..Self::default() };
        rig.effects = top.tables("effect")?.iter().map(effect).collect::<Result<_, _>>()?;
        for stage in top.keys().filter(|key| !["kind", "effect"].contains(key)) {
            let Ok(Some(view)) = top.table(stage) else {
                return top.fail(stage, "it stands outside the tables of the stages");
            };
            let parameters = view
                .keys()
                .map(|name| Ok((name.to_owned(), parameter(&view, name)?)))
                .collect::<Result<_, DataError>>()?;
            rig.stages.insert(stage.to_owned(), parameters);
        }
        Ok(rig)
    }
}

/// A blank line between tables, none at the top.
fn gap(out: &str) -> &'static str {
    if out.is_empty() { "" } else { "\n" }
}

/// A remark behind an entry.
fn behind(remark: Option<&String>) -> String {
    remark.map_or_else(String::new, |remark| format!(" # {}", one_line(remark)))
}

/// A comment ends with its line, and holds no control character.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

fn effect(view: &TomlView<'_>) -> Result<EffectEntry, DataError> {
    let parameters = view
        .keys()
        .filter(|key| *key != "name")
        .map(|key| Ok((key.to_owned(), view.number(key)?)))
        .collect::<Result<_, DataError>>()?;
    Ok(EffectEntry { name: view.text("name")?.to_owned(), parameters })
}

fn parameter(stage: &TomlView<'_>, name: &str) -> Result<Parameter, DataError> {
    let Ok(Some(view)) = stage.table(name) else {
        let value = stage.value(name)?;
        let how = format!("write {} = {{ value = {value} }}", key_text(name));
        return stage.fail(name, format!("{value} is not a table with a value; {how}"));
    };
    let view = view.called(format!("{} {name}", stage.name()));
    view.only(&["value", "tolerance", "tolerance_abs"])?;
    let parameter = Parameter {
        value: view.number("value")?,
        tolerance: view.optional_number("tolerance")?,
        tolerance_abs: view.optional_number("tolerance_abs")?,
    };
    for (key, tolerance) in
        [("tolerance", parameter.tolerance), ("tolerance_abs", parameter.tolerance_abs)]
    {
        if let Some(tolerance) = tolerance.filter(|t| *t < 0.0) {
            return view.fail(key, format!("{tolerance} is negative; a tolerance is at least 0"));
        }
    }
    Ok(parameter)
}
