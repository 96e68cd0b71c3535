//! Shortens recordings that are too long for a diagnosis in memory.

use std::borrow::Cow;

use stretch_data::{Channel, SessionTrial, Trial, check_rows};

use crate::error::ProblemError;

/// Greatest product of rows and simulated outputs: 40 minutes of a gauge at 100 Hz, or 13 minutes
/// of a rig, which has three outputs.
///
/// A diagnosis needs 550 to 950 bytes for each row and output. It therefore needs less than 256 MB
/// and less than four times the size of the recordings.
const MOST_SAMPLES: usize = 240_000;
/// A trial that is cut keeps at least this many rows.
const LEAST: usize = 1000;

/// Returns the trials, or their beginnings if all trials together are too long, with a note on the
/// parts that are left out.
///
/// All trials that are cut keep the same number of rows; shorter trials stay whole.
///
/// # Errors
/// [`DataError::TooLong`](stretch_data::DataError::TooLong) if beginnings of 1000 rows would still
/// be too long.
pub(crate) fn shortened(
    trials: &[SessionTrial],
    outputs: usize,
) -> Result<(Cow<'_, [SessionTrial]>, Option<String>), ProblemError> {
    let most = MOST_SAMPLES / outputs.max(1);
    let Err(too_long) = check_rows(trials.iter().map(|own| &own.trial), most) else {
        return Ok((Cow::Borrowed(trials), None));
    };
    let rows = longest(trials.iter().map(|own| own.trial.time_s.len()).collect(), most);
    if rows < LEAST {
        return Err(too_long.into());
    }
    let cut: Vec<&str> = trials
        .iter()
        .filter(|own| own.trial.time_s.len() > rows)
        .map(|own| own.trial.name.as_str())
        .collect();
    let others = match cut.len() - 1 {
        0 => String::new(),
        more => format!(" and of {more} more recordings each"),
    };
    let note = format!(
        "only the first {rows} rows of {}{others} are used, because a diagnosis takes {most} rows in all; cut the recordings to choose another part",
        cut[0],
    );
    Ok((trials.iter().map(|own| beginning(own, rows)).collect(), Some(note)))
}

/// The number of rows to which long trials are cut so that all trials together have at most `most`
/// rows.
fn longest(mut rows: Vec<usize>, most: usize) -> usize {
    rows.sort_unstable();
    let (mut left, mut longest) = (most, most);
    for (i, own) in rows.iter().enumerate() {
        longest = left / (rows.len() - i);
        if *own > longest {
            break;
        }
        left -= own;
    }
    longest
}

fn beginning(own: &SessionTrial, rows: usize) -> SessionTrial {
    let first = |values: &[f64]| values[..rows.min(values.len())].to_vec();
    let channel = |c: &Channel| Channel { name: c.name.clone(), values: first(&c.values) };
    let trial = Trial {
        name: own.trial.name.clone(),
        time_s: first(&own.trial.time_s),
        channels: own.trial.channels.iter().map(channel).collect(),
    };
    SessionTrial { trial, notes: own.notes.clone(), ..*own }
}

#[cfg(test)]
mod tests {
    use super::longest;

    #[test]
    fn short_trials_stay_whole_and_long_ones_share_what_is_left() {
        for (rows, most, expected) in [
            (vec![10, 20, 30], 60, 30),
            (vec![10, 20, 31], 60, 30),
            (vec![31, 10, 20], 60, 30),
            (vec![100, 100], 60, 30),
            (vec![5, 100, 100], 65, 30),
            (vec![5, 100, 100], 66, 30),
            (vec![100], 60, 60),
            (vec![1; 10], 5, 0),
        ] {
            assert_eq!(longest(rows.clone(), most), expected, "{rows:?}");
            let kept: usize = rows.iter().map(|own| own.min(&expected)).sum();
            assert!(kept <= most);
        }
    }
}
