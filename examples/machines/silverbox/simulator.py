"""A mass on a spring: y'' + 2 damping w y' + w^2 y = gain w^2 u, w = 2 pi frequency.

Further effects can be switched on: a quadratic and a cubic spring, dry friction, quadratic damping. The linear part is integrated
exactly for an input that is linear between samples; the other forces change the speed before and after each step (Strang
splitting).
"""

import numpy as np

STEPS = 2
"""Number of integration steps per sample."""


def exact(w, damping, h):
    """Returns the matrices of one step h of the linear part, for the state and for the input at both ends of the step."""
    real, turn = damping * w, w * np.sqrt(np.maximum(1.0 - damping**2, 1e-12))
    c, s = np.exp(-real * h) * np.cos(turn * h), np.exp(-real * h) * np.sin(turn * h) / turn
    state = np.array([[c + real * s, s], [-(w**2) * s, c - real * s]])
    # the response to a constant input of 1 is y = 1; the response to a ramp of slope 1/h is delayed by 2 damping/w
    held = np.array([1.0 - state[0, 0], -state[1, 0]])
    late = 2.0 * damping / w
    ramp = np.array([(h - late * held[0] - state[0, 1]) / h, (1.0 - late * held[1] - state[1, 1]) / h])
    return state, held - ramp, ramp


class Oscillator:
    def begin(self, session):
        self.dt_s = session["dt_s"]

    def simulate(self, params, effects, inputs, trials):
        w, h = 2.0 * np.pi * params["frequency"], self.dt_s / STEPS
        square, cube, dry, drag = (effects[name] for name in ("quadratic_spring", "cubic_spring", "dry_friction", "drag"))
        (yy, yv), (vy, vv) = (state := exact(w, params["damping"], h))[0]
        (y0, v0), (y1, v1) = params["gain"] * state[1], params["gain"] * state[2]

        def kick(y, v, by):
            rubs = dry * np.tanh(50.0 * v / w) + drag * v * np.abs(v) / w**2
            return v - by * w**2 * (y * y * (square + cube * y) + rubs)

        u = inputs["input_v"]
        out = np.zeros((len(params), u.shape[-1]))
        for part in trials:
            y, v = np.zeros(len(params)), np.zeros(len(params))
            for i in range(part.samples.start, part.samples.stop):
                out[:, i] = y + params["offset"]
                a = u[..., i]
                more = (u[..., min(i + 1, part.samples.stop - 1)] - a) / STEPS
                for k in range(STEPS):
                    v = kick(y, v, 0.5 * h)
                    low, high = a + k * more, a + (k + 1) * more
                    y, v = yy * y + yv * v + y0 * low + y1 * high, vy * y + vv * v + v0 * low + v1 * high
                    v = kick(y, v, 0.5 * h)
        return out


oscillator = Oscillator()
