//! Functions that run operators and generate test signals.

use proptest::{prelude::*, test_runner::RngSeed};
use stretch_effects::{Grid, Operator, Span, Start};

/// Sample time of the tests, s.
pub(crate) const DT_S: f64 = 0.01;

/// A proptest configuration with a fixed seed, so that the cases are the same in every run.
pub(crate) fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() }
}

/// A grid with one step a sample.
pub(crate) fn samples() -> Grid {
    Grid::samples(DT_S).expect("a grid")
}

/// Output of an operator that starts settled, sample by sample.
pub(crate) fn respond(operator: &dyn Operator, signal: &[f64]) -> Vec<f64> {
    respond_on(&samples(), operator, signal)
}

/// Output of an operator that starts settled, at every node of a grid.
pub(crate) fn respond_on(grid: &Grid, operator: &dyn Operator, signal: &[f64]) -> Vec<f64> {
    let mut cells = vec![0.0; operator.cells()];
    run(operator, &mut cells, Start::Settled, Span::whole(grid), signal, signal.len())
}

/// Output of an operator that reads a position or a velocity (`strain`); the signal is 0.
pub(crate) fn force(operator: &dyn Operator, strain: &[f64], load: &[f64]) -> Vec<f64> {
    let (grid, mut cells) = (samples(), vec![0.0; operator.cells()]);
    let span = Span { strain, load, ..Span::whole(&grid) };
    let zeros = vec![0.0; strain.len()];
    run(operator, &mut cells, Start::Settled, span, &zeros, strain.len())
}

/// Output of a trial that is run in blocks. The memory begins at the first strain if there is one, as in a contact.
pub(crate) fn run(
    operator: &dyn Operator,
    cells: &mut [f64],
    start: Start,
    span: Span<'_>,
    signal: &[f64],
    block: usize,
) -> Vec<f64> {
    operator.begin(start, *span.strain.first().unwrap_or(&signal[0]), cells);
    let mut out = signal.to_vec();
    let mut from = 0;
    for values in out.chunks_mut(block) {
        let end = from + values.len();
        let part = |all| <[f64]>::get(all, from..end).unwrap_or(&[]);
        let own = Span {
            first_node: span.first_node + from,
            strain: part(span.strain),
            load: part(span.load),
            ..span
        };
        operator.run(&own, cells, values);
        from = end;
    }
    out
}

/// Samples between -3 and 3.
pub(crate) fn signal() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-3.0..3.0_f64, 2..60)
}

/// Turning points of a motion between -3 and 3.
pub(crate) fn turns() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-3.0..3.0_f64, 2..9)
}

/// A motion between turning points, with that many samples from each to the next.
pub(crate) fn motion(turns: &[f64], samples: usize) -> Vec<f64> {
    let way = |pair: &[f64]| {
        let (from, to) = (pair[0], pair[1]);
        let at = move |i| match i == samples {
            true => to,
            false => from + (to - from) * i as f64 / samples as f64,
        };
        (1..=samples).map(at).collect::<Vec<f64>>()
    };
    [turns[0]].into_iter().chain(turns.windows(2).flat_map(way)).collect()
}

/// Greatest difference between two signals.
pub(crate) fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |most, (a, b)| (a - b).abs().max(most))
}

/// Greatest absolute value.
pub(crate) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, x| x.abs().max(most))
}

/// Greatest change from one sample to the next.
pub(crate) fn quickest(values: &[f64]) -> f64 {
    values.windows(2).fold(0.0, |most, pair| (pair[1] - pair[0]).abs().max(most))
}
