//! The valves act late.

use stretch_effects::{Action, Acts, Effect, EffectParameter, Quantity, RigStage, Sketch, each};

/// The valves act late.
pub(super) static VALVE_DELAY: Effect = Effect {
    name: "valve_delay",
    title: "the valves' delay",
    words: "the valves act late",
    stage: RigStage::Pneumatics,
    equation: "u(t) -> u(t - delay_s)",
    parameters: &[EffectParameter::strength("delay_s", "s", 0.0, 0.12, 0.03)],
    acts: Acts::Own {
        action: |values, _| Action::Delay(values[0]),
        sketch: Some(|v, around| sketch(v[0], around.grid.dt_s())),
    },
    twins: &["crossbeam_inertia"],
    starts: Some(|_| each([0.004, 0.015, 0.05])),
    ..Effect::PLAIN
};

/// The command of a valve at a time.
fn sketch(delay_s: f64, dt_s: f64) -> Sketch {
    let body = "let k = floor((t - DELAY) / DT)
        var y = 0
        if k >= 0
        y = u[min(k, n - 1)]
        end";
    let commands = "commanded openings of a valve, each held for a sample";
    let opening = "opening that acts at that time; shut before the first command arrives";
    Sketch::of(Quantity::new("u", "1", commands).record(), body)
        .beside(Quantity::COUNT)
        .beside(Quantity::new("t", "s", "time since the trial began"))
        .giving(Quantity::new("y", "1", opening))
        .with_all(&[("DELAY", delay_s, "s"), ("DT", dt_s, "s")])
}
