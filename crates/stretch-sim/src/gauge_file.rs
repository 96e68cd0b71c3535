//! A gauge alone as a rig file: `kind = "gauge"`.

use std::collections::BTreeMap;

use stretch_data::{Parameter, RigFile};

use crate::{EffectSet, GaugeSpec, SimError, nearest::nearest};

/// What `kind` says of a gauge alone.
const KIND: &str = "gauge";

/// The one table of the file.
const TABLE: &str = "sensing";

/// Parameters that must be there; `pressure_scale` may be.
const REQUIRED: [&str; 4] = ["zero", "span", "offset", "gain"];

impl GaugeSpec {
    /// The gauge and its effects that a file of `kind = "gauge"` describes.
    ///
    /// ```
    /// use stretch_data::RigFile;
    /// use stretch_sim::GaugeSpec;
    /// let text = r#"
    /// kind = "gauge"
    /// [[effect]]
    /// name = "channel_skew"
    /// skew_s = 0.05
    /// [sensing]
    /// zero = { value = 2.0 }
    /// span = { value = 88.0 }
    /// offset = { value = 0.01 }
    /// gain = { value = 0.2 }
    /// "#;
    /// let (spec, effects) = GaugeSpec::from_file(&RigFile::parse("rig.toml", text)?)?;
    /// assert_eq!((spec.span, effects.iter().count()), (88.0, 1));
    /// let again = spec.to_file(&effects);
    /// assert_eq!(GaugeSpec::from_file(&again)?.0, spec);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Another kind, a table, parameter or effect that is not known, a parameter
    /// that is missing, or a span or gain that is not usable.
    pub fn from_file(file: &RigFile) -> Result<(Self, EffectSet), SimError> {
        let unknown = |owner: &str, name: &str, nearest| SimError::UnknownParameter {
            owner: owner.to_owned(),
            name: name.to_owned(),
            nearest,
        };
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
        let spec = Self {
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
        // whatever cannot run is refused here, not at the first trial
        crate::Gauge::new(spec, &effects, 0.01)?;
        Ok((spec, effects))
    }

    /// The gauge and its effects as a file. The priors are flat: no tolerances.
    pub fn to_file(&self, effects: &EffectSet) -> RigFile {
        let exact = |value| Parameter { value, tolerance: None, tolerance_abs: None };
        let values = [self.zero, self.span, self.offset, self.gain].map(exact);
        let mut table: BTreeMap<String, Parameter> =
            REQUIRED.map(str::to_owned).into_iter().zip(values).collect();
        if let Some(scale) = self.pressure_scale {
            table.insert("pressure_scale".to_owned(), exact(scale));
        }
        RigFile {
            kind: Some(KIND.to_owned()),
            effects: effects.to_entries(),
            stages: BTreeMap::from([(TABLE.to_owned(), table)]),
        }
    }
}
