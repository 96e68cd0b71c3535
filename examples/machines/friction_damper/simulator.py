"""Simulators of the force of a damper: from its displacement, with viscous or dry friction, or from the pulls at its band."""

import numpy as np

WIDTH_MM_PER_S = 5.0
"""Speed scale of the transition at which dry friction changes its sign."""


class Damper:
    def __init__(self, is_dry):
        self.is_dry = is_dry

    def begin(self, session):
        self.dt_s = session["dt_s"]

    def simulate(self, params, effects, inputs, trials):
        x = inputs["displacement_mm"]
        out = np.zeros((len(params), x.shape[-1]))
        for part in trials:
            speed = np.gradient(x[..., part.samples], self.dt_s, axis=-1)
            out[:, part.samples] = params[:, :1] * speed
            if self.is_dry:
                out[:, part.samples] += params[:, 1:2] * np.tanh(speed / WIDTH_MM_PER_S)
        return out


class Band:
    """The force of the band brake from the pulls at its two ends: force = leverage (pull 2 - pull 1)."""

    def simulate(self, params, effects, inputs):
        return params[:, :1] * (inputs["pull_2_kn"] - inputs["pull_1_kn"])


viscous, dry, band = Damper(False), Damper(True), Band()
