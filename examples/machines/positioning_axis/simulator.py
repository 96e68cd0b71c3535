"""A carriage on a rail, as a mass with viscous friction: the force from the motion, and the velocity from the force."""

import numpy as np


class Inverse:
    """force = mass acceleration + viscous velocity."""

    def simulate(self, params, effects, inputs):
        mass, viscous = params[:, :1], params[:, 1:2]
        return mass * inputs["acceleration_m_per_s2"] + viscous * inputs["velocity_m_per_s"]


class Forward:
    """mass dv/dt = force - viscous v. Every trial starts at rest, and the force is constant from sample to sample."""

    def begin(self, session):
        self.dt_s = session["dt_s"]

    def simulate(self, params, effects, inputs, trials):
        mass, viscous = params[:, 0], params[:, 1]
        force = inputs["force_n"]
        kept = np.exp(-viscous / mass * self.dt_s)
        out = np.zeros((len(params), force.shape[-1]))
        for part in trials:
            v = np.zeros(len(params))
            for i in range(part.samples.start, part.samples.stop):
                out[:, i] = v
                v = kept * v + (1.0 - kept) / viscous * force[..., i]
        return out


inverse, forward = Inverse(), Forward()
