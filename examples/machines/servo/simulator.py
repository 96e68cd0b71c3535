"""A servo that holds its position, with a stiff spring at its output: angle = offset + compliance times pull."""


def servo(params, effects, inputs):
    return params["offset"] + params["compliance"] * inputs["pull_deg"]
