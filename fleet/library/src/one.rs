//! Code shared by the aggregates: queries without groups, a state for each row, and arrays of
//! stored states.

use std::fmt;

use datafusion::{
    arrow::{
        array::{ArrayRef, AsArray, BinaryArray, BooleanArray},
        compute::cast,
        datatypes::DataType,
    },
    common::{Result, ScalarValue, not_impl_err},
    logical_expr::{Accumulator, EmitTo, GroupsAccumulator},
};

/// Returns stored states as binary arrays, whatever binary type the file has.
pub(crate) fn states(array: &ArrayRef) -> Result<BinaryArray> {
    Ok(cast(array, &DataType::Binary)?.as_binary::<i32>().clone())
}

/// Computes a state for each row, using an accumulator without groups.
pub(crate) fn state_of_each_row(
    mut groups: impl GroupsAccumulator,
    values: &[ArrayRef],
    filter: Option<&BooleanArray>,
) -> Result<Vec<ArrayRef>> {
    let rows = values.first().map_or(0, |array| array.len());
    let each: Vec<usize> = (0..rows).collect();
    groups.update_batch(values, &each, filter, rows)?;
    groups.state(EmitTo::All)
}

/// An accumulator of a single group, implemented with an accumulator of many groups.
pub(crate) struct One {
    name: String,
    groups: Box<dyn GroupsAccumulator + Sync>,
    zeros: Vec<usize>,
}

impl fmt::Debug for One {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "One({})", self.name)
    }
}

impl One {
    pub(crate) fn new(name: &str, groups: Box<dyn GroupsAccumulator + Sync>) -> Self {
        Self { name: name.to_owned(), groups, zeros: Vec::new() }
    }

    /// Assigns all rows to the one group.
    fn indices(&mut self, values: &[ArrayRef]) {
        self.zeros.resize(values.first().map_or(0, |array| array.len()), 0);
    }
}

impl Accumulator for One {
    fn update_batch(&mut self, values: &[ArrayRef]) -> Result<()> {
        self.indices(values);
        self.groups.update_batch(values, &self.zeros, None, 1)
    }

    fn merge_batch(&mut self, states: &[ArrayRef]) -> Result<()> {
        self.indices(states);
        self.groups.merge_batch(states, &self.zeros, 1)
    }

    /// Returns the result so far. A window function evaluates repeatedly while rows are added, so
    /// the state must be preserved.
    fn evaluate(&mut self) -> Result<ScalarValue> {
        let state = self.state()?;
        let arrays = state.iter().map(ScalarValue::to_array).collect::<Result<Vec<_>>>()?;
        self.merge_batch(&arrays)?;
        let answer = self.groups.evaluate(EmitTo::All)?;
        self.merge_batch(&arrays)?;
        ScalarValue::try_from_array(&answer, 0)
    }

    fn state(&mut self) -> Result<Vec<ScalarValue>> {
        // Creates the group even if there were no rows.
        self.groups.merge_batch(&[], &[], 1)?;
        let state = self.groups.state(EmitTo::All)?;
        state.iter().map(|array| ScalarValue::try_from_array(array, 0)).collect()
    }

    fn size(&self) -> usize {
        self.groups.size() + self.zeros.capacity() * size_of::<usize>()
    }

    fn retract_batch(&mut self, _: &[ArrayRef]) -> Result<()> {
        not_impl_err!(
            "{} cannot remove a row from its sums, so that a sliding window is not possible: use a frame that begins at \
             UNBOUNDED PRECEDING, or group by the time",
            self.name
        )
    }
}
