//! The serialised form of a converted calibration, which is checked while it loads.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};
use stretch_core::{DesignError, SampleRate};

use super::{
    arithmetic::CodeArithmetic,
    calibration::{CODE_SCHEMA, CodeCalibration},
    code_map::{CodeMap, CodeSurface},
};

#[derive(Serialize, Deserialize)]
struct CodeRecord<L, P> {
    /// Schema version. This field is first, so that a newer schema is refused before the rest is read.
    schema: u32,
    /// Window, degree and delay of the rate estimator.
    shape: (u16, u8, u16),
    adc_bits: u8,
    sample_rate_hz: SampleRate,
    falling: bool,
    dead_band: i32,
    #[serde(rename = "sheets")]
    surfaces: CodeMap<L, P>,
}

impl<A: CodeArithmetic, const WINDOW: usize, const DEGREE: usize, const DELAY: usize> Serialize
    for CodeCalibration<A, WINDOW, DEGREE, DELAY>
where
    A::Line: Serialize,
    A::Surface: Serialize,
{
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        CodeRecord {
            schema: CODE_SCHEMA,
            shape: (WINDOW as u16, DEGREE as u8, DELAY as u16),
            adc_bits: self.bits,
            sample_rate_hz: self.sample_rate,
            falling: self.falling,
            dead_band: self.dead_band,
            surfaces: self.surfaces,
        }
        .serialize(serializer)
    }
}

impl<'de, A: CodeArithmetic, const WINDOW: usize, const DEGREE: usize, const DELAY: usize>
    Deserialize<'de> for CodeCalibration<A, WINDOW, DEGREE, DELAY>
where
    A::Line: Deserialize<'de>,
    A::Surface: Deserialize<'de>,
{
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let record = CodeRecord::<A::Line, A::Surface>::deserialize(deserializer)?;
        Self::check(record).map_err(D::Error::custom)
    }
}

impl<A: CodeArithmetic, const WINDOW: usize, const DEGREE: usize, const DELAY: usize>
    CodeCalibration<A, WINDOW, DEGREE, DELAY>
{
    fn check(record: CodeRecord<A::Line, A::Surface>) -> Result<Self, DesignError> {
        let CodeRecord { schema, shape, adc_bits, sample_rate_hz, falling, dead_band, surfaces } =
            record;
        if !(1..=CODE_SCHEMA).contains(&schema) {
            return Err(DesignError::Schema { found: schema, newest: CODE_SCHEMA });
        }
        Self::check_shape(shape)?;
        DesignError::check("adc.bits", adc_bits.into(), (1..=16).contains(&adc_bits))?;
        DesignError::check("dead_band", dead_band.into(), dead_band >= 0)?;
        let spans = match &surfaces {
            CodeMap::Line(ranged) => {
                A::valid_line(&ranged.surface)?;
                ranged.holds()
            }
            CodeMap::Poly13(both) => {
                both.iter().try_for_each(|ranged| A::valid_surface(&ranged.surface))?;
                both.iter().all(CodeSurface::holds)
            }
        };
        DesignError::check("domain", 0.0, spans)?;
        Ok(Self { bits: adc_bits, sample_rate: sample_rate_hz, falling, dead_band, surfaces })
    }
}
