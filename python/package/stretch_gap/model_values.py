"""Values of joints and actuators in a compiled MuJoCo model, and their way into its specification, a URDF or an SDF."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ._stretch import StretchError

if TYPE_CHECKING:
    from .diagnosis import Diagnosis

GAIN = "kp"
RATE_GAIN = "kv"
DOF = ("damping", "armature", "frictionloss")
"""Values of a joint. A compiled model stores them as `dof_NAME`, a specification as `NAME`."""
SENSOR = "{}_measured"
"""Name of the sensor of a joint that shows what the recording shows."""
UNITS = {"damping": "N m s/rad", "armature": "kg m^2", "frictionloss": "N m", GAIN: "N m/rad", RATE_GAIN: "N m s/rad"}


def parts(name: str) -> tuple[str, str]:
    """Split the name of a parameter into its owner and the value: `elbow_damping` is the damping of `elbow`."""
    owner, _, what = name.rpartition("_")
    return (owner, what) if what in UNITS else ("", name)


def write(model: Any, owner: str, what: str, value: float) -> None:
    """Set a value of a joint or of an actuator in a compiled model."""
    if what in DOF:
        getattr(model, f"dof_{what}")[model.jnt_dofadr[model.joint(owner).id]] = value
        return
    actuator = model.actuator(owner).id
    if what == GAIN:
        model.actuator_gainprm[actuator, 0], model.actuator_biasprm[actuator, 1] = value, -value
    else:
        model.actuator_biasprm[actuator, 2] = -value


def read(model: Any, owner: str, what: str) -> float:
    """Return a value of a joint or of an actuator in a compiled model."""
    if what in DOF:
        return float(getattr(model, f"dof_{what}")[model.jnt_dofadr[model.joint(owner).id]])
    actuator = model.actuator(owner).id
    return float(model.actuator_gainprm[actuator, 0] if what == GAIN else -model.actuator_biasprm[actuator, 2])


def apply(diagnosis: Diagnosis, spec: Any) -> list[str]:
    """Write the result of a diagnosis into the description of a robot: a MuJoCo specification, a URDF or an SDF.

    Values whose names are a joint or an actuator and a quantity, such as `elbow_damping`, are written into the description. The
    quantities are `damping`, `frictionloss` and, in MuJoCo only, `armature`, `kp` and `kv`. In MuJoCo, a delay of a command
    becomes the delay of its actuator, and a delay of a measured position becomes a sensor `JOINT_measured` with this delay, if
    this version of MuJoCo supports it. The sensor shows what the recording shows, and `problem` reads it in place of the joint.

    Parameters
    ----------
    diagnosis : Diagnosis
        Diagnosis of a `problem`, or of a simulator of your own with parameters and effects of such names.
    spec : mujoco.MjSpec or xml.etree.ElementTree.Element
        Specification of the model, usually `problem.spec`, or the root element of a URDF (`<robot>`) or an SDF (`<sdf>`). It is
        changed in place.

    Returns
    -------
    list of str
        Parameters and named effects that the description cannot represent. `diagnosis.fix().code` contains functions for the
        effects.

    Raises
    ------
    StretchError
        If the description does not contain a joint or an actuator of the diagnosis, or is of another kind.

    Examples
    --------
    >>> from xml.etree import ElementTree
    >>> robot = ElementTree.fromstring("<robot name='arm'><joint name='elbow' type='revolute'/></robot>")
    >>> left = stretch_gap.mujoco.apply(found, robot)  # doctest: +SKIP
    """
    own = {name: next(iter(values.values())) for name, values in diagnosis.effects.items() if parts(name)[0] and values}
    values = {**diagnosis.parameters, **own}
    if hasattr(spec, "tag"):
        left = [name for name, value in values.items() if not _described(spec, name, value)]
        return left + [name for name in diagnosis.effects if name not in own]
    for name, value in values.items():
        found = _owner(spec, name)
        if found is None:
            owner, what = parts(name)
            kind = "joint" if what in DOF else "actuator"
            raise StretchError(f"{name}: the specification has no {kind} {owner}; give that of the problem (problem.spec)")
        _write_spec(found, parts(name)[1], value)
    return [name for name in diagnosis.effects if name not in own and not _delayed(diagnosis, spec, name)]


def _described(root: Any, name: str, value: float) -> bool:
    """Write a value into a URDF or an SDF. Return False if the format has no place for it."""
    if root.tag not in ("robot", "sdf"):
        raise StretchError(f"<{root.tag}> is no description of a robot; give the root of a URDF (<robot>) or an SDF (<sdf>)")
    owner, what = parts(name)
    key = {"damping": "damping", "frictionloss": "friction"}.get(what)
    if key is None:
        return False
    joints = {joint.get("name"): joint for joint in root.iter("joint") if joint.get("type")}
    if owner not in joints:
        raise StretchError(f"{name}: there is no joint {owner}; the joints are {', '.join(map(str, joints))}")
    joint = joints[owner]
    if root.tag == "robot":
        _child(joint, "dynamics").set(key, f"{value:.6g}")
    else:
        _child(_child(_child(joint, "axis"), "dynamics"), key).text = f"{value:.6g}"
    return True


def _child(parent: Any, tag: str) -> Any:
    """Return the first child with this tag; append one if there is none."""
    found = parent.find(tag)
    if found is None:
        found = parent.makeelement(tag, {})
        parent.append(found)
    return found


def _owner(spec: Any, name: str) -> Any:
    """Return the joint or the actuator of a value. The two may have the same name, so the value decides."""
    owner, what = parts(name)
    return next((one for one in (spec.joints if what in DOF else spec.actuators) if one.name == owner), None)


def _write_spec(owner: Any, what: str, value: float) -> None:
    if what in DOF:
        held = getattr(owner, what)
        if np.ndim(held):  # In newer versions of MuJoCo, damping is a polynomial of the speed.
            held[0] = value
        else:
            setattr(owner, what, value)
    elif what == GAIN:
        owner.gainprm[0], owner.biasprm[1] = value, -value
    else:
        owner.biasprm[2] = -value


def _delayed(diagnosis: Diagnosis, spec: Any, name: str) -> bool:
    """Write the delay of a command or of a measured position. Return False if the effect is not such a delay."""
    place, _, kind = name.rpartition(".")
    joints = {joint.name for joint in spec.joints}
    joint = next((part for part in place.split(".") if part in joints), None)
    if joint is None and len(spec.actuators) == 1:
        joint = spec.actuators[0].target
    own = [actuator for actuator in spec.actuators if actuator.target == joint]
    if kind != "delay" or len(own) != 1 or not hasattr(own[0], "delay"):
        return False
    # MuJoCo rounds a delay up to whole steps, and a delay that is longer by an error of the fit would act a step too late.
    step_s = spec.option.timestep
    steps = max(1, round(diagnosis.effects[name]["delay_s"] / step_s))
    delayed = own[0]
    if "output" in place:
        import mujoco  # type: ignore[import-untyped,import-not-found,unused-ignore]

        delayed = spec.add_sensor(name=SENSOR.format(joint), type=mujoco.mjtSensor.mjSENS_JOINTPOS, objname=joint)
        delayed.objtype = mujoco.mjtObj.mjOBJ_JOINT
        steps -= 1  # after a step, a sensor shows the position before it
    delayed.delay = (steps - 0.5) * step_s
    delayed.nsample = steps + 2
    return True
