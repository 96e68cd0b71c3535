"""Five stretch sensors on a knee: each is a straight line over the angle."""

SENSORS = ("s1", "s2", "s3", "s4", "s5")


class Sleeve:
    def simulate(self, params, effects, inputs):
        angle = inputs["angle_deg"]
        return {name: params[f"{name}_per_deg"][:, None] * angle + params[f"{name}_zero"][:, None] for name in SENSORS}


sleeve = Sleeve()
