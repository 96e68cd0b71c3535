//! A gauge alone as a rig file: `kind = "gauge"`.

use std::collections::BTreeMap;

use stretch_data::{Parameter, RigFile};

use crate::{EffectSet, GaugeSpec, SimError, Tolerance, nearest::nearest};

/// Value of `kind` for a gauge alone.
const KIND: &str = "gauge";

/// The only table of the file.
const TABLE: &str = "sensing";

/// Required parameters; `pressure_scale` is optional.
const REQUIRED: [&str; 4] = ["zero", "span", "offset", "gain"];

/// The nominal gauge alone: its numbers, the tolerances of offset and gain, and its effects.
#[derive(Debug, Clone, PartialEq)]
pub struct GaugeRig {
    /// Numbers.
    pub spec: GaugeSpec,
    /// Tolerance of the offset.
    pub offset: Tolerance,
    /// Tolerance of the gain.
    pub gain: Tolerance,
    /// Effects that are on.
    pub effects: EffectSet,
}

impl GaugeRig {
    /// The gauge that a file of `kind = "gauge"` describes. Offset and gain are exact unless they
    /// have a tolerance, as every parameter of a rig file. A gauge has no stock values, so every
    /// number is required.
    ///
    /// ```
    /// use stretch_data::RigFile;
    /// use stretch_sim::{GaugeRig, Tolerance};
    /// let text = r#"
    /// kind = "gauge"
    /// [[effect]]
    /// name = "channel_skew"
    /// skew_s = 0.05
    /// [sensing]
    /// zero = { value = 2.0 }
    /// span = { value = 88.0 }
    /// offset = { value = 0.01 }
    /// gain = { value = 0.2, tolerance = 0.05 }
    /// "#;
    /// let gauge = GaugeRig::from_file(&RigFile::parse("rig.toml", text)?)?;
    /// assert_eq!((gauge.spec.span, gauge.effects.iter().count()), (88.0, 1));
    /// assert_eq!((gauge.offset, gauge.gain), (Tolerance::Exact, Tolerance::Relative(0.05)));
    /// assert_eq!(GaugeRig::from_file(&gauge.to_file())?, gauge);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Another kind, an unknown table, parameter or effect, a missing parameter, or an unusable
    /// span or gain.
    pub fn from_file(file: &RigFile) -> Result<Self, SimError> {
        let unknown = SimError::unknown_parameter;
        let kind = file.kind.as_deref().unwrap_or("rig");
        if kind != KIND {
            return Err(unknown("a gauge alone", &format!("kind = \"{kind}\""), None));
        }
        if let Some(table) = file.stages.keys().find(|table| *table != TABLE) {
            return Err(unknown("a gauge alone", table, Some(TABLE.to_owned())));
        }
        let empty = BTreeMap::new();
        let table = file.stages.get(TABLE).unwrap_or(&empty);
        let known = || REQUIRED.into_iter().chain(["pressure_scale"]);
        if let Some(name) = table.keys().find(|name| known().all(|k| k != name.as_str())) {
            return Err(unknown(TABLE, name, nearest(name, known())));
        }
        let value = |name: &str| {
            table.get(name).map(|parameter| parameter.value).ok_or_else(|| {
                SimError::MissingParameter { owner: TABLE.to_owned(), name: name.to_owned() }
            })
        };
        let spec = GaugeSpec {
            zero: value("zero")?,
            span: value("span")?,
            offset: value("offset")?,
            gain: value("gain")?,
            pressure_scale: value("pressure_scale").ok(),
        };
        let mut effects = EffectSet::new();
        for entry in &file.effects {
            effects.insert_in(entry, crate::Gauge::unit)?;
        }
        // refuse a gauge that cannot run here, not at the first trial
        crate::Gauge::new(spec, &effects, 0.01)?;
        let tolerance = |name: &str| table.get(name).map_or(Tolerance::Exact, Tolerance::of);
        Ok(Self { spec, offset: tolerance("offset"), gain: tolerance("gain"), effects })
    }

    /// The gauge as a file.
    pub fn to_file(&self) -> RigFile {
        let GaugeSpec { zero, span, offset, gain, pressure_scale } = self.spec;
        let exact = Tolerance::Exact;
        let mut table: BTreeMap<String, Parameter> = [
            ("zero", exact.of_value(zero)),
            ("span", exact.of_value(span)),
            ("offset", self.offset.of_value(offset)),
            ("gain", self.gain.of_value(gain)),
        ]
        .map(|(name, parameter)| (name.to_owned(), parameter))
        .into();
        if let Some(scale) = pressure_scale {
            table.insert("pressure_scale".to_owned(), exact.of_value(scale));
        }
        RigFile {
            kind: Some(KIND.to_owned()),
            effects: self.effects.to_entries(),
            stages: BTreeMap::from([(TABLE.to_owned(), table)]),
        }
    }
}
