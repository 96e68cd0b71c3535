"""A position servo: tau dy/dt = command + offset - y. Every trial starts at rest at its first command."""

import numpy as np


class Servo:
    def begin(self, session):
        self.dt_s = session["dt_s"]

    def simulate(self, params, effects, inputs, trials):
        tau, offset = params[:, 0], params[:, 1]
        goal = inputs["commanded_rad"]
        taken = 1.0 - np.exp(-self.dt_s / tau)
        out = np.zeros((len(params), goal.shape[-1]))
        for part in trials:
            y = goal[..., part.samples.start] + offset
            for i in range(part.samples.start, part.samples.stop):
                y = y + taken * (goal[..., i] + offset - y)
                out[:, i] = y
        return out


servo = Servo()
