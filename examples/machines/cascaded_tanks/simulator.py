"""Two tanks, one above the other, each with a hole; the outflow follows Torricelli's law.

    h1' = k4 u - k1 sqrt(h1),  h2' = k2 sqrt(h1) - k3 sqrt(h2),  level = h2

Further effects can be switched on: either tank may overflow, and the lower tank may catch a share of the overflow of the upper
one.
"""

import numpy as np

STEPS = 4
"""Number of integration steps per sample."""


class Tanks:
    def begin(self, session):
        self.dt_s = session["dt_s"]

    def simulate(self, params, effects, inputs, trials):
        k1, k2, k3, k4 = (params[name] for name in ("k1", "k2", "k3", "k4"))
        brim1, caught, brim2 = effects["upper_overflow.brim"], effects["upper_overflow.caught"], effects["lower_overflow"]
        u = inputs["pump_v"]
        h, out = self.dt_s / STEPS, np.zeros((len(params), u.shape[-1]))
        for part in trials:
            low, high = params["h2"].copy(), params["h1"].copy()
            for i in range(part.samples.start, part.samples.stop):
                out[:, i] = low
                for _ in range(STEPS):
                    runs = k2 * np.sqrt(np.maximum(high, 0.0))
                    high = high + h * (k4 * u[..., i] - k1 * np.sqrt(np.maximum(high, 0.0)))
                    spilt = np.maximum(high - brim1, 0.0)
                    low = low + h * (runs - k3 * np.sqrt(np.maximum(low, 0.0))) + caught * spilt
                    high, low = high - spilt, np.minimum(low, brim2)
        return out


tanks = Tanks()
