//! Channels that are saturated at an end of the recorder's range.

use stretch_data::{after_number, ends, unit_of};
use stretch_filter::log::{noise_of_differences, second_differences};

use super::columns::Columns;

/// Share of the samples at one value above which chance does not explain the repeated value.
const SHARE: f64 = 0.002;
/// Smallest noise of a recording that is judged, as a share of the stated noise. A channel with less noise repeats its
/// value at rest.
const NOISY: f64 = 0.3;

/// Marks the samples at an end of a column's range as lost, if there are more such samples than noise explains. Adds a
/// doubt for each such end. `noise` is that of the column's recorder.
pub(crate) fn leave_out_rails(columns: &mut Columns, name: &str, noise: f64) {
    let values = columns.all(name).to_vec();
    let (low, high) = ends(&values);
    for (end, which) in [(low, "least"), (high, "greatest")] {
        let is_there = |value: &f64| *value == end;
        let count = values.iter().filter(|value| is_there(value)).count();
        let share = count as f64 / values.len().max(1) as f64;
        if share <= SHARE || noise_off(&values, end) <= NOISY * noise {
            continue;
        }
        let marks = columns.is_lost.iter_mut().zip(&values);
        marks.for_each(|(is_lost, value)| *is_lost |= is_there(value));
        columns.doubts.push(format!(
            "{name} is at {end}{}, its {which} value, in {count} samples ({:.1} %), which are left out: the recorder is probably saturated, and all \
             values beyond are lost; lower the gain, widen the range or move the zero, and record again",
            after_number(&unit_of(name)),
            100.0 * share
        ));
    }
}

/// Noise of a channel from its median second difference, without the samples at one value.
fn noise_off(values: &[f64], end: f64) -> f64 {
    let away = values.windows(3).filter(|w| w.iter().all(|v| *v != end));
    let mut bends: Vec<f64> = away.flat_map(second_differences).collect();
    noise_of_differences(&mut bends).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use stretch_data::{Channel, SessionTrial, Trial};
    use stretch_sim::{Key, RigParams};

    use super::*;
    use crate::RigSession;

    #[test]
    fn an_end_is_told_from_a_rest() {
        let noise = |i: usize| ((i * i * 31 + i * 7919) % 1009) as f64 / 1009.0 - 0.5;
        let at = |clip: f64, size: f64| -> Vec<f64> {
            (0..3000).map(|i| ((0.01 * i as f64).sin() + size * noise(i)).min(clip)).collect()
        };
        let length: Vec<f64> =
            (0..3000).map(|i| 170.0 - 0.001 * i as f64 + 0.1 * noise(i)).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let said = |bridge_v| {
            let trial = Trial {
                name: "a".into(),
                time_s: (0..3000).map(|i| 0.01 * f64::from(i)).collect(),
                channels: vec![
                    channel("inlet", vec![0.5; 3000]),
                    channel("outlet", vec![0.0; 3000]),
                    channel("length_mm", length.clone()),
                    channel("bridge_v", bridge_v),
                ],
            };
            let mut session = RigSession::new(&[SessionTrial::new(trial)]).expect("a session");
            let columns = &mut session.columns;
            leave_out_rails(columns, "bridge_v", RigParams::default()[Key::SigmaV]);
            let lost = columns.is_lost.iter().filter(|is_lost| **is_lost).count();
            let told = columns.doubts.iter().filter(|doubt| doubt.contains("saturated"));
            (told.cloned().collect::<Vec<_>>(), lost)
        };
        assert_eq!(said(at(9.0, 0.01)), (Vec::new(), 0));
        let (clipped, lost) = said(at(0.5, 0.01));
        assert!(clipped.len() == 1 && clipped[0].contains("bridge_v is at 0.5 V, its greatest"));
        assert!(lost > 300 && clipped[0].contains(&format!("in {lost} samples")), "{lost}");
        // A simulation without noise gives no note.
        assert_eq!(said(at(0.5, 0.0)), (Vec::new(), 0));
    }
}
