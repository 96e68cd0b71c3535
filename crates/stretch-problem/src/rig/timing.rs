//! The times at which commands switch: at the rows of the log, or anywhere between two rows.
//!
//! A log as fast as the controller shows every switch of a valve in the row where the switch acts. A slower log, or a
//! log with dropped rows, shows a switch up to one row late: the new valve opening already acts for a part of the
//! sample interval before the row that shows it. This part, as a fraction of the interval, is called the lead. The flow
//! during the interval is the flow of the mean opening:
//!
//! ```text
//! u_i -> u_i + lead (u_(i+1) - u_i),     0 <= lead <= 1
//! ```
//!
//! The mean lead is a parameter, which is 0 if commands switch at rows. The lead of each switch differs from the mean
//! lead by an independent error. This error changes the pressure; the error of the pressure decays or stays like any
//! other error of the pressure, and the next switch adds its own. There are two such parameters, one for the odd and
//! one for the even switches, because an inlet that opens and shuts equally early lets the same air in. A lead common
//! to all switches therefore has almost no effect, although the lead of a single switch has a large one.

use std::borrow::Cow;

use stretch_gap::ParameterSpec;

/// Prior of the mean lead: value and standard deviation. The mean lead is 1/2 for switches anywhere in a sample, 1/4 if
/// every second row was dropped, and 0 for a log as fast as the controller; three standard deviations end at a whole
/// sample.
const MEAN: (f64, f64) = (0.25, 0.25);

/// Period of the rig's controller, s.
const CONTROL_S: f64 = 0.01;
/// Smallest ratio of a log's sample time to that period at which a switch may fall between two rows.
const SLOWER: f64 = 1.2;

/// Whether commands may switch between the rows of a log.
pub(super) fn is_slow(dt_s: f64) -> bool {
    dt_s > SLOWER * CONTROL_S
}

/// Leads of the even and of the odd switches of a trial, in this order; the first switch is odd.
pub(super) type Leads = [f64; 2];
/// Names of the two leads.
const NAMES: [&str; 2] = ["command_lead_1", "command_lead_2"];

/// The parameter of a lead if commands switch exactly at rows.
pub(super) fn at_rows(which: usize) -> ParameterSpec {
    ParameterSpec { least: 0.0, is_evidence: false, ..ParameterSpec::new(NAMES[which], "1", 0.0) }
}

/// The parameter of a lead if commands switch anywhere: the time of each switch is uniform in its
/// sample, with variance 1/12.
pub(super) fn anywhere(which: usize) -> ParameterSpec {
    let per_tick_sd = Some((1.0_f64 / 12.0).sqrt());
    ParameterSpec { nominal: MEAN.0, sd: MEAN.1, per_tick_sd, ..at_rows(which) }
}

/// Returns, for each sample of a trial, how many times the commands of inlet and outlet have changed
/// up to that sample.
pub(super) fn switches(inlet: &[f64], outlet: &[f64]) -> impl Iterator<Item = u32> {
    let mut count = 0;
    (0..inlet.len()).map(move |i| {
        // A switch within the sample before a row shows from that row on.
        count += u32::from(i > 0 && (inlet[i], outlet[i]) != (inlet[i - 1], outlet[i - 1]));
        count
    })
}

/// Samples at which the commands differ from those of the sample before.
pub(super) fn switched(inlet: &[f64], outlet: &[f64]) -> impl Iterator<Item = usize> {
    let counts: Vec<u32> = switches(inlet, outlet).collect();
    (1..counts.len()).filter(move |&i| counts[i] != counts[i - 1])
}

/// Inlet and outlet, with switches that act ahead of their rows by shares of a sample.
pub(super) fn ahead<'a>(inlet: &'a [f64], outlet: &'a [f64], leads: Leads) -> [Cow<'a, [f64]>; 2] {
    if leads == [0.0; 2] {
        return [Cow::Borrowed(inlet), Cow::Borrowed(outlet)];
    }
    [inlet, outlet].map(|opening| {
        let mut out = opening.to_vec();
        let next = switches(inlet, outlet).skip(1);
        for ((out, pair), switch) in out.iter_mut().zip(opening.windows(2)).zip(next) {
            let lead = leads[switch as usize % 2];
            *out = (pair[0] + lead * (pair[1] - pair[0])).clamp(0.0, 1.0);
        }
        Cow::Owned(out)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_lead_opens_the_row_before_by_half() {
        let opening = [0.0, 0.0, 1.0, 1.0, 0.5];
        let [inlet, _] = ahead(&opening, &[0.0; 5], [0.5, 0.5]);
        assert_eq!(*inlet, [0.0, 0.5, 1.0, 0.75, 0.5]);
        let [inlet, _] = ahead(&opening, &[0.0; 5], [0.2, 0.0]);
        assert_eq!(*inlet, [0.0, 0.0, 1.0, 0.9, 0.5]);
        assert!(matches!(ahead(&opening, &opening, [0.0; 2]), [Cow::Borrowed(_), _]));
        let last: Vec<u32> = switches(&opening, &[0.0; 5]).collect();
        assert_eq!(last, [0, 0, 1, 1, 2]);
    }
}
