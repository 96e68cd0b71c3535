//! The aggregate functions: the fits `poly13_fit`, `linear_fit`, `poly13_state` and `poly13_merge`.

use std::sync::Arc;

use datafusion::{
    arrow::{
        array::{ArrayRef, BinaryBuilder, BooleanArray},
        datatypes::{DataType, Field, FieldRef},
    },
    common::{Result, cast::as_float64_array, plan_datafusion_err},
    logical_expr::{
        Accumulator, AggregateUDF, AggregateUDFImpl, EmitTo, GroupsAccumulator, Signature,
        TypeSignature, Volatility,
        function::{AccumulatorArgs, StateFieldsArgs},
    },
};
use stretch_core::Degree;
use stretch_fit::SurfaceAccumulator;

use crate::{
    about::About,
    answer::{answers, fields},
    one::{One, state_of_each_row, states},
    state::Outcome,
    triangles::{ROWS, Triangles},
};

/// Numbers of terms of the fits.
const LINE: usize = Degree::LINE.terms();
const POLY13: usize = Degree::POLY13.terms();

/// The aggregate functions of this file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Kind {
    Poly13,
    Line,
    State,
    Merge,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Poly13 => "poly13_fit",
            Self::Line => "linear_fit",
            Self::State => "poly13_state",
            Self::Merge => "poly13_merge",
        }
    }

    fn signature(self) -> Signature {
        use DataType::{Binary, BinaryView, Float64, LargeBinary};
        let types = match self {
            Self::Poly13 | Self::State => TypeSignature::Exact(vec![Float64; 3]),
            Self::Line => TypeSignature::Exact(vec![Float64; 2]),
            Self::Merge => TypeSignature::Uniform(1, vec![BinaryView, Binary, LargeBinary]),
        };
        Signature::new(types, Volatility::Immutable)
    }
}

/// An aggregate function of SQL.
#[derive(Debug, PartialEq, Eq, Hash)]
struct Function {
    kind: Kind,
    signature: Signature,
}

/// Returns all aggregate functions of this file.
pub(crate) fn functions() -> impl Iterator<Item = Arc<AggregateUDF>> {
    [Kind::Poly13, Kind::Line, Kind::State, Kind::Merge].into_iter().map(|kind| {
        let signature = kind.signature();
        Arc::new(AggregateUDF::new_from_impl(Function { kind, signature }))
    })
}

impl Function {
    fn groups(&self, args: &AccumulatorArgs) -> Result<Box<dyn GroupsAccumulator + Sync>> {
        Ok(match self.kind {
            Kind::Line => {
                Box::new(self.fits(SurfaceAccumulator::<_, LINE, _>::of::<0, 1>(), args)?)
            }
            _ => Box::new(self.fits(SurfaceAccumulator::<_, POLY13, _>::of::<1, 3>(), args)?),
        })
    }

    fn fits<const TERMS: usize>(
        &self,
        block: SurfaceAccumulator<f64, TERMS, ROWS>,
        args: &AccumulatorArgs,
    ) -> Result<Fits<TERMS>> {
        let about = match self.kind {
            Kind::Merge => About::new(&[args.expr_fields[0].clone(), args.expr_fields[0].clone()])?,
            _ => About::new(args.expr_fields)?,
        };
        let sides = if self.kind == Kind::Line { 1 } else { 2 };
        Ok(Fits { kind: self.kind, triangles: Triangles::new(block, sides, &about) })
    }
}

impl AggregateUDFImpl for Function {
    fn name(&self) -> &str {
        self.kind.name()
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        Ok(match self.kind {
            Kind::State => DataType::Binary,
            _ => DataType::Struct(fields()),
        })
    }

    fn state_fields(&self, args: StateFieldsArgs) -> Result<Vec<FieldRef>> {
        let name = format!("{}[state]", args.name);
        Ok(vec![Arc::new(Field::new(name, DataType::Binary, true))])
    }

    fn accumulator(&self, args: AccumulatorArgs) -> Result<Box<dyn Accumulator>> {
        Ok(Box::new(One::new(self.name(), self.groups(&args)?)))
    }

    fn groups_accumulator_supported(&self, args: AccumulatorArgs) -> bool {
        !args.is_distinct
    }

    fn create_groups_accumulator(
        &self,
        args: AccumulatorArgs,
    ) -> Result<Box<dyn GroupsAccumulator>> {
        Ok(self.groups(&args)?)
    }

    fn order_sensitivity(&self) -> datafusion::logical_expr::utils::AggregateOrderSensitivity {
        datafusion::logical_expr::utils::AggregateOrderSensitivity::Insensitive
    }
}

/// The fits of many groups.
#[derive(Debug)]
struct Fits<const TERMS: usize> {
    kind: Kind,
    triangles: Triangles<TERMS>,
}

impl<const TERMS: usize> Fits<TERMS> {
    fn bytes(&self, outcomes: &[Outcome<TERMS>]) -> ArrayRef {
        let mut builder = BinaryBuilder::new();
        outcomes.iter().for_each(|outcome| builder.append_value(self.triangles.bytes(outcome)));
        Arc::new(builder.finish())
    }

    fn merge(
        &mut self,
        stored: &[ArrayRef],
        groups: &[usize],
        filter: Option<&BooleanArray>,
        total: usize,
    ) -> Result<()> {
        match stored {
            [stored] => self.triangles.states(states(stored)?.iter(), groups, filter, total),
            _ => self.triangles.states(std::iter::empty(), groups, filter, total),
        }
        Ok(())
    }
}

impl<const TERMS: usize> GroupsAccumulator for Fits<TERMS> {
    fn update_batch(
        &mut self,
        values: &[ArrayRef],
        groups: &[usize],
        filter: Option<&BooleanArray>,
        total: usize,
    ) -> Result<()> {
        if self.kind == Kind::Merge {
            return self.merge(values, groups, filter, total);
        }
        let columns = values.iter().map(|array| as_float64_array(array));
        let columns = match columns.collect::<Result<Vec<_>>>()?[..] {
            // A line has no rate. The signal is passed in place of it, and is not used.
            [signal, reference] => [signal, signal, reference],
            [rate, signal, reference] => [rate, signal, reference],
            _ => return Err(plan_datafusion_err!("{}: columns are missing", self.kind.name())),
        };
        self.triangles.rows(columns, groups, filter, total)
    }

    fn merge_batch(&mut self, states: &[ArrayRef], groups: &[usize], total: usize) -> Result<()> {
        self.merge(states, groups, None, total)
    }

    fn state(&mut self, emit: EmitTo) -> Result<Vec<ArrayRef>> {
        let outcomes = self.triangles.outcomes(emit)?;
        Ok(vec![self.bytes(&outcomes)])
    }

    fn evaluate(&mut self, emit: EmitTo) -> Result<ArrayRef> {
        let outcomes = self.triangles.outcomes(emit)?;
        Ok(match self.kind {
            Kind::State => self.bytes(&outcomes),
            kind => answers(self.triangles.degree(), kind == Kind::Line, &outcomes),
        })
    }

    fn convert_to_state(
        &self,
        values: &[ArrayRef],
        filter: Option<&BooleanArray>,
    ) -> Result<Vec<ArrayRef>> {
        let empty = Self { kind: self.kind, triangles: self.triangles.of_no_group() };
        state_of_each_row(empty, values, filter)
    }

    fn size(&self) -> usize {
        self.triangles.size()
    }
}
