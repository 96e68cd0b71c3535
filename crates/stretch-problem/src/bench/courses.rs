//! Time courses of a signal in shares of its range, for candidate experiments on a gauge and on any
//! input of a simulator.

use stretch_gap::RandomGenerator;

/// Points of a course: share of the range, and time from the point before, s.
pub(crate) type Points = Vec<(f64, f64)>;

/// A candidate experiment: name, instructions, points.
pub(crate) type Candidate = (&'static str, &'static str, Points);

/// A course that begins at the first point and goes through the others, with zero slope at each point.
pub(crate) fn course(points: &[(f64, f64)], dt_s: f64) -> impl Iterator<Item = f64> {
    points.windows(2).flat_map(move |pair| {
        let (from, (to, seconds)) = (pair[0].0, pair[1]);
        let samples = ((seconds / dt_s).round() as usize).max(1);
        (0..samples).map(move |i| {
            let x = i as f64 / samples as f64;
            from + (to - from) * x * x * (3.0 - 2.0 * x)
        })
    })
}

/// Returns the points, with more time for each move in which a change by 1 would take less than
/// `least_s` at the greatest rate. The greatest rate of a [`course`] is 1.5 times the mean rate
/// between two points.
pub(crate) fn paced(points: &[(f64, f64)], least_s: f64) -> Points {
    let mut before = points.first().map_or(0.0, |point| point.0);
    let slowed = |&(share, seconds): &(f64, f64)| {
        let change = (share - before).abs();
        before = share;
        (share, seconds.max(1.5 * change * least_s))
    };
    points.iter().map(slowed).collect()
}

/// Points of `times` loops between two levels, `half_s` seconds each way.
pub(crate) fn loops(low: f64, high: f64, half_s: f64, times: usize) -> Points {
    [(high, half_s), (low, half_s)].repeat(times)
}

/// Points that begin with a second at the lower end.
pub(crate) fn begin(more: &[Points]) -> Points {
    [vec![(0.0, 0.0), (0.0, 1.0)], more.concat()].concat()
}

/// Candidate experiments with motion: slow and fast loops, minor loops, steps with dwells, and a chirp.
pub(crate) fn moving() -> Vec<Candidate> {
    let mut chirp = Vec::new();
    let mut half_s: f64 = 4.0;
    while half_s > 0.2 {
        chirp.extend([(1.0, half_s), (0.0, half_s)]);
        half_s *= 0.88;
    }
    let dwell = |e: f64| [(e, 0.3), (e, 6.0)];
    let steps = [dwell(0.3), dwell(0.7), dwell(1.0), dwell(0.4), dwell(0.0)].concat().repeat(2);
    vec![
        (
            "slow_fast_loops",
            "Slow loops over the whole range, then fast ones.",
            begin(&[loops(0.0, 1.0, 5.0, 3), loops(0.0, 1.0, 0.5, 30)]),
        ),
        (
            "minor_loops",
            "Small loops at three levels, reached from below and from above.",
            begin(&[
                vec![(0.2, 1.0)],
                loops(0.2, 0.4, 0.8, 6),
                vec![(0.7, 1.0)],
                loops(0.7, 0.9, 0.8, 6),
                vec![(1.0, 1.0), (0.6, 1.0)],
                loops(0.6, 0.4, 0.8, 6),
                vec![(0.0, 1.0)],
                loops(0.0, 0.1, 0.8, 6),
            ]),
        ),
        ("steps_with_dwells", "Quick steps, each followed by a rest.", begin(&[steps])),
        ("chirp", "Loops over the whole range, ever faster.", begin(&[chirp])),
    ]
}

/// Candidate experiments that last `seconds` for a simulator whose input crosses its range in `quick_s` at best.
pub(crate) fn within(seconds: f64, quick_s: f64, random: &mut RandomGenerator) -> Vec<Candidate> {
    let stair = (1..=LEVELS).map(|level| level as f64 / LEVELS as f64);
    let dwell_s = seconds / LEVELS as f64 - quick_s;
    let loops_fast = (0.5 * seconds / quick_s).ceil() as usize;
    let mut all = vec![
        (
            "staircase",
            "Steps up over the range, each followed by a rest; never back.",
            stair.flat_map(|level| [(level, quick_s), (level, dwell_s.max(0.0))]).collect(),
        ),
        ("slow_loops", "Two slow loops over the range.", loops(0.0, 1.0, 0.25 * seconds, 2)),
        (
            "fast_loops",
            "Loops over the range, as fast as the limits allow.",
            loops(0.0, 1.0, quick_s, loops_fast),
        ),
        (
            "random_levels",
            "Random levels, held for random times.",
            levels(seconds, quick_s, random),
        ),
    ];
    all.extend(
        moving().into_iter().map(|(name, how, points)| (name, how, lasting(&points, seconds))),
    );
    all
}

/// Random levels, held for random times, that last `seconds`; each move takes `quick_s`.
pub(crate) fn levels(seconds: f64, quick_s: f64, random: &mut RandomGenerator) -> Points {
    let mut levels = Points::new();
    let mut left_s = seconds;
    while left_s > 0.0 {
        let (level, held_s) = (random.unit(), 2.0 * quick_s * random.unit());
        levels.extend([(level, quick_s), (level, held_s)]);
        left_s -= quick_s + held_s;
    }
    levels
}

/// Levels of a staircase.
const LEVELS: usize = 5;

/// Returns the points on another time scale, so that they take `seconds`.
pub(crate) fn lasting(points: &[(f64, f64)], seconds: f64) -> Points {
    let whole_s: f64 = points.iter().skip(1).map(|(_, seconds)| seconds).sum();
    points.iter().map(|(share, s)| (*share, s * seconds / whole_s)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The limit is half the range per second. The number of samples of a move is rounded, so the rate may exceed the
    /// limit by up to 2 %.
    #[test]
    fn a_paced_course_goes_the_same_way_no_faster_than_its_limit() {
        const DT_S: f64 = 0.01;
        let fastest = |points: &[(f64, f64)]| {
            let values: Vec<f64> = course(points, DT_S).collect();
            let greatest = values.windows(2).map(|pair| (pair[1] - pair[0]).abs() / DT_S);
            greatest.fold(0.0, f64::max)
        };
        for (name, _, points) in moving() {
            let slowed = paced(&points, 2.0);
            assert!(fastest(&points) > 0.55 && fastest(&slowed) < 0.51, "{name}");
            let same =
                |(one, other): (&(f64, f64), &(f64, f64))| one.0 == other.0 && one.1 <= other.1;
            assert!(points.iter().zip(&slowed).all(same), "{name}");
            // a course that is slow enough is not changed
            assert_eq!(paced(&points, 1e-3), points);
        }
    }
}
