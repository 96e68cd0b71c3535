//! The input of a backlash from its recorded output.

use alloc::vec::Vec;

/// Replaces the output of a backlash of half-width `w` by an input that would have made it.
///
/// While the output moves, the input is w ahead of it. After each turn the output dwells at its extreme while
/// the input crosses the play; there the input is unknown and is led over linearly. Turns and dwells are told with a
/// band of w/10 (at least a millionth of the record's range): the record has to be smoother than that.
pub(crate) fn unplay(w: f64, signal: &mut [f64]) {
    let (low, high) = signal.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
    let band = (0.1 * w).max(1e-6 * (high - low));
    if signal.is_empty() || band.is_nan() || band <= 0.0 {
        return;
    }
    let turns = turns(signal, band);
    // Ahead of the output by how much, at the last turn.
    let mut ahead = 0.0;
    for (n, turn) in turns.iter().enumerate() {
        let end = turns.get(n + 1).map_or(signal.len(), |next| next.at);
        let extreme = signal[turn.at];
        let left = (turn.at..end).find(|i| (signal[*i] - extreme).abs() > band).unwrap_or(end);
        let dwell = (left - turn.at).max(1) as f64;
        let goal = turn.direction * w;
        for (i, x) in signal[turn.at..end].iter_mut().enumerate() {
            *x += ahead + (goal - ahead) * (i as f64 / dwell).min(1.0);
        }
        ahead = goal;
    }
}

/// A sample at which a move begins, and its direction: +1 up, -1 down, 0 for a record that never moves.
struct Turn {
    at: usize,
    direction: f64,
}

/// Extremes between moves of more than `band`; the first stands at the record's start.
fn turns(signal: &[f64], band: f64) -> Vec<Turn> {
    let mut turns = alloc::vec![Turn { at: 0, direction: 0.0 }];
    let mut extreme = 0;
    for (i, x) in signal.iter().enumerate() {
        let last = turns.len() - 1;
        let moved = x - signal[extreme];
        if moved * turns[last].direction > 0.0 {
            extreme = i;
        } else if moved.abs() > band {
            let direction = moved.signum();
            if turns[last].direction == 0.0 {
                turns[last].direction = direction;
            } else {
                turns.push(Turn { at: extreme, direction });
            }
            extreme = i;
        }
    }
    turns
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use stretch_core::play;
    use testkit::tolerance::F64_ROUNDING;

    #[test]
    fn finds_the_input_while_the_output_moves() {
        let w = 0.5;
        let input: Vec<f64> = (0..2000).map(|i| 10.0 * libm::sin(i as f64 * 0.01)).collect();
        let mut z = input[0];
        let output: Vec<f64> = input
            .iter()
            .map(|x| {
                z = play(z, *x, w);
                z
            })
            .collect();
        let mut found = output.clone();
        unplay(w, &mut found);
        let rms = |a: &[f64]| {
            let sum: f64 = a.iter().zip(&input).map(|(a, b)| (a - b) * (a - b)).sum();
            libm::sqrt(sum / 2e3)
        };
        assert!(rms(&found) < 0.2 * rms(&output), "{} of {}", rms(&found), rms(&output));
        // Away from the turns it is exact.
        assert_relative_eq!(found[1000], input[1000], epsilon = 0.0, max_relative = F64_ROUNDING);
        let mut still = [3.0; 10];
        unplay(w, &mut still);
        assert_eq!(still, [3.0; 10]);
    }
}
