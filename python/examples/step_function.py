"""A simulator in ten lines, made from an environment with the methods `reset` and `step` of Gymnasium.

    python examples/step_function.py

The environment is a cart that is driven by a force. The recording is of a cart that also has Coulomb friction.
"""

import numpy as np
import stretch_gap


class Cart:
    """Environment as in Gymnasium: `step(action)` returns observation, reward, two flags and a dict."""

    def __init__(self, mass=10.0, viscous=4.0, dry=0.0):
        self.mass, self.viscous, self.dry = mass, viscous, dry

    def reset(self, seed=None):
        self.speed = 0.0
        return np.array([self.speed]), {}

    def step(self, action):
        rubs = self.viscous * self.speed + self.dry * np.tanh(self.speed / 0.02)
        self.speed += 0.01 / self.mass * (action[0] - rubs)
        return np.array([self.speed]), 0.0, False, False, {}


def stepped(make, action, observed=0):
    """Return the simulator of the environment that `make(**parameters)` creates.

    `action` is the column that drives the environment. Number `observed` of its observation is compared with the measurement.
    """

    def simulate(params, effects, inputs, trials):
        out = []
        for part in trials:
            env = make(**params, **effects)
            seen, _ = env.reset(seed=0)
            for given in inputs[action][part.samples]:
                out.append(seen[observed])
                seen, *_ = env.step(np.array([given]))
        return np.array(out)

    return simulate


def main():
    time_s = np.arange(0.0, 40.0, 0.01)
    force_n = 30.0 * np.sin(0.9 * time_s) + 15.0 * np.sin(2.3 * time_s)
    span = type("Span", (), {"samples": slice(0, time_s.size)})
    really = stepped(Cart, "force_n")({"mass": 10.4}, {"dry": 6.0}, {"force_n": force_n}, [span])
    noise = 0.003 * np.random.default_rng(1).normal(size=time_s.size)
    found = stretch_gap.diagnose(
        stepped(Cart, "force_n"),
        {"time_s": time_s, "force_n": force_n, "speed_m_per_s": really + noise},
        output="speed_m_per_s",
        inputs=["force_n"],
        parameters={
            "mass": stretch_gap.Parameter(10.0, relative=0.1, unit="kg"),
            "viscous": stretch_gap.Parameter(4.0, relative=0.2, unit="N s/m"),
        },
        effects={"dry": (0.0, 20.0)},
        wrap=["input.delay", "output.lag"],
        budget=300,
    )
    print(found.sentence)
    return found


if __name__ == "__main__":
    main()
