//! The two forms of a calibration record.
//!
//! In text, where movements turn is a field like any other, and may be missing. In bytes, field behind field, nothing may be:
//! a record with turns has a schema of its own and holds them last, and one without is what it was before there were any.

use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{self, SeqAccess, Visitor},
    ser::SerializeTuple,
};

use crate::{
    CalibrationSpec, DesignError, Label, Model, Polarity, Provenance, Range, RateEstimator,
    RateSource, SampleRate, Schema, Target, Turns,
};

/// The fields, in the order of bytes.
#[derive(Serialize, Deserialize)]
#[serde(remote = "CalibrationSpec", deny_unknown_fields)]
struct Fields {
    schema: Schema,
    signal: Label,
    reference: Label,
    sample_rate_hz: SampleRate,
    target: Target,
    polarity: Polarity,
    signal_range: Range,
    target_range: Range,
    rate_estimator: RateEstimator,
    rate_source: RateSource,
    dead_band: f64,
    model: Model,
    #[serde(default, skip_serializing_if = "Option::is_none", with = "in_text")]
    turns: Option<Turns>,
    provenance: Provenance,
}

/// A specification in the order of bytes, without its turns.
#[derive(Serialize, Deserialize)]
struct InBytes(#[serde(with = "Fields")] CalibrationSpec);

impl Serialize for CalibrationSpec {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Some(turns) = self.turns.filter(|_| !serializer.is_human_readable()) else {
            return Fields::serialize(self, serializer);
        };
        let fields = InBytes(Self { schema: Schema::WITH_TURNS, turns: None, ..self.clone() });
        let mut both = serializer.serialize_tuple(2)?;
        both.serialize_element(&fields)?;
        both.serialize_element(&turns)?;
        both.end()
    }
}

impl<'de> Deserialize<'de> for CalibrationSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if !deserializer.is_human_readable() {
            return deserializer.deserialize_tuple(2, Bytes);
        }
        let spec = Fields::deserialize(deserializer)?;
        let (found, newest) = (spec.schema.into(), Schema::CURRENT.into());
        if found > newest {
            return Err(de::Error::custom(DesignError::Schema { found, newest }));
        }
        Ok(spec)
    }
}

/// Reads the fields and, where their schema says so, the turns behind them.
struct Bytes;

impl<'de> Visitor<'de> for Bytes {
    type Value = CalibrationSpec;

    fn expecting(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str("a calibration")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<CalibrationSpec, A::Error> {
        let missing = |k| de::Error::invalid_length(k, &self);
        let InBytes(mut spec) = elements.next_element()?.ok_or_else(|| missing(0))?;
        if spec.schema == Schema::WITH_TURNS {
            spec.turns = Some(elements.next_element()?.ok_or_else(|| missing(1))?);
            spec.schema = Schema::CURRENT;
        }
        Ok(spec)
    }
}

/// Turns among the fields: in text alone.
mod in_text {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::Turns;

    pub(super) fn serialize<S: Serializer>(
        turns: &Option<Turns>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        match serializer.is_human_readable() {
            true => turns.serialize(serializer),
            false => serializer.serialize_unit(),
        }
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Turns>, D::Error> {
        match deserializer.is_human_readable() {
            true => Option::deserialize(deserializer),
            false => Ok(None),
        }
    }
}
