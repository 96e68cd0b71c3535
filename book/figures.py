"""Draws the figures of the how-to pages into book/src/how-to. Needs the installed packages stretch_gap, matplotlib and
mujoco, and the program stretch.

python book/figures.py
"""

import re
import subprocess
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np
import stretch_gap

PAGES = Path(__file__).parent / "src" / "how-to"
DT_S = 0.02
TIME_S = np.arange(0, 40, DT_S)
plt.rcParams.update(
    {"svg.fonttype": "none", "svg.hashsalt": "stretch", "font.size": 9, "axes.spines.top": False, "axes.spines.right": False}
)


def save(figure, name):
    figure.savefig(PAGES / f"{name}.svg", metadata={"Date": None}, bbox_inches="tight")
    plt.close(figure)


def servo(params, effects, inputs):
    kept, angle, angles = np.exp(-DT_S / params["tau"]), 0.0, []
    for u in inputs["push_V"]:
        angle = kept * angle + (1 - kept) * params["gain"] * u
        angles.append(angle)
    return np.array(angles)


def push(seed):
    random = np.random.default_rng(seed)
    steps = np.repeat(random.normal(size=20), TIME_S.size // 20)
    return 2 * steps + 2 * np.sin((1.1 + 0.1 * seed) * TIME_S)


def recorded(seed, gain=10.4, tau=0.11, late_s=0.04, noise=0.3):
    random = np.random.default_rng(100 + seed)
    angle = servo({"gain": gain, "tau": tau}, {}, {"push_V": push(seed)})
    angle = np.interp(TIME_S - late_s, TIME_S, angle) + random.normal(scale=noise, size=angle.size)
    return {"time_s": TIME_S, "push_V": push(seed), "angle_deg": angle}


def diagnosed():
    return stretch_gap.diagnose(
        servo,
        recorded(1),
        parameters={"gain": (10.0, 1.0), "tau": (0.1, 0.01)},
        output="angle_deg",
        inputs="push_V",
        wrap=["output.delay", "output.backlash", "output.saturation"],
    )


def ranges(found):
    drawn = found.draw(150)
    x = 1000 * np.array([one["tau"] for one in drawn])
    y = 1000 * np.array([one["output.delay.delay_s"] for one in drawn])
    figure, axes = plt.subplots(figsize=(4.2, 3.2))
    box = [(v.mean() - 2 * v.std(), 4 * v.std()) for v in (x, y)]
    axes.add_patch(plt.Rectangle((box[0][0], box[1][0]), box[0][1], box[1][1], color="0.9"))
    axes.plot(x, y, ".", ms=2.5)
    axes.plot(110, 40, "k+", ms=10)
    axes.set(xlabel="time constant, ms", ylabel="delay of the sensor, ms")
    save(figure, "ranges")


def card(found):
    fix = found.fix()
    labels, with_fix, without = [], [], []
    for label, more in (("same model", {}), ("other delay", {"late_s": 0.055})):
        predicted = fix.predict(recorded(2, **more))
        [output] = predicted.outputs
        print(predicted.sentence)
        labels.append(label)
        with_fix.append(output["times_noise"])
        without.append(output["rmse_without"] / output["noise"])
    figure, axes = plt.subplots(figsize=(4.2, 2.6))
    at = np.arange(len(labels))
    axes.bar(at - 0.18, with_fix, 0.34, label="with the fix")
    axes.bar(at + 0.18, without, 0.34, label="without", color="0.75")
    axes.axhline(1.5, color="k", lw=0.8, ls="--")
    axes.set_xticks(at, labels)
    axes.set(ylabel="error, multiples of the noise")
    axes.legend(frameon=False)
    save(figure, "card")


def compare():
    first = recorded(3, late_s=0.0, noise=0.02)
    second = np.radians(np.clip(np.interp(TIME_S - 0.12, TIME_S, first["angle_deg"]), -30, 25))
    found = stretch_gap.compare(
        {"time_s": TIME_S, "angle_deg": first["angle_deg"]},
        {"time_s": TIME_S, "angle_rad": second + np.random.default_rng(5).normal(scale=5e-4, size=second.size)},
    )
    curves = found.curves()
    shown = slice(0, 500)
    figure, (above, below) = plt.subplots(2, 1, figsize=(5.2, 3.4), sharex=True, height_ratios=[2, 1])
    time_s = DT_S * np.arange(curves["measured"].size)
    above.plot(time_s[shown], curves["measured"][shown], "k", lw=1, label="second recording")
    above.plot(time_s[shown], curves["retuned"][shown], lw=1, label="first recording, re-tuned")
    above.legend(frameon=False, ncols=2, loc="lower left", bbox_to_anchor=(0, 1))
    above.set(ylabel="angle, rad")
    below.plot(time_s[shown], (curves["measured"] - curves["retuned"])[shown], lw=1)
    below.set(xlabel="time, s", ylabel="difference, rad")
    save(figure, "compare")
    print(found.sentence)


def plan():
    page = (PAGES / "plan.md").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        for name, language in (("servo.py", "python"), ("problem.toml", "toml")):
            text = re.search(f"```{language}\n(.*?)```", page, re.DOTALL)[1]
            Path(folder, name).write_text(text, encoding="utf-8")
        subprocess.run(["stretch", "plan", "problem.toml", "--out", "runs", "-q"], cwd=folder, check=True)
        figure, axes = plt.subplots(2, 1, figsize=(5.2, 3.2), sharex=True)
        for number, own in enumerate(axes, 1):
            time_s, command_v = np.loadtxt(Path(folder, "runs", f"run_{number}.csv"), delimiter=",", skiprows=1).T
            own.plot(time_s, command_v, lw=1)
            own.set(ylabel="command, V", title=f"run_{number}.csv")
        axes[-1].set(xlabel="time, s")
        figure.tight_layout()
        save(figure, "plan")


def formats():
    import mujoco
    import stretch_gap.mujoco

    model = """<mujoco><option integrator="implicitfast"/><worldbody><body>
        <joint name="elbow" axis="0 1 0" armature="0.02"/><geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.5"/>
        </body></worldbody><actuator><position name="motor" joint="elbow" kp="20" kv="1"/></actuator></mujoco>"""
    command = 0.3 * np.sin(1.5 * TIME_S) + 0.1 * np.sin(5 * TIME_S)

    def simulated(text):
        compiled = mujoco.MjModel.from_xml_string(text)
        data, position = mujoco.MjData(compiled), np.empty(TIME_S.size)
        for i, data.ctrl[0] in enumerate(command):
            position[i] = data.qpos[0]
            mujoco.mj_step(compiled, data, round(DT_S / compiled.opt.timestep))
        return position

    seen = simulated(model.replace("armature", 'frictionloss="1.2" armature'))
    seen = seen + np.random.default_rng(0).normal(scale=1e-3, size=seen.size)
    problem = stretch_gap.mujoco.problem(model, {"time_s": TIME_S, "elbow_cmd_rad": command, "elbow_rad": seen})
    found = problem.diagnose(wrap=None)
    print(found.sentence, found.apply(problem.spec))
    problem.spec.compile()
    figure, axes = plt.subplots(figsize=(5.2, 2.6))
    shown = slice(200, 500)
    for values, label, style in (
        (seen, "recording", "k"),
        (simulated(model), "model", "0.6"),
        (simulated(problem.spec.to_xml()), "fixed model", "C0--"),
    ):
        axes.plot(TIME_S[shown], values[shown], style, lw=1, label=label)
    axes.set(xlabel="time, s", ylabel="position, rad")
    axes.legend(frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0, 1))
    save(figure, "formats")


if __name__ == "__main__":
    found = diagnosed()
    print(found.sentence)
    ranges(found)
    card(found)
    compare()
    plan()
    formats()
