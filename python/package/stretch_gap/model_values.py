"""Values of joints and actuators of a MuJoCo model: read and set in a compiled model, and written into a specification."""

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
    """Write the result of a diagnosis into a MuJoCo specification.

    Parameters and effects of joints and actuators are written as values of the specification. A delay of a command becomes the
    delay of its actuator if this version of MuJoCo supports it.

    Parameters
    ----------
    diagnosis : Diagnosis
        Diagnosis of a `problem`.
    spec : mujoco.MjSpec
        Specification of the model, usually `problem.spec`. It is changed in place.

    Returns
    -------
    list of str
        Named effects that a specification cannot represent. `diagnosis.fix().code` contains functions for them.

    Raises
    ------
    StretchError
        If the specification does not contain a joint or an actuator of the problem.

    Examples
    --------
    >>> left = stretch_gap.mujoco.apply(found, problem.spec)  # doctest: +SKIP
    """
    own = {name: next(iter(values.values())) for name, values in diagnosis.effects.items() if _owner(spec, name) and values}
    for name, value in {**diagnosis.parameters, **own}.items():
        found = _owner(spec, name)
        if found is None:
            owner, what = parts(name)
            kind = "joint" if what in DOF else "actuator"
            raise StretchError(f"{name}: the specification has no {kind} {owner}; give that of the problem (problem.spec)")
        _write_spec(found, parts(name)[1], value)
    left = [name for name in diagnosis.effects if name not in own]
    return [name for name in left if not _delayed(diagnosis, spec, name)]


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
    """Write the delay of a command as the delay of its actuator. Return False if the effect is not such a delay."""
    place, _, kind = name.rpartition(".")
    joints = {joint.name for joint in spec.joints}
    joint = next((part for part in place.split(".") if part in joints), None)
    if joint is None and len(spec.actuators) == 1:
        joint = spec.actuators[0].target
    own = [actuator for actuator in spec.actuators if actuator.target == joint]
    if kind != "delay" or "output" in place or len(own) != 1 or not hasattr(own[0], "delay"):
        return False
    # MuJoCo rounds a delay up to whole steps, and a delay that is longer by an error of the fit would act a step too late
    steps = max(1, round(diagnosis.effects[name]["delay_s"] / spec.option.timestep))
    own[0].delay = (steps - 0.5) * spec.option.timestep
    own[0].nsample = steps + 2
    return True
