"""Diagnosis of a MuJoCo arm that contains, in turn, each of seven effects of its actuators.

    pip install . mujoco[sysid]
    python examples/mujoco_actuators.py [--out ../reference/mujoco.md] [--only backlash]

The simulator is a two-link arm under position control. A copy of the arm, with other masses and gains and with noise, takes the
place of the real machine. In seven cases the copy has one effect of the catalogue, with other equations than the catalogue's (for
example friction with a Stribeck rise, or a gear with the inertia of the rotor). In one case the copy has no effect, and in one
case an effect that is not in the catalogue. Three methods have to find the effect: the diagnosis, a fit of one candidate after
the other by least RMSE, and `mujoco.sysid`, which fits all candidates at once.
"""

import argparse
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field

import mujoco
import numpy as np
import stretch_gap

MODEL = """
<mujoco model="arm">
  <option timestep="0.002" integrator="implicitfast"/>
  <default>
    <joint type="hinge" axis="0 1 0"/>
    <geom type="capsule" contype="0" conaffinity="0"/>
  </default>
  <worldbody>
    <body name="upper">
      <joint name="shoulder"/>
      <geom name="upper" fromto="0 0 0 0 0 -0.3" size="0.02" mass="1.2"/>
      <body name="fore" pos="0 0 -0.3">
        <joint name="elbow"/>
        <geom name="fore" fromto="0 0 0 0 0 -0.25" size="0.015" mass="0.6"/>
        <body name="tool" pos="0 0 -0.25">
          <geom name="tool" type="sphere" size="0.02" mass="0.3"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

DT_S = 0.002
EVERY = 5
"""Integration steps per sample. The joints are recorded at 100 Hz."""
SECONDS = 20.0
NOISE_RAD = 2e-4
SIZE = (1.0, 0.3)
"""Factor of the torques, inertias and frictions of each joint. The motor of the elbow is smaller than that of the shoulder."""
GAINS = ((60.0, 3.0), (20.0, 0.6))
NO_LOAD = 12.0
"""No-load speed of the motors, rad/s: the speed at which their torque is zero."""

PARAMETERS = {
    "tool_mass": stretch_gap.Parameter(0.3, relative=0.1, unit="kg"),
    "kp": stretch_gap.Parameter(1.0, relative=0.05),
    "kv": stretch_gap.Parameter(1.0, relative=0.1),
}

CATALOGUE = {
    "armature": stretch_gap.Argument(0.0, 0.1, unit="kg m2"),
    "frictionloss": stretch_gap.Argument(0.0, 1.5, unit="N m"),
    "damping": stretch_gap.Argument(0.0, 1.5, unit="N m s/rad"),
    "delay": stretch_gap.Argument(0.0, 0.015, unit="s"),
    "backlash": stretch_gap.Argument(0.0, 0.04, unit="rad"),
    "stall_torque": stretch_gap.Argument(2.0, 20.0, off=20.0, unit="N m"),
    "gear_compliance": stretch_gap.Argument(0.0, 0.01, unit="rad/(N m)"),
}
OFF = {name: argument.off for name, argument in CATALOGUE.items()}


def commands():
    """Return the commanded positions, rad, and speeds, rad/s, of both joints at every step."""
    time_s = np.arange(0.0, SECONDS, DT_S)
    position, speed = np.zeros((2, time_s.size)), np.zeros((2, time_s.size))
    waves = [
        [(0.7, 0.9, 0.0), (0.35, 2.7, 1.0), (0.12, 7.1, 0.3), (0.04, 13.0, 2.0)],
        [(0.8, 1.2, 0.6), (0.4, 3.3, 0.0), (0.12, 8.3, 1.1), (0.04, 15.0, 0.2)],
    ]
    for joint, parts in enumerate(waves):
        for size, omega, phase in parts:
            ramp = np.minimum(time_s / 2.0, 1.0)
            position[joint] += ramp * size * np.sin(omega * time_s + phase)
    speed = np.gradient(position, DT_S, axis=1)
    return position, speed


COMMAND, COMMAND_SPEED = commands()
STEPS = COMMAND.shape[1]


def arm(tool_mass):
    """Return the model with another mass of the tool, and its data."""
    model = mujoco.MjModel.from_xml_string(MODEL.replace('size="0.02" mass="0.3"', f'size="0.02" mass="{tool_mass}"'))
    return model, mujoco.MjData(model)


def run(model, data, law, link):
    """Return the positions of both joints at every sample, rad. `link(i, joint, q, v, law)` returns the torque on the link."""
    rows = np.empty((2, STEPS // EVERY))
    q, v, out, step = data.qpos, data.qvel, data.qfrc_applied, mujoco.mj_step
    q[0], q[1] = COMMAND[0, 0], COMMAND[1, 0]
    for i in range(STEPS):
        if i % EVERY == 0:
            rows[0, i // EVERY], rows[1, i // EVERY] = q[0], q[1]
        for joint in (0, 1):
            out[joint] = link(i, joint, q[joint], v[joint], law)
        step(model, data)
    return rows


class Simulator:
    """Simulator of the arm with the effects of the catalogue. Each effect is off at its off-value."""

    def __init__(self):
        self.runs = 0

    def simulate(self, params, effects):
        """Return the positions of both joints for n models."""
        answers = [self.one(row, {name: effects[name][i] for name in CATALOGUE}) for i, row in enumerate(np.asarray(params))]
        return {"shoulder_rad": np.array([t[0] for t in answers]), "elbow_rad": np.array([t[1] for t in answers])}

    def one(self, params, e):
        """Return the positions of both joints for one model."""
        self.runs += 1
        tool_mass, kp, kv = params
        model, data = arm(tool_mass)
        for joint in (0, 1):
            model.dof_armature[joint] = SIZE[joint] * e["armature"]
            model.dof_frictionloss[joint] = SIZE[joint] * e["frictionloss"]
            model.dof_damping[joint] = SIZE[joint] * e["damping"]
        late, slack, soft = e["delay"] / DT_S, e["backlash"], e["gear_compliance"]
        whole, part = int(late), late - int(late)
        sent = ([0.0] * (whole + 2), [0.0] * (whole + 2))
        ahead = [0.0, 0.0]

        def link(i, joint, q, v, law):
            size = SIZE[joint]
            # with backlash, the motor side of the gear leads the link in the direction of the torque
            seen = q + ahead[joint]
            gain, rate = GAINS[joint]
            torque = kp * gain * (COMMAND[joint, i] - seen) + kv * rate * (COMMAND_SPEED[joint, i] - v)
            # a compliant gear twists in proportion to the torque, which reduces the torque of the controller
            torque /= 1.0 + kp * gain * soft / size
            if e["stall_torque"] < OFF["stall_torque"]:
                most = size * e["stall_torque"]
                up, down = most * (1.0 - v / NO_LOAD), most * (1.0 + v / NO_LOAD)
                torque = min(max(torque, -max(down, 0.0)), max(up, 0.0))
            line = sent[joint]
            line.append(torque)
            line.pop(0)
            torque = line[-1 - whole] * (1.0 - part) + line[-2 - whole] * part
            if slack:
                ahead[joint] += 0.3 * (slack * np.tanh(torque / (0.3 * size)) - ahead[joint])
            return torque

        return run(model, data, None, link)


@dataclass
class Hidden:
    """Effect and parameters of the copy that takes the place of the real arm."""

    kind: str
    size: float
    note: str
    tool_mass: float = 0.33
    kp: float = 0.97
    kv: float = 1.06
    rotor: float = 0.0
    stiffness: float = 0.0
    expected: str = field(default="")


CASES = [
    Hidden("armature", 0.03, "a rotor behind a gear of 1500 N m/rad", rotor=0.03, stiffness=1500.0),
    Hidden("frictionloss", 0.35, "Coulomb friction over 0.02 rad/s, 40 % more at rest (Stribeck)"),
    Hidden("damping", 0.4, "viscous, a third more at 3 rad/s"),
    Hidden("delay", 0.0055, "4 ms dead time and a bus filter of 1.5 ms"),
    Hidden("backlash", 0.012, "play between rotor and link, 800 N m/rad beyond", rotor=0.003, stiffness=800.0),
    Hidden("stall_torque", 7.0, "soft knee, torque falls with the square of the speed"),
    Hidden("gear_compliance", 0.004, "a rotor on a spring that hardens", rotor=0.003, stiffness=250.0),
    Hidden("nothing", 0.0, "masses and gains are others, nothing is missing", expected="nothing"),
    Hidden("cogging", 0.3, "a torque of 24 teeth, not in the catalogue", expected="nothing of the catalogue"),
]


def built(case, seed):
    """Return the measured positions of the copy in a case, with noise."""
    model, data = arm(case.tool_mass)
    rotor = [[COMMAND[0, 0], 0.0], [COMMAND[1, 0], 0.0]]
    sent = ([0.0] * 8, [0.0] * 8)
    bus = [0.0, 0.0]

    def torque_of(i, joint, q, v):
        gain, rate = GAINS[joint]
        return case.kp * gain * (COMMAND[joint, i] - q) + case.kv * rate * (COMMAND_SPEED[joint, i] - v)

    def geared(i, joint, q, v, size):
        """Return the torque that the gear transmits to the link. The rotor is simulated separately."""
        inner, dt = 4, DT_S / 4
        angle, speed = rotor[joint]
        inertia, k = case.rotor * size, case.stiffness * size
        slack = case.size if case.kind == "backlash" else 0.0
        damp = 2.0 * 0.15 * np.sqrt(k * inertia)
        carried = 0.0
        for _ in range(inner):
            torque = torque_of(i, joint, angle, speed)
            twist = angle - q
            beyond = twist - min(max(twist, -slack), slack)
            gear = k * beyond * (1.0 + (beyond / 0.03) ** 2 if case.kind == "gear_compliance" else 1.0)
            gear += damp * (speed - v) if beyond or not slack else 0.0
            speed += (torque - gear) / inertia * dt
            angle += speed * dt
            carried += gear / inner
        rotor[joint][:] = angle, speed
        return carried

    def link(i, joint, q, v, law):
        size = SIZE[joint]
        if case.rotor:
            return geared(i, joint, q, v, size)
        torque = torque_of(i, joint, q, v)
        if case.kind == "frictionloss":
            torque -= size * case.size * np.tanh(v / 0.02) * (1.0 + 0.4 * np.exp(-((v / 0.2) ** 2)))
        elif case.kind == "damping":
            torque -= size * case.size * v * (1.0 + abs(v) / 9.0)
        elif case.kind == "delay":
            bus[joint] += (torque - bus[joint]) * (1.0 - np.exp(-DT_S / 0.0015))
            sent[joint].append(bus[joint])
            torque = sent[joint][-1 - round(0.004 / DT_S)]
        elif case.kind == "stall_torque":
            drive = v if torque > 0.0 else -v  # positive if the torque acts in the direction of motion
            most = size * case.size * (1.0 - np.sign(drive) * (drive / NO_LOAD) ** 2)
            torque /= (1.0 + abs(torque / most) ** 8) ** 0.125
        elif case.kind == "cogging":
            torque += size * case.size * np.sin(24.0 * q)
        return torque

    rows = run(model, data, None, link)
    draw = np.random.default_rng(seed)
    return rows + NOISE_RAD * draw.normal(size=rows.shape)


def diagnosed(measured):
    """Return the diagnosis, and the number of models that it simulated."""
    stages = [
        stretch_gap.Stage("shoulder_rad", name="shoulder", noise=NOISE_RAD),
        stretch_gap.Stage("elbow_rad", name="elbow", noise=NOISE_RAD),
    ]
    simulator = Simulator()
    found = stretch_gap.diagnose(
        simulator,
        {"shoulder_rad": measured[0], "elbow_rad": measured[1]},
        rate_hz=1.0 / (EVERY * DT_S),
        stages=stages,
        parameters=PARAMETERS,
        effects=CATALOGUE,
        wrap=None,
        name="arm",
    )
    return found, simulator.runs


FITTED = int(0.75 * (STEPS // EVERY))
"""Number of samples that the other methods may fit. The diagnosis, too, reserves the last quarter for tests."""


def residual(measured, x, names, simulator):
    """Return simulated minus measured, divided by the noise, for the samples that may be fitted."""
    values = dict(zip(names, x[len(PARAMETERS) :]))
    rows = simulator.one(x[: len(PARAMETERS)], {**OFF, **values})
    return ((rows - measured)[:, :FITTED] / NOISE_RAD).ravel()


def start_and_bounds(names):
    """Return start values and bounds: parameters within three tolerances, candidates within their ranges.

    Each candidate starts at a fifth of its range, counted from its off-value.
    """
    values = [p.value for p in PARAMETERS.values()]
    reach = [3.0 * p.relative * p.value for p in PARAMETERS.values()]
    own = [CATALOGUE[name] for name in names]
    inside = [a.off + 0.2 * ((a.max if a.off == a.min else a.min) - a.off) for a in own]
    low = [v - r for v, r in zip(values, reach)] + [a.min for a in own]
    high = [v + r for v, r in zip(values, reach)] + [a.max for a in own]
    return np.array(values + inside), np.array(low), np.array(high)


def least_rmse(measured):
    """Fit every candidate alone together with the parameters, and return the one with the least RMSE."""
    from scipy.optimize import least_squares

    left = {}
    simulator = Simulator()
    for name in [None, *CATALOGUE]:
        names = [name] if name else []
        x, low, high = start_and_bounds(names)
        scale = high - low
        done = least_squares(
            lambda u, names=names, scale=scale: residual(measured, u * scale, names, simulator),
            x / scale, bounds=(low / scale, high / scale), diff_step=1e-3, max_nfev=5,
        )  # fmt: skip
        left[name or "nothing"] = float(np.sqrt(np.mean(done.fun**2)))
    return min(left, key=left.get), left, simulator.runs


def sysid(measured):
    """Fit all at once with `mujoco.sysid`, and return the candidates whose 95 % interval excludes the off-value."""
    import mujoco.sysid

    names = list(CATALOGUE)
    x, low, high = start_and_bounds(names)
    scale = high - low
    params = mujoco.sysid.ParameterDict(
        {n: mujoco.sysid.Parameter(n, v, a, b) for n, v, a, b in zip([*PARAMETERS, *names], x / scale, low / scale, high / scale)}
    )
    simulator = Simulator()

    def left(u, _, **__):
        u = np.asarray(u)
        if u.ndim > 1:  # the optimiser requests several models at once, one per column
            rows = [residual(measured, column * scale, names, simulator) for column in u.T]
            return [np.stack(rows, axis=1)], None, None
        return [residual(measured, u * scale, names, simulator)], None, None

    fitted, result = mujoco.sysid.optimize(params, left, optimizer="mujoco", verbose=False, max_iters=8)
    end = residual(measured, fitted.as_vector() * scale, names, simulator)
    _, intervals = mujoco.sysid.calculate_intervals([end], np.asarray(result.jac))
    best = fitted.as_vector() * scale
    sure = np.asarray(intervals).ravel() * scale
    first = len(PARAMETERS)
    said = [n for i, n in enumerate(names) if abs(best[first + i] - OFF[n]) > sure[first + i] + 1e-4 * scale[first + i]]
    return said, float(np.sqrt(np.mean(end**2))), simulator.runs


def row(case, with_others):
    """Return the cells of one row of the table, and whether the diagnosis is right."""
    measured = built(case, seed=11)
    begun = time.monotonic()
    found, runs = diagnosed(measured)
    seconds = time.monotonic() - begun
    wanted = case.expected or case.kind
    said = ", ".join(found.named) or ("nothing" if found.verdict in ("no_gap", "parameters") else found.verdict)
    is_right = said == wanted or (wanted == "nothing of the catalogue" and not found.named and found.verdict != "no_gap")
    value = next((f"{v:.3g}" for n in found.named for v in found.effects[n].values()), "-")
    best = max(found.probabilities.values(), default=0.0)
    left = max(found.how_far["with_effects"].values())
    cells = [case.kind, case.note, f"{said}{'' if is_right else ' (wrong)'}", value, f"{case.size:.3g}", f"{best:.2f}"]
    cells += [f"{left:.1f}", f"{runs}"]
    if with_others:
        name, all_left, plain_runs = least_rmse(measured)
        names, sysid_left, sysid_runs = sysid(measured)
        cells += [f"{name} ({all_left[name]:.1f})", f"{', '.join(names) or 'nothing'} ({sysid_left:.1f})"]
        cells.append(f"{plain_runs} / {sysid_runs}")
    print(" | ".join(cells), f"[{seconds:.0f} s]", file=sys.stderr, flush=True)
    return cells, is_right


HEAD = ["hidden", "its form", "named", "value", "hidden value", "probability", "left, in noise", "models"]
OTHERS = ["least RMSE, alone (left)", "`mujoco.sysid`, all at once (left)", "their models"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", help="Markdown file for the table")
    parser.add_argument("--only", help="run only the case with this name")
    parser.add_argument("--alone", action="store_true", help="run only the diagnosis, without the other methods")
    parser.add_argument("--jobs", type=int, default=None, help="cases that run in parallel [default: one per processor]")
    args = parser.parse_args()
    cases = [case for case in CASES if args.only in (None, case.kind)]
    with ProcessPoolExecutor(args.jobs) as pool:
        rows = list(pool.map(row, cases, [not args.alone] * len(cases)))
    head = HEAD + ([] if args.alone else OTHERS)
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    lines += ["| " + " | ".join(cells) + " |" for cells, _ in rows]
    right = sum(ok for _, ok in rows)
    text = "\n".join(lines) + f"\n\n{right} of {len(rows)} right.\n"
    print(text)
    if args.out:
        with open(args.out, "w", encoding="utf-8") as file:
            file.write(f"# Actuator effects hidden in a MuJoCo arm\n\n{ABOUT}\n{text}")


ABOUT = f"""Made by `python/examples/mujoco_actuators.py --out reference/mujoco.md` with MuJoCo {mujoco.__version__}. A two-link
arm under position control; both joints are recorded at 100 Hz for {SECONDS:.0f} s with noise of {NOISE_RAD} rad. A copy of the
arm takes the place of the real machine; its tool and gains differ from the simulator's, within their tolerances. The equations
of each hidden effect differ from the catalogue's. "Left" is the RMS error in multiples of the noise: noise alone gives 1.
`mujoco.sysid` fits all parameters and all seven candidates at once; the table lists the candidates whose 95 % interval excludes
the value at which they have no effect.
"""


if __name__ == "__main__":
    main()
