//! The serialised form of a converted calibration, which is checked while it loads.

use serde::{Deserialize, Serialize};
use stretch_core::{DesignError, SampleRate};

use super::{
    calibration::{CODE_SCHEMA, FixedCalibration},
    code_map::{CodeMap, CodeSurface},
    scaled::FixedMap,
};

#[derive(Serialize, Deserialize)]
pub(super) struct CodeRecord {
    /// Schema version. This field is first, so that a newer schema is refused before the rest is read.
    schema: u32,
    /// Window, degree and delay of the rate estimator.
    shape: (u16, u8, u16),
    adc_bits: u8,
    sample_rate_hz: SampleRate,
    falling: bool,
    dead_band: i32,
    #[serde(rename = "sheets")]
    surfaces: FixedMap,
}

impl<const WINDOW: usize, const DEGREE: usize, const DELAY: usize>
    From<FixedCalibration<WINDOW, DEGREE, DELAY>> for CodeRecord
{
    fn from(own: FixedCalibration<WINDOW, DEGREE, DELAY>) -> Self {
        Self {
            schema: CODE_SCHEMA,
            shape: (WINDOW as u16, DEGREE as u8, DELAY as u16),
            adc_bits: own.bits,
            sample_rate_hz: own.sample_rate,
            falling: own.falling,
            dead_band: own.dead_band,
            surfaces: own.surfaces,
        }
    }
}

impl<const WINDOW: usize, const DEGREE: usize, const DELAY: usize> TryFrom<CodeRecord>
    for FixedCalibration<WINDOW, DEGREE, DELAY>
{
    type Error = DesignError;

    fn try_from(record: CodeRecord) -> Result<Self, DesignError> {
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
                ranged.surface.check()?;
                ranged.holds()
            }
            CodeMap::Poly13(both) => {
                both.iter().try_for_each(|ranged| ranged.surface.check())?;
                both.iter().all(CodeSurface::holds)
            }
        };
        DesignError::check("domain", 0.0, spans)?;
        Ok(Self { bits: adc_bits, sample_rate: sample_rate_hz, falling, dead_band, surfaces })
    }
}
