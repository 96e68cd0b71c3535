//! A log in blocks of rows, and the rows in it that no motion can have made.

use stretch_data::Trial;

use crate::{
    CalibrateError,
    clusters::Clusters,
    gross_errors::{MOST_SHARE, rows, sentence},
};

/// Rows in all beyond which a log is not held as a whole where the model does not need it: at a hundred bytes a row,
/// a quarter of a gigabyte with what is read and fitted.
pub const LONGEST: u64 = 1_500_000;

/// A log that can be read again and again, block by block.
///
/// The function is given the trial's number, from 0 on, and a block of its rows, in the order of time.
pub type Log<'a> = dyn Fn(&mut dyn FnMut(usize, Trial) -> Result<(), CalibrateError>) -> Result<(), CalibrateError>
    + 'a;

/// What has a gross error in each column.
pub(crate) struct GrossErrors<'a> {
    spans: Vec<(&'a str, f64, f64)>,
    /// A sentence for each column that has some.
    pub told: Vec<String>,
}

impl<'a> GrossErrors<'a> {
    /// The first pass: what has a gross error in the reference and in the signal.
    pub(crate) fn of(log: &Log<'_>, columns: [&'a str; 2]) -> Result<Self, CalibrateError> {
        let mut seen: [Clusters; 2] = Default::default();
        log(&mut |_, block| {
            for (clusters, column) in seen.iter_mut().zip(columns) {
                block.require(column)?.iter().for_each(|&x| clusters.take(x));
            }
            Ok(())
        })?;
        let (mut spans, mut told) = (Vec::new(), Vec::new());
        for (clusters, column) in seen.iter().zip(columns) {
            let most = (MOST_SHARE * clusters.count() as f64) as u64;
            if let Some((low, high, beyond)) = clusters.span(most) {
                let ends = clusters.beyond(low, high);
                told.push(sentence(column, (beyond, clusters.count()), ends, (low, high)));
                spans.push((column, low, high));
            }
        }
        Ok(Self { spans, told })
    }

    /// A block without the rows in which a column has a gross error.
    pub(crate) fn without(&self, mut block: Trial) -> Trial {
        for (column, low, high) in &self.spans {
            let Some(own) = block.channel(column) else { continue };
            let stays: Vec<bool> = own.iter().map(|x| (*low..=*high).contains(x)).collect();
            block = rows(&block, &stays);
        }
        block
    }
}
