"""Five stretch sensors on a knee: each signal is a cubic polynomial of the angle, as in calibrations of such sensors."""

SENSORS = ("s1", "s2", "s3", "s4", "s5")
TURN_DEG = 90.0


class Sleeve:
    def simulate(self, params, effects, inputs):
        x = inputs["angle_deg"] / TURN_DEG

        def curve(name):
            zero, one, two, three = (params[f"{name}_{term}"][:, None] for term in ("zero", "one", "two", "three"))
            return zero + x * (one + x * (two + x * three))

        return {name: curve(name) for name in SENSORS}


sleeve = Sleeve()
