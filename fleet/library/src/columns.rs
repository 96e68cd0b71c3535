//! Arrays as what they are.

use std::any::type_name;

use datafusion::{
    arrow::array::{Array, ArrayRef, AsArray, Float64Array},
    arrow::datatypes::{DataType, Float64Type},
    common::{Result, exec_datafusion_err, exec_err},
};

/// An array of numbers.
pub(crate) fn floats(array: &ArrayRef) -> Result<&Float64Array> {
    array.as_primitive_opt::<Float64Type>().ok_or_else(|| {
        exec_datafusion_err!("{} was expected, and {} came", type_name::<f64>(), array.data_type())
    })
}

/// The bytes of each row, whatever kind of binary the file had.
pub(crate) fn bytes(array: &ArrayRef) -> Result<Box<dyn Iterator<Item = Option<&[u8]>> + '_>> {
    match array.data_type() {
        DataType::Binary => Ok(Box::new(array.as_binary::<i32>().iter())),
        DataType::LargeBinary => Ok(Box::new(array.as_binary::<i64>().iter())),
        DataType::BinaryView => Ok(Box::new(array.as_binary_view().iter())),
        other => exec_err!("a state is bytes, not {other}"),
    }
}
