//! The input of a backlash from its recorded output.

/// Replaces the output of a backlash of half-width `w` by an input that would have made it.
///
/// While the output rises the input is w ahead of it, while it falls w behind; where it dwells between the two
/// the input is unknown and is led over linearly. Directions are told with a dead band of w/10 (at least a
/// millionth of the record's range), so a smooth record is needed.
pub(crate) fn undo(w: f64, signal: &mut [f64]) {
    let (low, high) = signal.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
    let band = (0.1 * w).max(1e-6 * (high - low));
    if signal.is_empty() || !(band > 0.0) {
        return;
    }
    // The offset at which the last move ended, and the sample where it ended.
    let mut offset = 0.0;
    let mut until = 0;
    let mut direction = 0.0;
    let mut extreme = signal[0];
    let mut begun = 0;
    let mut value = signal[0];
    for i in 0..signal.len() {
        let x = signal[i];
        let moved = x - extreme;
        if direction == 0.0 || moved * direction < 0.0 {
            if moved.abs() > band {
                // A new move: it began at the extreme, the input crossed its play while the output dwelt there.
                direction = moved.signum();
                let goal = direction * w;
                let dwell = (begun.max(until) - until).max(1) as f64;
                let _ = value;
                for (n, y) in signal[until..i].iter_mut().enumerate() {
                    *y += offset + (goal - offset) * (n as f64 / dwell).min(1.0);
                }
                offset = goal;
                signal[i] = x + offset;
                until = i + 1;
                extreme = x;
                begun = i;
            } else if moved.abs() <= 0.5 * band {
                begun = i;
            }
        } else {
            if moved != 0.0 {
                extreme = x;
                for y in &mut signal[until..i] {
                    *y += offset;
                }
                signal[i] = x + offset;
                until = i + 1;
                begun = i;
            }
        }
        value = x;
    }
    for y in &mut signal[until..] {
        *y += offset;
    }
}
