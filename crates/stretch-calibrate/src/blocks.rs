//! A log in blocks of rows, and the rows of the log that hold gross errors.

use stretch_data::Trial;

use crate::{
    CalibrateError,
    clusters::Clusters,
    gross_errors::{MOST_SHARE, rows, sentence},
};

/// Longest log, in rows, that is held as a whole where the model can also be fitted block by block. At about a
/// hundred bytes a row such a log takes a quarter of a gigabyte, together with the memory for reading and fitting.
pub const LONGEST: u64 = 1_500_000;

/// A log that can be read again and again, block by block.
///
/// The function is given the trial's number, from 0 on, and a block of the trial's rows, in the order of time.
pub type Log<'a> = dyn Fn(&mut dyn FnMut(usize, Trial) -> Result<(), CalibrateError>) -> Result<(), CalibrateError>
    + 'a;

/// The values of each column that are gross errors.
pub(crate) struct GrossErrors<'a> {
    spans: Vec<(&'a str, f64, f64)>,
    /// A sentence for each column that has gross errors.
    pub sentences: Vec<String>,
}

impl<'a> GrossErrors<'a> {
    /// The first pass: finds the gross errors of the reference and of the signal.
    pub(crate) fn of(log: &Log<'_>, columns: [&'a str; 2]) -> Result<Self, CalibrateError> {
        let mut seen: [Clusters; 2] = Default::default();
        log(&mut |_, block| {
            for (clusters, column) in seen.iter_mut().zip(columns) {
                block.require(column)?.iter().for_each(|&x| clusters.take(x));
            }
            Ok(())
        })?;
        let (mut spans, mut sentences) = (Vec::new(), Vec::new());
        for (clusters, column) in seen.iter().zip(columns) {
            let most = (MOST_SHARE * clusters.count() as f64) as u64;
            if let Some((low, high, beyond)) = clusters.span(most) {
                let ends = clusters.beyond(low, high);
                sentences.push(sentence(column, (beyond, clusters.count()), ends, (low, high)));
                spans.push((column, low, high));
            }
        }
        Ok(Self { spans, sentences })
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
