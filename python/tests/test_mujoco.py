"""Tests of problems made from two MuJoCo models. SKIPPED without the package mujoco."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest
import stretch_gap

mujoco = pytest.importorskip("mujoco", reason="SKIPPED: the package mujoco is not installed")
import stretch_gap.mujoco  # noqa: E402

# The joint and its actuator have the same name.
ONE = """
<mujoco model="pendulum">
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <body>
      <joint name="elbow" type="hinge" axis="0 1 0" armature="0.02"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.5"/>
    </body>
  </worldbody>
  <actuator><position name="elbow" joint="elbow" kp="20" kv="1"/></actuator>
</mujoco>
"""
TWO = """
<mujoco model="arm">
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <body>
      <joint name="lift" type="hinge" axis="0 1 0" armature="0.05"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.8" contype="0" conaffinity="0"/>
      <body pos="0 0 -0.3">
        <joint name="lift_tip" type="hinge" axis="0 1 0" armature="0.01" range="-90 90"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.015" mass="0.3" contype="0" conaffinity="0"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="big" joint="lift" kp="60" kv="3"/>
    <position name="small" joint="lift_tip" kp="15" kv="0.5"/>
  </actuator>
</mujoco>
"""
RATE_HZ = 100.0


def commands(joints, seconds=22.0):
    """Return the commanded position of each joint, rad."""
    t = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    return {
        name: 0.5 * np.sin((1.1 + 0.4 * i) * t) + 0.15 * np.sin((3.7 - 0.5 * i) * t + 1.0) + 0.05 * np.sin(9.0 * t)
        for i, name in enumerate(joints)
    }


def measured(xml, change, asked, late=0):
    """Return the positions of a copy of the model that `change` has altered, with the noise of an encoder."""
    spec = mujoco.MjSpec.from_string(xml)
    change(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    joints = list(asked)
    out = {name: [] for name in joints}
    for i in range(len(next(iter(asked.values())))):
        for name in joints:
            out[name].append(data.joint(name).qpos[0])
        for k, name in enumerate(joints):
            data.ctrl[k] = asked[name][max(i - late, 0)]
        for _ in range(5):
            mujoco.mj_step(model, data)
    draw = np.random.default_rng(3)
    return {name: np.array(values) + 2e-4 * draw.normal(size=len(values)) for name, values in out.items()}


def recording(asked, seen):
    stamps = {"time_s": np.arange(len(next(iter(asked.values())))) / RATE_HZ}
    return stamps | {f"{n}_cmd_rad": v for n, v in asked.items()} | {f"{n}_rad": v for n, v in seen.items()}


@pytest.fixture(scope="module")
def rubbing():
    asked = commands(["elbow"])

    def change(spec):
        spec.joints[0].frictionloss = 0.6
        spec.actuators[0].gainprm[0], spec.actuators[0].biasprm[1] = 22.0, -22.0

    problem = stretch_gap.mujoco.problem(ONE, recording(asked, measured(ONE, change, asked)))
    return problem, problem.diagnose(wrap=["input.delay", "input.backlash", "output.backlash", "output.lag"])


def test_the_model_says_what_is_looked_for():
    asked = commands(["lift", "lift_tip"])
    problem = stretch_gap.mujoco.problem(TWO, recording(asked, measured(TWO, lambda spec: None, asked)))
    assert [stage.name for stage in problem.stages] == ["lift", "lift_tip"]
    assert problem.stages[0].inputs == ("lift_cmd_rad",) and problem.stages[1].output == "lift_tip_rad"
    assert problem.parameters["big_kp"].value == 60.0 and problem.parameters["lift_tip_armature"].value == 0.01
    assert set(problem.effects) == {"lift_damping", "lift_frictionloss", "lift_tip_damping", "lift_tip_frictionloss"}
    assert problem.effects["lift_frictionloss"].off == 0.0 and problem.effects["lift_frictionloss"].max > 0.5


def test_a_friction_is_named_and_written_back(rubbing):
    problem, found = rubbing
    assert found.named == ["elbow_frictionloss"]
    assert found.effects["elbow_frictionloss"]["elbow_frictionloss"] == pytest.approx(0.6, rel=0.1)
    spec = problem.spec
    assert found.apply(spec) == []
    model = spec.compile()
    assert model.dof_frictionloss[0] == pytest.approx(0.6, rel=0.1)
    assert model.actuator_gainprm[0, 0] == pytest.approx(22.0, rel=0.05)
    assert model.actuator_biasprm[0, 1] == -model.actuator_gainprm[0, 0]


def test_a_late_command_of_one_of_two_joints_becomes_its_actuators_delay():
    asked = commands(["lift", "lift_tip"])
    seen = measured(TWO, lambda spec: None, asked, late=3)
    problem = stretch_gap.mujoco.problem(TWO, recording(asked, seen))
    found = problem.diagnose(wrap=["lift.input.delay", "lift_tip.input.delay", "lift_tip.output.backlash"], depth=2)
    late = {name: values["delay_s"] for name, values in found.effects.items() if name.endswith("delay")}
    assert len(late) == 2 and all(0.025 < delay_s < 0.035 for delay_s in late.values())
    spec = problem.spec
    if not hasattr(spec.actuators[0], "delay"):
        pytest.skip("SKIPPED: this MuJoCo's actuators have no delay")
    assert found.apply(spec) == []
    model, data = spec.compile(), None
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.5
    for _ in range(10):  # 20 ms is shorter than the delay
        mujoco.mj_step(model, data)
    before = abs(data.qpos[0])
    for _ in range(40):
        mujoco.mj_step(model, data)
    assert before < 1e-3 < abs(data.qpos[0])


@pytest.mark.parametrize("place", ["input", "output"])
def test_a_delay_that_was_written_into_the_model_is_no_longer_missing(place):
    asked = commands(["elbow"])
    asked["elbow"] *= np.minimum(np.arange(asked["elbow"].size) / RATE_HZ, 1.0)  # from rest
    seen = measured(ONE, lambda spec: None, asked, late=4 if place == "input" else 0)
    if place == "output":
        seen["elbow"] = np.concatenate([np.repeat(seen["elbow"][0], 4), seen["elbow"][:-4]])
    data = recording(asked, seen)
    problem = stretch_gap.mujoco.problem(ONE, data)
    # The values of this model are exact. A larger inertia with less damping would look much like a delay.
    found = problem.diagnose(wrap=[f"{place}.delay", "output.backlash"], parameters={})
    assert found.named == [f"{place}.delay"]
    if not hasattr(problem.spec.actuators[0], "delay"):
        pytest.skip("SKIPPED: this MuJoCo has no delays")
    assert found.apply(problem.spec) == []
    problem.spec.compile()
    again = stretch_gap.mujoco.problem(problem.spec.to_xml(), data).diagnose(
        wrap=["input.delay", "output.delay", "output.backlash"]
    )
    assert again.named == [] and again.verdict in ("no_gap", "parameters"), again.sentence


def test_a_friction_is_written_into_urdf_and_sdf(rubbing):
    _, found = rubbing
    elbow = "<joint name='elbow' type='revolute'><dynamics damping='0.1'/></joint>"
    urdf = ElementTree.fromstring(f"<robot name='arm'>{elbow}<joint name='wrist' type='fixed'/></robot>")
    left = found.apply(urdf)
    dynamics = urdf.find("joint[@name='elbow']/dynamics")
    assert float(dynamics.get("friction")) == pytest.approx(0.6, rel=0.1) and dynamics.get("damping") == "0.1"
    assert {"elbow_kp", "elbow_kv", "elbow_armature"} == set(left)  # URDF has no servo and no armature
    sdf = ElementTree.fromstring("<sdf version='1.9'><model name='arm'><joint name='elbow' type='revolute'/></model></sdf>")
    assert found.apply(sdf) == left
    assert float(sdf.find(".//joint/axis/dynamics/friction").text) == pytest.approx(0.6, rel=0.1)
    with pytest.raises(stretch_gap.StretchError, match="no joint elbow; the joints are wrist"):
        found.apply(ElementTree.fromstring("<robot><joint name='wrist' type='fixed'/></robot>"))
    with pytest.raises(stretch_gap.StretchError, match="<html> is no description of a robot"):
        found.apply(ElementTree.fromstring("<html/>"))


def told(match, **change):
    asked = commands(["elbow"], 4.0)
    columns = recording(asked, measured(ONE, lambda spec: None, asked))
    more = {key: change.pop(key) for key in ("joints", "degrees") if key in change}
    columns = {**columns, **change.pop("columns", {})}
    for old, new in change.pop("called", {}).items():
        columns[new] = columns.pop(old)
    with pytest.raises(stretch_gap.StretchError, match=match):
        stretch_gap.mujoco.problem(change.pop("model", ONE), columns, **more)


def test_joints_that_are_called_otherwise_are_told_with_what_to_do():
    told("no joint of the model moves.*joints=", called={"elbow_cmd_rad": "ellbogen_cmd_rad", "elbow_rad": "ellbogen_rad"})
    told("no joint 'elbo'.*is it 'elbow'", joints=["elbo"])
    told("no column elbow_pos", joints={"elbow": ("elbow_cmd_rad", "elbow_pos")})


def test_what_cannot_be_right_is_told_with_what_to_do():
    asked = commands(["elbow"], 4.0)["elbow"]
    seen = measured(ONE, lambda spec: None, {"elbow": asked})["elbow"]
    told("never moved.*leave it out", joints=["elbow"], columns={"elbow_rad": np.zeros_like(asked)})
    told("is equal to the measurement", columns={"elbow_cmd_rad": seen})
    told("same value in every row, although the joint moves", columns={"elbow_cmd_rad": np.zeros_like(asked)})
    told("one of elbow_cmd_rad and elbow_deg is in degrees and one is not", called={"elbow_rad": "elbow_deg"})
    narrow = ONE.replace('armature="0.02"', 'armature="0.02" range="-60 60"')
    turned = {"elbow_cmd": np.degrees(asked), "elbow": np.degrees(seen)}
    names = {"elbow_cmd_rad": "x", "elbow_rad": "y"}
    told("in degrees; give degrees=True", model=narrow, columns=turned, called=names)
    ball = ONE.replace("<geom", '<geom name="g"').replace('type="hinge" axis="0 1 0" armature="0.02"', 'type="ball"')
    told("quaternion", model=ball.split("<actuator>")[0] + "</mujoco>", joints=["elbow"])
    told(
        "is not a position actuator",
        model=ONE.replace('<position name="elbow" joint="elbow" kp="20" kv="1"/>', '<motor name="motor" joint="elbow"/>'),
    )


def test_columns_in_degrees_give_the_same_problem(rubbing):
    problem, _ = rubbing
    trial = problem.trials[0]
    turned = {
        "time_s": np.asarray(trial.time_s),
        "elbow_cmd_deg": np.degrees(trial.columns["elbow_cmd_rad"]),
        "elbow_deg": np.degrees(trial.columns["elbow_rad"]),
    }
    other = stretch_gap.mujoco.problem(ONE, turned)
    span = type("Span", (), {"samples": slice(0, 400), "start_s": 0.0, "name": "a"})
    seen = []
    for one, column in ((problem, "elbow_rad"), (other, "elbow_deg")):
        columns = {name: np.asarray(values, dtype=float) for name, values in one.trials[0].columns.items()}
        one.simulator.begin({"dt_s": 0.01, "columns": columns})
        named = stretch_gap.simulator.Named
        params = named.of(np.array([[p.value for p in one.parameters.values()]]), list(one.parameters))
        effects = named.of(np.array([[e.off for e in one.effects.values()]]), list(one.effects))
        inputs = {name: values[np.newaxis] for name, values in columns.items()}
        seen.append(one.simulator.simulate(params, effects, inputs, [span])[column][0])
    assert np.allclose(np.degrees(seen[0]), seen[1], atol=1e-9)
