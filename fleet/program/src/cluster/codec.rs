//! Query plans that carry the release of our functions.
//!
//! A plan identifies a function only by its name, and another machine may compute something else
//! under that name. Therefore the release is sent with the plan, and a receiver refuses a plan of
//! another release with an error that names both releases. The scheduler checks plans of clients,
//! and an executor checks plans of the scheduler.

use std::{fmt::Debug, sync::Arc};

use datafusion::{
    arrow::datatypes::SchemaRef,
    catalog::TableProvider,
    common::{Result, TableReference, exec_err, not_impl_err},
    datasource::file_format::FileFormatFactory,
    execution::TaskContext,
    logical_expr::{AggregateUDF, Extension, LogicalPlan, ScalarUDF},
    physical_plan::ExecutionPlan,
};
use datafusion_proto::{
    logical_plan::LogicalExtensionCodec,
    physical_plan::{PhysicalExtensionCodec, PhysicalProtoConverterExtension},
};

const MARK: &str = "stretch-fleet ";

/// A release of the functions, and the process that has it.
#[derive(Debug, Clone)]
pub(crate) struct Release {
    /// The process, such as `executor 10.0.0.7:50051`.
    pub(crate) who: String,
    /// The release, such as `0.1.0`.
    pub(crate) version: String,
}

impl Release {
    /// Returns the release with which this program was built.
    pub(crate) fn own(who: impl Into<String>) -> Self {
        Self { who: who.into(), version: stretch_fleet::VERSION.to_owned() }
    }

    fn write(&self, is_ours: bool, buffer: &mut Vec<u8>) {
        if is_ours {
            buffer.extend_from_slice(MARK.as_bytes());
            buffer.extend_from_slice(self.version.as_bytes());
        }
    }

    /// Checks that a function in a plan is one of ours, and of our release.
    fn check(&self, function: &str, buffer: &[u8]) -> Result<()> {
        let text = std::str::from_utf8(buffer).ok().and_then(|text| text.strip_prefix(MARK));
        match text {
            Some(version) if version == self.version => Ok(()),
            Some(version) => exec_err!(
                "{} has stretch-fleet {}, and this query's {function} is of {version}: install one release on all \
                 machines, or stop this one",
                self.who,
                self.version
            ),
            None => not_impl_err!("{} does not know the function {function}", self.who),
        }
    }
}

fn aggregate(name: &str) -> Option<Arc<AggregateUDF>> {
    stretch_fleet::aggregates().into_iter().find(|function| function.name() == name)
}

fn scalar(name: &str) -> Option<Arc<ScalarUDF>> {
    stretch_fleet::scalars().into_iter().find(|function| function.name() == name)
}

/// A codec of Ballista, extended by the release on every function of ours.
#[derive(Debug)]
pub(crate) struct Marked<C> {
    release: Release,
    inner: C,
}

impl<C: Default> Marked<C> {
    pub(crate) fn new(release: &Release) -> Arc<Self> {
        Arc::new(Self { release: release.clone(), inner: C::default() })
    }
}

/// The methods of either codec that write the release behind a function, and check it.
macro_rules! marked_functions {
    () => {
        fn try_decode_udf(&self, name: &str, buffer: &[u8]) -> Result<Arc<ScalarUDF>> {
            self.release.check(name, buffer)?;
            scalar(name).map_or_else(|| not_impl_err!("{name} is not a scalar function"), Ok)
        }

        fn try_encode_udf(&self, node: &ScalarUDF, buffer: &mut Vec<u8>) -> Result<()> {
            self.release.write(scalar(node.name()).is_some(), buffer);
            Ok(())
        }

        fn try_decode_udaf(&self, name: &str, buffer: &[u8]) -> Result<Arc<AggregateUDF>> {
            self.release.check(name, buffer)?;
            aggregate(name).map_or_else(|| not_impl_err!("{name} is not an aggregate function"), Ok)
        }

        fn try_encode_udaf(&self, node: &AggregateUDF, buffer: &mut Vec<u8>) -> Result<()> {
            self.release.write(aggregate(node.name()).is_some(), buffer);
            Ok(())
        }
    };
}

impl<C: LogicalExtensionCodec> LogicalExtensionCodec for Marked<C> {
    fn try_decode(
        &self,
        buffer: &[u8],
        inputs: &[LogicalPlan],
        context: &TaskContext,
    ) -> Result<Extension> {
        self.inner.try_decode(buffer, inputs, context)
    }

    fn try_encode(&self, node: &Extension, buffer: &mut Vec<u8>) -> Result<()> {
        self.inner.try_encode(node, buffer)
    }

    fn try_decode_table_provider(
        &self,
        buffer: &[u8],
        table: &TableReference,
        schema: SchemaRef,
        context: &TaskContext,
    ) -> Result<Arc<dyn TableProvider>> {
        self.inner.try_decode_table_provider(buffer, table, schema, context)
    }

    fn try_encode_table_provider(
        &self,
        table: &TableReference,
        node: Arc<dyn TableProvider>,
        buffer: &mut Vec<u8>,
    ) -> Result<()> {
        self.inner.try_encode_table_provider(table, node, buffer)
    }

    fn try_decode_file_format(
        &self,
        buffer: &[u8],
        context: &TaskContext,
    ) -> Result<Arc<dyn FileFormatFactory>> {
        self.inner.try_decode_file_format(buffer, context)
    }

    fn try_encode_file_format(
        &self,
        buffer: &mut Vec<u8>,
        node: Arc<dyn FileFormatFactory>,
    ) -> Result<()> {
        self.inner.try_encode_file_format(buffer, node)
    }

    marked_functions!();
}

impl<C: PhysicalExtensionCodec> PhysicalExtensionCodec for Marked<C> {
    fn try_decode(
        &self,
        buffer: &[u8],
        inputs: &[Arc<dyn ExecutionPlan>],
        context: &TaskContext,
        converter: &dyn PhysicalProtoConverterExtension,
    ) -> Result<Arc<dyn ExecutionPlan>> {
        self.inner.try_decode(buffer, inputs, context, converter)
    }

    fn try_encode(
        &self,
        node: Arc<dyn ExecutionPlan>,
        buffer: &mut Vec<u8>,
        converter: &dyn PhysicalProtoConverterExtension,
    ) -> Result<()> {
        self.inner.try_encode(node, buffer, converter)
    }

    marked_functions!();
}
