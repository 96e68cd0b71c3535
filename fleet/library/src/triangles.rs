//! Partial fits of many groups, stored as triangular factors.

use std::{mem, sync::Arc};

use datafusion::{
    arrow::array::{Array, BooleanArray, Float64Array},
    arrow::buffer::NullBuffer,
    common::{Result, exec_datafusion_err},
    logical_expr::EmitTo,
};
use stretch_core::Degree;
use stretch_fit::{Factor, Sample, SurfaceAccumulator};

use crate::{
    about::About,
    state::{Outcome, Partial, Span, StateError, read, write},
};

/// Number of rows of a group and branch that are collected before they are folded into the factor
/// together.
pub(crate) const ROWS: usize = 128;

/// Largest accepted number, because powers of larger ones overflow `f64`.
const MOST: f64 = 1e15;

/// Collected rows: rates, signals, references.
type Waiting = [[f64; ROWS]; 3];

/// A branch of a group, or the line of a group.
#[derive(Debug, Clone, Copy)]
struct Side<const TERMS: usize> {
    factor: Factor<f64, TERMS>,
    span: Span,
    /// Number of collected rows.
    filled: u8,
}

/// Data shared by the sides of a group.
#[derive(Debug, Clone)]
struct Group {
    left_out: u64,
    /// Metadata of the columns, from these rows or from merged states.
    about: Arc<str>,
    refused: Option<Box<str>>,
}

/// Partial fits of all groups. Index `group * sides + side` holds a side of a group.
///
/// A group needs a triangle per side and, once it receives rows, `3 ROWS` numbers per side: 7.4 kB
/// for poly13. All groups share the work space for folding.
#[derive(Debug)]
pub(crate) struct Triangles<const TERMS: usize> {
    degree: Degree,
    sides: usize,
    empty: Factor<f64, TERMS>,
    block: Box<SurfaceAccumulator<f64, TERMS, ROWS>>,
    own: Arc<str>,
    groups: Vec<Group>,
    places: Vec<Side<TERMS>>,
    /// Collected rows, with the same indices; empty until rows arrive.
    waiting: Vec<Waiting>,
}

impl<const TERMS: usize> Triangles<TERMS> {
    /// Creates fits without any group, for a line (one side) or a surface per branch (two sides).
    pub(crate) fn new(
        block: SurfaceAccumulator<f64, TERMS, ROWS>,
        sides: usize,
        about: &About,
    ) -> Self {
        Self {
            degree: block.degree(),
            sides,
            empty: block.factor(),
            block: Box::new(block),
            own: about.text(),
            groups: Vec::new(),
            places: Vec::new(),
            waiting: Vec::new(),
        }
    }

    /// Returns fits with the same settings and without any group.
    pub(crate) fn of_no_group(&self) -> Self {
        Self {
            block: self.block.clone(),
            own: self.own.clone(),
            groups: Vec::new(),
            places: Vec::new(),
            waiting: Vec::new(),
            ..*self
        }
    }

    pub(crate) fn degree(&self) -> Degree {
        self.degree
    }

    /// Makes room for this number of groups.
    fn grow(&mut self, groups: usize) {
        if self.groups.len() < groups {
            let group = Group { left_out: 0, about: self.own.clone(), refused: None };
            self.groups.resize(groups, group);
            let side = Side { factor: self.empty, span: Span::EMPTY, filled: 0 };
            self.places.resize(groups * self.sides, side);
        }
    }

    /// Takes rows: `rate` of a surface, `signal` and `reference`. Values that are null, not finite
    /// or larger than [`MOST`] are left out and counted. Rows dropped by the filter do not count.
    pub(crate) fn rows(
        &mut self,
        [rate, signal, reference]: [&Float64Array; 3],
        groups: &[usize],
        filter: Option<&BooleanArray>,
        total: usize,
    ) -> Result<()> {
        self.grow(total);
        self.waiting.resize(total * self.sides, [[0.0; ROWS]; 3]);
        let nulls = NullBuffer::union(rate.nulls(), signal.nulls());
        let nulls = NullBuffer::union(nulls.as_ref(), reference.nulls());
        let columns = [rate, signal, reference].map(|column| &column.values()[..groups.len()]);
        let sides = self.sides;
        let is_row = |row: usize| filter.is_none_or(|kept| kept.is_valid(row) && kept.value(row));
        // This is false for NaN, too.
        let is_sound = |row: usize| {
            let [r, v, x] = columns.map(|values| values[row].abs() <= MOST);
            r & v & x & nulls.as_ref().is_none_or(|nulls| nulls.is_valid(row))
        };
        let place =
            |row: usize| groups[row] * sides + usize::from(sides == 2 && columns[0][row] < 0.0);
        let mut row = 0;
        while row < groups.len() {
            let mut end = row + 1;
            if is_row(row) && is_sound(row) {
                // Rows of a trial are consecutive, and a branch lasts for many rows.
                let own = place(row);
                while end < groups.len() && is_row(end) && is_sound(end) && place(end) == own {
                    end += 1;
                }
                self.take(own, columns.map(|values| &values[row..end]))?;
            } else if is_row(row) {
                let left_out = &mut self.groups[groups[row]].left_out;
                *left_out = left_out.saturating_add(1);
            }
            row = end;
        }
        Ok(())
    }

    /// Collects rows of one side.
    fn take(&mut self, place: usize, mut columns: [&[f64]; 3]) -> Result<()> {
        while !columns[0].is_empty() {
            let filled = usize::from(self.places[place].filled);
            let some = columns[0].len().min(ROWS - filled);
            for (waiting, column) in self.waiting[place].iter_mut().zip(&mut columns) {
                let (now, later) = column.split_at(some);
                waiting[filled..filled + some].copy_from_slice(now);
                *column = later;
            }
            self.places[place].filled += some as u8;
            if filled + some == ROWS {
                self.fold(place)?;
            }
        }
        Ok(())
    }

    /// Folds the collected rows of one side into its factor.
    fn fold(&mut self, place: usize) -> Result<()> {
        let side = &mut self.places[place];
        let filled = usize::from(mem::take(&mut side.filled));
        if filled == 0 {
            return Ok(());
        }
        let rows = self.waiting[place].each_ref().map(|values| &values[..filled]);
        for (column, values) in rows.into_iter().enumerate() {
            side.span.widen(column, values);
        }
        let folded = |error| exec_datafusion_err!("rows of a fit: {error}");
        let [rate, volts, value] = rows;
        self.block.exchange(side.factor).map_err(folded)?;
        self.block.push_columns(Sample { rate, volts, value }).map_err(folded)?;
        side.factor = self.block.exchange(self.empty).map_err(folded)?;
        Ok(())
    }

    /// Takes stored states, each with its group index; a null value means that there is no state.
    /// An unusable state makes its group a refusal with an error text.
    pub(crate) fn states<'a>(
        &mut self,
        states: impl Iterator<Item = Option<&'a [u8]>>,
        groups: &[usize],
        filter: Option<&BooleanArray>,
        total: usize,
    ) {
        self.grow(total);
        for (row, (state, &group)) in states.zip(groups).enumerate() {
            let dropped = filter.is_some_and(|kept| !(kept.is_valid(row) && kept.value(row)));
            let Some(state) = state.filter(|_| !dropped) else { continue };
            let known = &self.groups[group].about;
            let merged = match read(state, self.sides, self.degree, known) {
                Ok(Ok(partial)) => self
                    .merge(group, &partial)
                    .map_err(|error| format!("a stored state cannot be merged: {error}").into()),
                Ok(Err(sentence)) => Err(sentence),
                Err(error) => Err(format!("a stored state cannot be merged: {error}").into()),
            };
            if let Err(sentence) = merged {
                self.groups[group].refused.get_or_insert(sentence);
            }
        }
    }

    fn merge(&mut self, group: usize, other: &Partial<TERMS>) -> Result<(), StateError> {
        let places = &mut self.places[group * self.sides..(group + 1) * self.sides];
        let group = &mut self.groups[group];
        if *other.about != *group.about {
            // The columns of a merge are states. The first state provides the names of the source
            // columns.
            let is_fresh = places.iter().all(|side| side.factor.samples() == 0);
            if !is_fresh || group.left_out > 0 {
                let (found, expected) = (other.about.to_string(), group.about.to_string());
                return Err(StateError::Columns { found, expected });
            }
            group.about = other.about.clone();
        }
        group.left_out = group.left_out.saturating_add(other.left_out);
        for (mine, side) in places.iter_mut().zip(&other.sides) {
            if let Some((factor, span)) = side {
                let kind = |_| StateError::Damaged { what: "its degree" };
                mine.factor.merge(factor).map_err(kind)?;
                mine.span = mine.span.joined(span);
            }
        }
        Ok(())
    }

    /// Returns the outcomes of groups and removes them.
    pub(crate) fn outcomes(&mut self, emit: EmitTo) -> Result<Vec<Outcome<TERMS>>> {
        let groups = match emit {
            EmitTo::All => self.groups.len(),
            EmitTo::First(groups) => groups,
        };
        for place in 0..groups * self.sides {
            self.fold(place)?;
        }
        let places = match emit {
            EmitTo::All => EmitTo::All,
            EmitTo::First(groups) => EmitTo::First(groups * self.sides),
        };
        if !self.waiting.is_empty() {
            places.take_needed(&mut self.waiting);
        }
        let sides = places.take_needed(&mut self.places);
        let groups = emit.take_needed(&mut self.groups);
        let outcome = |(group, sides): (Group, &[Side<TERMS>])| {
            let full = |side: usize| {
                let side = sides.get(side).filter(|side| side.factor.samples() > 0)?;
                Some((side.factor, side.span))
            };
            match group.refused {
                Some(sentence) => Err(sentence),
                None => Ok(Partial {
                    left_out: group.left_out,
                    about: group.about,
                    sides: [full(0), full(1)],
                }),
            }
        };
        Ok(groups.into_iter().zip(sides.chunks(self.sides)).map(outcome).collect())
    }

    /// Serializes the outcome of a group.
    pub(crate) fn bytes(&self, outcome: &Outcome<TERMS>) -> Vec<u8> {
        write(self.sides, self.degree, outcome)
    }

    /// Returns the memory in use, bytes.
    pub(crate) fn size(&self) -> usize {
        fn of<T>(v: &Vec<T>) -> usize {
            v.capacity() * size_of::<T>()
        }
        let refused = self.groups.iter().filter_map(|group| group.refused.as_ref());
        size_of::<Self>()
            + size_of::<SurfaceAccumulator<f64, TERMS, ROWS>>()
            + of(&self.groups)
            + of(&self.places)
            + of(&self.waiting)
            + refused.map(|sentence| sentence.len()).sum::<usize>()
    }
}
