//! The aggregate functions: the fits `poly13_fit`, `linear_fit`, `polyij_fit`, `poly13_state` and `poly13_merge`, and
//! `agreement`.

use std::sync::Arc;

use datafusion::{
    arrow::{
        array::{ArrayRef, BinaryBuilder, BooleanArray, RecordBatch},
        datatypes::{DataType, Field, FieldRef, Schema},
    },
    common::{Result, ScalarValue, cast::as_float64_array, plan_datafusion_err},
    logical_expr::{
        Accumulator, AggregateUDF, AggregateUDFImpl, ColumnarValue, EmitTo, GroupsAccumulator,
        Signature, TypeSignature, Volatility,
        function::{AccumulatorArgs, StateFieldsArgs},
    },
    physical_plan::PhysicalExpr,
};
use stretch_core::{Degree, MAX_DEGREE, MAX_TERMS};

use crate::{
    about::About,
    agreement::{self, Agreements},
    answer::{answers, fields},
    one::{One, state_of_each_row, states},
    triangles::{Outcome, Triangles},
};

/// Numbers of terms of the most frequent fits, used as capacities.
const LINE: usize = Degree::LINE.terms();
const POLY13: usize = Degree::POLY13.terms();

/// The aggregate functions of this file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Kind {
    Poly13,
    Line,
    PolyIj,
    State,
    Merge,
    Agreement,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Poly13 => "poly13_fit",
            Self::Line => "linear_fit",
            Self::PolyIj => "polyij_fit",
            Self::State => "poly13_state",
            Self::Merge => "poly13_merge",
            Self::Agreement => "agreement",
        }
    }

    fn signature(self) -> Signature {
        use DataType::{Binary, BinaryView, Float64, Int64, LargeBinary};
        let types = match self {
            Self::Poly13 | Self::State => TypeSignature::Exact(vec![Float64; 3]),
            Self::Line | Self::Agreement => TypeSignature::Exact(vec![Float64; 2]),
            Self::PolyIj => TypeSignature::Exact(vec![Int64, Int64, Float64, Float64, Float64]),
            Self::Merge => TypeSignature::Uniform(1, vec![BinaryView, Binary, LargeBinary]),
        };
        Signature::new(types, Volatility::Immutable)
    }

    /// Returns the number of arguments before the columns.
    fn literals(self) -> usize {
        if self == Self::PolyIj { 2 } else { 0 }
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
    use Kind::{Agreement, Line, Merge, Poly13, PolyIj, State};
    [Poly13, Line, PolyIj, State, Merge, Agreement].into_iter().map(|kind| {
        let signature = kind.signature();
        Arc::new(AggregateUDF::new_from_impl(Function { kind, signature }))
    })
}

impl Function {
    fn groups(&self, args: &AccumulatorArgs) -> Result<Box<dyn GroupsAccumulator + Sync>> {
        if self.kind == Kind::Agreement {
            return Ok(Box::<Agreements>::default());
        }
        let degree = self.degree(args)?;
        Ok(match degree.terms() {
            terms if terms <= LINE => Box::new(self.fits::<LINE>(degree, args)?),
            terms if terms <= POLY13 => Box::new(self.fits::<POLY13>(degree, args)?),
            _ => Box::new(self.fits::<MAX_TERMS>(degree, args)?),
        })
    }

    fn degree(&self, args: &AccumulatorArgs) -> Result<Degree> {
        match self.kind {
            Kind::PolyIj => {
                let (rate, signal) = (power(&args.exprs[0], "i")?, power(&args.exprs[1], "j")?);
                Degree::new(rate, signal)
                    .map_err(|error| plan_datafusion_err!("polyij_fit: {error}"))
            }
            Kind::Line => Ok(Degree::LINE),
            _ => Ok(Degree::POLY13),
        }
    }

    fn fits<const TERMS: usize>(
        &self,
        degree: Degree,
        args: &AccumulatorArgs,
    ) -> Result<Fits<TERMS>> {
        let about = match self.kind {
            Kind::Merge => About::new(&[args.expr_fields[0].clone(), args.expr_fields[0].clone()])?,
            kind => About::new(&args.expr_fields[kind.literals()..])?,
        };
        let sides = if self.kind == Kind::Line { 1 } else { 2 };
        let triangles = Triangles::new(degree, sides, &about)
            .map_err(|error| plan_datafusion_err!("{}: {error}", self.kind.name()))?;
        Ok(Fits { kind: self.kind, triangles })
    }
}

/// Returns a power that is written as a literal in the query.
fn power(expr: &Arc<dyn PhysicalExpr>, name: &str) -> Result<u8> {
    // A literal can be evaluated without rows. Evaluating it also works for expression types of
    // another library.
    let nothing = RecordBatch::new_empty(Arc::new(Schema::empty()));
    match expr.evaluate(&nothing) {
        Ok(ColumnarValue::Scalar(ScalarValue::Int64(Some(power))))
            if (0..=MAX_DEGREE as i64).contains(&power) =>
        {
            Ok(power as u8)
        }
        _ => Err(plan_datafusion_err!(
            "polyij_fit: {name} is {expr}, but must be a number from 0 to {MAX_DEGREE} that is written in the query"
        )),
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
            Kind::Agreement => DataType::Struct(agreement::fields()),
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
        let mut state = Vec::new();
        for outcome in outcomes {
            state.clear();
            self.triangles.write(&mut state, outcome);
            builder.append_value(&state);
        }
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
        let columns = values[self.kind.literals()..].iter().map(|array| as_float64_array(array));
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
