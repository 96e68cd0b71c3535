//! Information about the columns of a fit that is stored with a calibration.

use std::sync::Arc;

use datafusion::{
    arrow::datatypes::FieldRef,
    common::{Result, plan_datafusion_err},
};
use serde::{Deserialize, Serialize};
use stretch_core::{RateEstimator, SampleRate};

/// Metadata key of a field: the sample rate at which the trial's rates were estimated, Hz, as text.
pub const SAMPLE_RATE_KEY: &str = "stretch.sample_rate_hz";

/// Metadata key of a field: the rate estimator, as JSON of [`RateEstimator`].
pub const RATE_ESTIMATOR_KEY: &str = "stretch.rate_estimator";

/// The columns of a fit, and how their rates were estimated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct About {
    pub signal: String,
    pub reference: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample_rate_hz: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_estimator: Option<RateEstimator>,
}

impl About {
    /// Reads the names of the last two columns. Information on the rates may be stored with any
    /// column.
    pub(crate) fn new(fields: &[FieldRef]) -> Result<Self> {
        let [.., signal, reference] = fields else {
            return Err(plan_datafusion_err!("a fit takes a signal and a reference"));
        };
        let hz = said(fields, SAMPLE_RATE_KEY);
        let hz = hz.map(|text| {
            let hz = text.parse().ok().and_then(|hz| SampleRate::new(hz).ok());
            hz.map(SampleRate::hz).ok_or_else(|| unreadable(SAMPLE_RATE_KEY, text))
        });
        Ok(Self {
            signal: signal.name().clone(),
            reference: reference.name().clone(),
            sample_rate_hz: hz.transpose()?,
            rate_estimator: rate_estimator(fields)?,
        })
    }

    pub(crate) fn text(&self) -> Arc<str> {
        // A struct of texts and numbers can always be serialized to JSON.
        serde_json::to_string(self).unwrap_or_default().into()
    }
}

/// Returns the rate estimator in the metadata of the fields.
pub(crate) fn rate_estimator(fields: &[FieldRef]) -> Result<Option<RateEstimator>> {
    let text = said(fields, RATE_ESTIMATOR_KEY);
    let parsed = text
        .map(|text| serde_json::from_str(text).map_err(|_| unreadable(RATE_ESTIMATOR_KEY, text)));
    parsed.transpose()
}

fn said<'a>(fields: &'a [FieldRef], key: &str) -> Option<&'a str> {
    fields.iter().find_map(|field| field.metadata().get(key)).map(String::as_str)
}

fn unreadable(key: &str, text: &str) -> datafusion::error::DataFusionError {
    plan_datafusion_err!(
        "the metadata {key} of a column is {text:?}, which is not valid; ingest the trials again"
    )
}
