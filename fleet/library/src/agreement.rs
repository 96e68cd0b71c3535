//! `agreement(reference, estimate)`: error metrics as an aggregate function.

use std::sync::Arc;

use datafusion::{
    arrow::{
        array::{
            Array, ArrayRef, BinaryBuilder, BooleanArray, Float64Builder, StructArray,
            UInt64Builder,
        },
        datatypes::{DataType, Field, Fields},
    },
    common::{Result, cast::as_float64_array, exec_datafusion_err, exec_err},
    logical_expr::{EmitTo, GroupsAccumulator},
};
use stretch_metrics::{Agreement, AgreementSpec, Delta};

use crate::one::{state_of_each_row, states};

/// Result columns in addition to the counts.
const FIGURES: [(&str, Figure); 13] = [
    ("bias", |a| a.errors().bias()),
    ("mae", |a| a.errors().mae()),
    ("rmse", |a| a.errors().rmse()),
    ("std_dev", |a| a.errors().std_dev()),
    ("max_abs_error", |a| a.errors().max_abs()),
    ("average_error_percent", |a| a.average_error_percent(Delta::Truth)),
    ("rmse_percent", |a| a.rmse_percent(Delta::Truth)),
    ("r_squared", Agreement::r_squared),
    ("correlation", Agreement::correlation),
    ("reference_min", |a| a.truth_range().map(|range| range.min)),
    ("reference_max", |a| a.truth_range().map(|range| range.max)),
    ("estimate_min", |a| a.estimate_range().map(|range| range.min)),
    ("estimate_max", |a| a.estimate_range().map(|range| range.max)),
];

type Figure = fn(&Agreement<f64>) -> Option<f64>;

/// Returns the fields of the result.
pub(crate) fn fields() -> Fields {
    let count = |name: &str| Field::new(name, DataType::UInt64, true);
    let figures = FIGURES.iter().map(|(name, _)| Field::new(*name, DataType::Float64, true));
    [count("rows"), count("rows_left_out")].into_iter().chain(figures).collect()
}

/// The agreements of many groups, 200 bytes each.
#[derive(Debug, Default)]
pub(crate) struct Agreements(Vec<Agreement<f64>>);

impl GroupsAccumulator for Agreements {
    fn update_batch(
        &mut self,
        values: &[ArrayRef],
        groups: &[usize],
        filter: Option<&BooleanArray>,
        total: usize,
    ) -> Result<()> {
        self.0.resize(total.max(self.0.len()), Agreement::new());
        let [reference, estimate] = values else {
            return exec_err!("agreement takes a reference and an estimate");
        };
        let (reference, estimate) = (as_float64_array(reference)?, as_float64_array(estimate)?);
        for (row, &group) in groups.iter().enumerate() {
            if filter.is_some_and(|kept| !(kept.is_valid(row) && kept.value(row))) {
                continue;
            }
            let value = |array: &datafusion::arrow::array::Float64Array| {
                if array.is_valid(row) { array.value(row) } else { f64::NAN }
            };
            // `push` skips values that are not finite, and counts them.
            self.0[group].push(value(reference), value(estimate));
        }
        Ok(())
    }

    fn merge_batch(&mut self, stored: &[ArrayRef], groups: &[usize], total: usize) -> Result<()> {
        self.0.resize(total.max(self.0.len()), Agreement::new());
        if let [stored] = stored {
            for (state, &group) in states(stored)?.iter().zip(groups) {
                let Some(state) = state else { continue };
                let other = read(state)
                    .ok_or_else(|| exec_datafusion_err!("agreement: a partial state is damaged"))?;
                self.0[group].merge(&other);
            }
        }
        Ok(())
    }

    fn state(&mut self, emit: EmitTo) -> Result<Vec<ArrayRef>> {
        let mut builder = BinaryBuilder::new();
        for agreement in emit.take_needed(&mut self.0) {
            builder.append_value(write(&agreement));
        }
        Ok(vec![Arc::new(builder.finish())])
    }

    fn evaluate(&mut self, emit: EmitTo) -> Result<ArrayRef> {
        let (mut rows, mut left_out) = (UInt64Builder::new(), UInt64Builder::new());
        let mut figures = FIGURES.map(|_| Float64Builder::new());
        for agreement in emit.take_needed(&mut self.0) {
            rows.append_value(agreement.count());
            left_out.append_value(agreement.skipped());
            for (builder, (_, figure)) in figures.iter_mut().zip(FIGURES) {
                builder.append_option(figure(&agreement));
            }
        }
        let counts = [Arc::new(rows.finish()) as ArrayRef, Arc::new(left_out.finish())];
        let figures = figures.iter_mut().map(|builder| Arc::new(builder.finish()) as ArrayRef);
        let arrays = counts.into_iter().chain(figures).collect();
        Ok(Arc::new(StructArray::new(fields(), arrays, None)))
    }

    fn convert_to_state(
        &self,
        values: &[ArrayRef],
        filter: Option<&BooleanArray>,
    ) -> Result<Vec<ArrayRef>> {
        state_of_each_row(Self::default(), values, filter)
    }

    fn size(&self) -> usize {
        size_of::<Self>() + self.0.capacity() * size_of::<Agreement<f64>>()
    }
}

/// Counts and sums, as postcard writes them. They are passed between the stages of one query, and never stored.
fn write(agreement: &Agreement<f64>) -> Vec<u8> {
    let AgreementSpec { count, skipped, errors, truth, estimate, products } = agreement.spec();
    let numbers = (count, skipped, errors, truth, estimate, products);
    // Memory takes every number.
    postcard::to_extend(&numbers, Vec::new()).unwrap_or_default()
}

fn read(bytes: &[u8]) -> Option<Agreement<f64>> {
    let (count, skipped, errors, truth, estimate, products) = postcard::from_bytes(bytes).ok()?;
    Agreement::from_spec(AgreementSpec { count, skipped, errors, truth, estimate, products })
}
