//! The board's calibration, run here beside it.

use std::path::Path;

use stretch_calibrate::{BoardReceptor, read_calibration};
use stretch_core::{Branch, Calibration, RateEstimator, Runner, Volts};
use stretch_receptor::{Receptor, code::AdcCode};

/// What a record says of the stream, and the receptor that it describes.
pub(crate) struct Twin {
    /// Column of the signal.
    pub signal: String,
    /// Unit of the estimate; empty where the record does not say.
    pub unit: String,
    /// Seconds a sample, where the record says so.
    pub period_s: Option<f64>,
    receptor: Own,
}

enum Own {
    Volts(Box<Runner<Receptor<f64>>>),
    Codes(BoardReceptor),
    /// A rate that looks a sample ahead: nothing can be answered live.
    Silent,
}

impl Twin {
    /// Any record of `stretch calibrate` or of `stretch export --fixed`.
    pub(crate) fn read(path: &Path, adc_bits: u8) -> anyhow::Result<Self> {
        let Some(receptor) = BoardReceptor::read(path) else {
            return Self::of(&read_calibration(path)?);
        };
        let bits = receptor.adc_bits();
        anyhow::ensure!(
            bits == adc_bits,
            "{}: this record is for a converter of {bits} bits; name it with --adc {bits},ZERO_V,FULL_SCALE_V",
            path.display()
        );
        Ok(Self {
            signal: "signal".to_owned(),
            unit: String::new(),
            period_s: None,
            receptor: Own::Codes(receptor),
        })
    }

    fn of(calibration: &Calibration) -> anyhow::Result<Self> {
        let receptor = match (Receptor::new(calibration), calibration.spec().rate_estimator) {
            (Ok(receptor), _) => Own::Volts(Box::new(Runner::new(receptor))),
            (Err(_), RateEstimator::CentralDifference) => Own::Silent,
            (Err(error), _) => return Err(error.into()),
        };
        Ok(Self {
            signal: calibration.spec().signal.as_str().to_owned(),
            unit: calibration.spec().reference.unit().to_owned(),
            period_s: Some(calibration.spec().sample_rate_hz.period_s()),
            receptor,
        })
    }

    /// Whether it answers at all.
    pub(crate) fn answers(&self) -> bool {
        !matches!(self.receptor, Own::Silent)
    }

    /// Forgets the stream.
    pub(crate) fn reset(&mut self) {
        match &mut self.receptor {
            Own::Volts(receptor) => receptor.reset(),
            Own::Codes(receptor) => receptor.reset(),
            Own::Silent => {}
        }
    }

    /// The estimate of a sample, in the reference's unit, and its branch.
    pub(crate) fn step(&mut self, code: AdcCode, signal: Option<f64>) -> Option<(f64, Branch)> {
        match &mut self.receptor {
            Own::Volts(receptor) => {
                let reading = receptor.step(Volts(signal.unwrap_or(f64::NAN))).ok()?;
                Some((reading.estimate, reading.branch))
            }
            Own::Codes(receptor) => {
                let reading = receptor.step(code).ok()?;
                Some((f64::from(reading.estimate) / 1000.0, reading.branch))
            }
            Own::Silent => None,
        }
    }
}
