//! Time courses of a signal in shares of its range, for candidate experiments on a gauge and on any
//! input of a simulator.

/// Points of a course: share of the range, and time from the point before, s.
pub(crate) type Points = Vec<(f64, f64)>;

/// A candidate experiment: name, instructions, points.
pub(crate) type Candidate = (&'static str, &'static str, Points);

/// A course that begins at the first point and goes through the others, with zero slope at each point.
pub(crate) fn course(points: &[(f64, f64)], dt_s: f64) -> Vec<f64> {
    let mut out = Vec::new();
    for pair in points.windows(2) {
        let (from, (to, seconds)) = (pair[0].0, pair[1]);
        let samples = ((seconds / dt_s).round() as usize).max(1);
        let way = |i: usize| i as f64 / samples as f64;
        out.extend((0..samples).map(|i| {
            let x = way(i);
            from + (to - from) * x * x * (3.0 - 2.0 * x)
        }));
    }
    out
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
