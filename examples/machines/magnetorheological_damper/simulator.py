"""A dashpot with a spring, whose viscous friction grows with the voltage: force = (c0 + c1 E) v + k x."""


def damper(params, effects, inputs):
    viscous = params["c0"] + params["c1"] * inputs["voltage_v"]
    return viscous * inputs["velocity_cm_per_s"] + params["k"] * inputs["position_cm"]
