//! `strain_estimate(record, rate, signal)`: applies a calibration to rows.

use std::{iter::repeat_n, sync::Arc};

use datafusion::{
    arrow::{
        array::{Array, AsArray, Float64Array},
        compute::cast,
        datatypes::DataType,
    },
    common::{Result, cast::as_float64_array, exec_datafusion_err, exec_err},
    logical_expr::{
        ColumnarValue, ScalarFunctionArgs, ScalarUDF, ScalarUDFImpl, Signature, TypeSignature,
        Volatility,
    },
};
use stretch_calibrate::calibration_from_json;
use stretch_core::{Branch, Model, RateEstimator};
use stretch_receptor::StretchReceptor;

use crate::about::rate_estimator;

const NAME: &str = "strain_estimate";

#[derive(Debug, PartialEq, Eq, Hash)]
struct EstimateFunction {
    signature: Signature,
}

/// Returns the scalar function.
pub(crate) fn function() -> Arc<ScalarUDF> {
    use DataType::{Float64, LargeUtf8, Utf8, Utf8View};
    let of = |text| TypeSignature::Exact(vec![text, Float64, Float64]);
    let types = TypeSignature::OneOf([Utf8, Utf8View, LargeUtf8].map(of).to_vec());
    let signature = Signature::new(types, Volatility::Immutable);
    Arc::new(ScalarUDF::new_from_impl(EstimateFunction { signature }))
}

impl ScalarUDFImpl for EstimateFunction {
    fn name(&self) -> &str {
        NAME
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        Ok(DataType::Float64)
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        let rows = args.number_rows;
        let estimator = rate_estimator(args.arg_fields.get(1..2).unwrap_or_default())?;
        let [record, rate, signal] = &args.args[..] else {
            return exec_err!("{NAME} takes a record, a rate and a signal");
        };
        let (rate, signal) = (rate.to_array(rows)?, signal.to_array(rows)?);
        let (rate, signal) = (as_float64_array(&rate)?, as_float64_array(&signal)?);
        let texts;
        let records: Box<dyn Iterator<Item = Option<&str>>> = match record {
            ColumnarValue::Scalar(record) => {
                Box::new(repeat_n(record.try_as_str().flatten(), rows))
            }
            ColumnarValue::Array(records) => {
                texts = cast(records, &DataType::Utf8View)?;
                Box::new(texts.as_string_view().iter())
            }
        };
        // Only the calibration of the latest row is kept, because rows of one sensor are adjacent.
        let mut latest: Option<(&str, Map)> = None;
        let estimates = records.enumerate().map(|(at, record)| {
            let known = record.filter(|_| rate.is_valid(at) && signal.is_valid(at));
            let Some(record) = known else { return Ok(None) };
            if latest.as_ref().is_none_or(|(text, _)| *text != record) {
                latest = Some((record, Map::new(record, estimator)?));
            }
            Ok(latest.as_ref().and_then(|(_, map)| map.at(rate.value(at), signal.value(at))))
        });
        let estimates: Float64Array = estimates.collect::<Result<_>>()?;
        Ok(ColumnarValue::Array(Arc::new(estimates)))
    }
}

/// A calibration without memory: a line, or one surface per branch.
struct Map {
    receptor: StretchReceptor<f64, ()>,
    sign: f64,
}

impl Map {
    fn new(record: &str, estimator: Option<RateEstimator>) -> Result<Self> {
        let refuse = |error: &dyn std::fmt::Display| exec_datafusion_err!("{NAME}: {error}");
        let calibration = calibration_from_json(record, "record").map_err(|e| refuse(&e))?;
        if let Some(estimator) = estimator.filter(|e| *e != calibration.spec().rate_estimator) {
            return exec_err!(
                "{NAME}: the rates of the table come from {} ({estimator:?}), but the calibration was fitted with {} ({:?}): ingest \
                 again with the estimator of the calibration, or use a calibration that was fitted on this lake",
                estimator.name(),
                calibration.spec().rate_estimator.name(),
                calibration.spec().rate_estimator
            );
        }
        let receptor = match calibration.spec().model {
            Model::Linear(_) | Model::Surfaces { .. } => {
                StretchReceptor::with_rate(&calibration, ())
            }
            _ => {
                return exec_err!(
                    "{NAME}: the model of the calibration ({}) depends on earlier samples, but rows of a table have no order: use \
                     stretch apply on the trial",
                    calibration.spec().model.name()
                );
            }
        };
        Ok(Self {
            receptor: receptor.map_err(|e| refuse(&e))?,
            sign: calibration.spec().polarity.sign(),
        })
    }

    /// Returns the estimate of a row. A live receptor keeps its branch inside the dead band. Here
    /// only the sign of the rate selects the branch, because rows have no order.
    fn at(&self, rate: f64, signal: f64) -> Option<f64> {
        if !(rate.is_finite() && signal.is_finite()) {
            return None;
        }
        let rises = self.sign * rate >= 0.0;
        let branch = if rises { Branch::Inflation } else { Branch::Deflation };
        Some(self.receptor.at(branch, rate, signal).estimate)
    }
}
