//! `strain_estimate(record, rate, signal)`: a calibration over rows.

use std::sync::Arc;

use datafusion::{
    arrow::{
        array::{Array, ArrayRef, AsArray, Float64Builder},
        datatypes::DataType,
    },
    common::{Result, ScalarValue, exec_datafusion_err, exec_err},
    logical_expr::{
        ColumnarValue, ScalarFunctionArgs, ScalarUDF, ScalarUDFImpl, Signature, TypeSignature,
        Volatility,
    },
};
use stretch_calibrate::calibration_from_json;
use stretch_core::{Branch, Model, RateEstimator};
use stretch_receptor::StretchReceptor;

use crate::{about::rate_estimator, columns::floats};

const NAME: &str = "strain_estimate";

#[derive(Debug, PartialEq, Eq, Hash)]
struct EstimateFunction {
    signature: Signature,
}

/// The function.
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
        let (rate, signal) = (floats(&rate)?, floats(&signal)?);
        let mut map = Latest::new(estimator);
        let mut out = Float64Builder::with_capacity(rows);
        let mut row = |at: usize, record: Option<&str>| -> Result<()> {
            let known = record.filter(|_| rate.is_valid(at) && signal.is_valid(at));
            let estimate = match known {
                Some(record) => map.of(record)?.at(rate.value(at), signal.value(at)),
                None => None,
            };
            out.append_option(estimate);
            Ok(())
        };
        match record {
            ColumnarValue::Scalar(record) => {
                let record = record.try_as_str().flatten();
                (0..rows).try_for_each(|at| row(at, record))?;
            }
            ColumnarValue::Array(records) => {
                texts(records)?.enumerate().try_for_each(|(at, record)| row(at, record))?;
            }
        }
        let out = out.finish();
        let are_scalars = args.args.iter().all(|arg| matches!(arg, ColumnarValue::Scalar(_)));
        if are_scalars && rows == 1 {
            return ScalarValue::try_from_array(&out, 0).map(ColumnarValue::Scalar);
        }
        Ok(ColumnarValue::Array(Arc::new(out)))
    }
}

fn texts(array: &ArrayRef) -> Result<Box<dyn Iterator<Item = Option<&str>> + '_>> {
    match array.data_type() {
        DataType::Utf8 => Ok(Box::new(array.as_string::<i32>().iter())),
        DataType::LargeUtf8 => Ok(Box::new(array.as_string::<i64>().iter())),
        DataType::Utf8View => Ok(Box::new(array.as_string_view().iter())),
        other => exec_err!("{NAME}: a record is text, not {other}"),
    }
}

/// The record of the latest row, because rows of one sensor are adjacent.
struct Latest {
    estimator: Option<RateEstimator>,
    known: Option<(String, Map)>,
}

impl Latest {
    fn new(estimator: Option<RateEstimator>) -> Self {
        Self { estimator, known: None }
    }

    fn of(&mut self, record: &str) -> Result<&Map> {
        if self.known.as_ref().is_none_or(|(text, _)| text != record) {
            self.known = Some((record.to_owned(), Map::new(record, self.estimator)?));
        }
        match &self.known {
            Some((_, map)) => Ok(map),
            None => exec_err!("{NAME}: no record"),
        }
    }
}

/// A calibration that needs no memory: a line, or one surface per branch.
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
                "{NAME}: the rates are by {} ({estimator:?}), and the record was fitted on those by {} ({:?}): ingest \
                 again with the record's estimator, or fit a record of this lake",
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
                    "{NAME}: the record's model, {}, remembers what was before, and rows of a table have no order: use \
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

    /// The estimate of a row. Inside the dead band a live receptor keeps its branch. Here only the
    /// sign of the rate decides, because rows have no order.
    fn at(&self, rate: f64, signal: f64) -> Option<f64> {
        if !(rate.is_finite() && signal.is_finite()) {
            return None;
        }
        let rises = self.sign * rate >= 0.0;
        let branch = if rises { Branch::Inflation } else { Branch::Deflation };
        Some(self.receptor.at(branch, rate, signal).estimate)
    }
}
