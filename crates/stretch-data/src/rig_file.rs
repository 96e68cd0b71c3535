//! A rig file: nominal parameters of each stage with tolerances, and the enabled effects.

use std::{collections::BTreeMap, fmt, path::Path};

use schemars::JsonSchema;
use serde::{
    Deserialize, Deserializer, Serialize,
    de::{Error, MapAccess, Visitor},
};

use crate::{DataError, Remarks, TomlFile, files::write_whole};

/// The contents of a `rig.toml`. The simulator checks the names.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct RigFile {
    /// `"gauge"` for a rig that is only a gauge; absent for a complete rig.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// One table for each stage, with one key for each parameter.
    #[serde(flatten)]
    pub stages: BTreeMap<String, BTreeMap<String, Parameter>>,
    /// Enabled effects, in the order of the file.
    #[serde(rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<EffectEntry>,
}

/// A nominal parameter and its tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a table; write { value = ... }, with a tolerance or without"
)]
pub struct Parameter {
    /// Nominal value, in SI units unless the name states another unit.
    pub value: f64,
    /// One standard deviation, relative to the value. A parameter without any tolerance is known exactly.
    #[serde(default, deserialize_with = "from_zero", skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// One standard deviation, in the unit of the value.
    #[serde(default, deserialize_with = "from_zero", skip_serializing_if = "Option::is_none")]
    pub tolerance_abs: Option<f64>,
}

/// Reads a standard deviation, which may not be negative.
///
/// # Errors
/// A number below 0.
pub fn from_zero<'de, D, T>(from: D) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de> + Copy + Into<Option<f64>>,
{
    let sd = T::deserialize(from)?;
    match sd.into() {
        Some(x) if x < 0.0 => {
            Err(D::Error::custom(format!("{x} is below 0; give one standard deviation")))
        }
        _ => Ok(sd),
    }
}

/// An effect that acts in every run: its name, and its parameters by name.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct EffectEntry {
    /// Name in the catalogue; for a simulator of the user, place and kind, such as `output.backlash`.
    pub name: String,
    /// Parameters by name.
    #[serde(flatten)]
    pub parameters: BTreeMap<String, f64>,
}

// Written by hand, because `#[serde(flatten)]` would lose the paths of keys in errors.

impl<'de> Deserialize<'de> for RigFile {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Stages;
        impl<'de> Visitor<'de> for Stages {
            type Value = RigFile;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<RigFile, A::Error> {
                let mut rig = RigFile::default();
                while let Some(key) = map.next_key::<String>()? {
                    match key.as_str() {
                        "kind" => rig.kind = map.next_value()?,
                        "effect" => rig.effects = map.next_value()?,
                        _ => drop(rig.stages.insert(key, map.next_value()?)),
                    }
                }
                Ok(rig)
            }
        }
        from.deserialize_map(Stages)
    }
}

impl<'de> Deserialize<'de> for EffectEntry {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Parameters;
        impl<'de> Visitor<'de> for Parameters {
            type Value = EffectEntry;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<EffectEntry, A::Error> {
                let (mut name, mut parameters) = (None, BTreeMap::new());
                while let Some(key) = map.next_key::<String>()? {
                    match key.as_str() {
                        "name" => name = Some(map.next_value()?),
                        _ => drop(parameters.insert(key, map.next_value()?)),
                    }
                }
                let name = name.ok_or_else(|| A::Error::missing_field("name"))?;
                Ok(EffectEntry { name, parameters })
            }
        }
        from.deserialize_map(Parameters)
    }
}

impl RigFile {
    /// Reads a rig file. The simulator checks the names of stages and parameters.
    ///
    /// # Errors
    /// [`DataError::File`], [`DataError::NotToml`], or [`DataError::Key`] with the key.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, DataError> {
        TomlFile::read(path)?.parse()
    }

    /// Parses the text of a rig file; messages call the file `name`.
    ///
    /// # Errors
    /// The errors of [`RigFile::read`].
    ///
    /// ```
    /// use stretch_data::RigFile;
    /// let rig = RigFile::parse("rig.toml", "[muscle]\ntau_m = { value = 0.03, tolerance = 0.5 }")?;
    /// assert_eq!(rig.stages["muscle"]["tau_m"].value, 0.03);
    /// assert_eq!(RigFile::parse("copy", &rig.to_toml())?, rig);
    /// let error = RigFile::parse("rig.toml", "[muscle]\ntau_m = { value = 'long' }").unwrap_err();
    /// assert_eq!(
    ///     error.to_string(),
    ///     "rig.toml, row 2, key muscle.tau_m.value: \"long\" is not a number"
    /// );
    /// # Ok::<(), stretch_data::DataError>(())
    /// ```
    pub fn parse(name: &str, text: &str) -> Result<Self, DataError> {
        TomlFile::new(name, text).parse()
    }

    /// Writes the rig file, completely or not at all. Numbers read back to the same bits.
    ///
    /// # Errors
    /// The errors of [`write_whole`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), DataError> {
        Ok(write_whole(path, |out| out.write_all(self.to_toml().as_bytes()))?)
    }

    /// Returns the text of the rig file.
    pub fn to_toml(&self) -> String {
        self.to_toml_with(&Remarks::default())
    }

    /// Returns the text of the rig file with comments at its entries. It reads back to the same rig
    /// file.
    pub fn to_toml_with(&self, remarks: &Remarks) -> String {
        remarks.write(self)
    }
}
