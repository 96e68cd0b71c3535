//! What rows span.

/// Smallest and largest rate, signal and reference of some rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Span {
    /// Rate, signal, reference.
    pub least: [f64; 3],
    /// The same.
    pub most: [f64; 3],
}

impl Span {
    /// Of no rows.
    pub(crate) const EMPTY: Self = Self { least: [f64::INFINITY; 3], most: [f64::NEG_INFINITY; 3] };

    /// Takes in values of one column, which are numbers.
    pub(crate) fn widen(&mut self, column: usize, values: &[f64]) {
        // four side by side, and comparisons that are one instruction each
        let less = |a: f64, b: f64| if a < b { a } else { b };
        let more = |a: f64, b: f64| if a > b { a } else { b };
        let (mut least, mut most) = ([self.least[column]; 4], [self.most[column]; 4]);
        let (fours, rest) = values.as_chunks::<4>();
        for four in fours {
            for lane in 0..4 {
                least[lane] = less(four[lane], least[lane]);
                most[lane] = more(four[lane], most[lane]);
            }
        }
        self.least[column] = least.into_iter().chain(rest.iter().copied()).fold(least[0], less);
        self.most[column] = most.into_iter().chain(rest.iter().copied()).fold(most[0], more);
    }

    /// The span of both.
    pub(crate) fn joined(&self, other: &Self) -> Self {
        let mut joined = *self;
        for column in 0..3 {
            joined.least[column] = joined.least[column].min(other.least[column]);
            joined.most[column] = joined.most[column].max(other.most[column]);
        }
        joined
    }

    /// From the least to the greatest of a column.
    pub(crate) fn width(&self, column: usize) -> f64 {
        self.most[column] - self.least[column]
    }
}
