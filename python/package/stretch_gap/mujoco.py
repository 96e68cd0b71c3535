"""A problem from a MuJoCo model and a recording, without glue.

>>> import stretch_gap.mujoco
>>> problem = stretch_gap.mujoco.problem("arm.xml", recording)       # doctest: +SKIP
>>> found = problem.diagnose()                                       # doctest: +SKIP
>>> left = found.apply(spec := problem.spec)                         # doctest: +SKIP

Joints are found by their names among the columns. Gains, damping and armature that the model has are parameters with
tolerances; friction loss, damping and armature that it lacks are candidates, in addition to whatever may be around a simulator
(delay, backlash, a flexible joint ...).
"""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import problem as entries
from ._stretch import StretchError
from .joints import Joint, found, require_commands, trials
from .model_values import DOF, GAIN, RATE_GAIN, UNITS, apply, parts, read, write

if TYPE_CHECKING:
    from .diagnosis import Diagnosis

__all__ = ["Problem", "Simulator", "apply", "problem"]

Array = NDArray[np.float64]

TOLERANCES = {GAIN: 0.2, RATE_GAIN: 0.5, "damping": 0.5, "armature": 0.5, "frictionloss": 0.5}
"""One standard deviation, a share of what the model says."""


def library() -> Any:
    """The package `mujoco`, or the sentence that says how to get it."""
    try:
        import mujoco  # type: ignore[import-untyped,import-not-found,unused-ignore]
        import mujoco.rollout  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        raise StretchError("the package mujoco is not installed; pip install mujoco") from None
    return mujoco


@dataclass
class Simulator:
    """A MuJoCo model that joints' commands drive, several models at once."""

    model: Any
    joints: Sequence[Joint]
    names: Sequence[str]
    """Parameters and effects of the model: a joint or an actuator, and what of it."""
    batch: int = 32
    columns: Mapping[str, Array] = field(default_factory=dict)

    def begin(self, session: Mapping[str, Any]) -> None:
        """Notes the recording, and brings the step of the model to a whole part of its sample time."""
        self.dt_s, self.columns = float(session["dt_s"]), session["columns"]
        self.steps = max(1, round(self.dt_s / float(self.model.opt.timestep)))
        self.model.opt.timestep = self.dt_s / self.steps

    def varied(self, values: Mapping[str, float]) -> Any:
        """A copy of the model with these values."""
        model = copy.copy(self.model)
        for name, value in values.items():
            owner, what = parts(name)
            write(model, owner, what, value)
        return model

    def simulate(self, params: Any, effects: Any, inputs: Mapping[str, Array], trials: Sequence[Any]) -> dict[str, Array]:
        """Positions of the joints by column, trial by trial from the measured position at rest."""
        mujoco = library()
        count = params.shape[0]
        values = {name: params[name] for name in params.names} | {name: effects[name] for name in effects.names}
        models = [self.varied({name: float(v[i]) for name, v in values.items()}) for i in range(count)]
        samples = trials[-1].samples.stop
        out = {joint.measured: np.empty((count, samples)) for joint in self.joints}
        data = [mujoco.MjData(self.model) for _ in range(min(count, os.cpu_count() or 1))]
        for part in trials:
            state, control = self._begun(mujoco, count, inputs, part.samples)
            states, _ = mujoco.rollout.rollout(models, data, state, control)
            for joint in self.joints:
                at = 1 + int(self.model.jnt_qposadr[self.model.joint(joint.name).id])
                out[joint.measured][:, part.samples.start] = state[:, at] / joint.scale
                rest = states[:, self.steps - 1 :: self.steps, at][:, : part.samples.stop - part.samples.start - 1]
                out[joint.measured][:, part.samples.start + 1 : part.samples.stop] = rest / joint.scale
        broken = [i for i in range(count) if not all(np.isfinite(x[i]).all() for x in out.values())]
        for i in broken:  # reported as no number, which takes that model out
            for x in out.values():
                x[i] = np.nan
        return out

    def _begun(self, mujoco: Any, count: int, inputs: Mapping[str, Array], span: slice) -> tuple[Array, Array]:
        """States at the beginning of a trial, and controls at every step of it."""
        start = mujoco.MjData(self.model)
        if self.model.nkey:
            mujoco.mj_resetDataKeyframe(self.model, start, 0)
        control = np.repeat(start.ctrl[np.newaxis], count * (span.stop - span.start) * self.steps, 0)
        control = control.reshape(count, -1, self.model.nu)
        for joint in self.joints:
            at = int(self.model.jnt_qposadr[self.model.joint(joint.name).id])
            start.qpos[at] = joint.scale * self.columns[joint.measured][span.start]
            moved = np.repeat(joint.scale * inputs[joint.commanded][:, span], self.steps, axis=1)
            control[:, :, self.model.actuator(joint.actuator).id] = moved
        kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
        state = np.empty(mujoco.mj_stateSize(self.model, kind))
        mujoco.mj_getState(self.model, start, state, kind)
        return np.repeat(state[np.newaxis], count, 0), np.ascontiguousarray(control)


@dataclass
class Problem:
    """A model with recordings: what `stretch_gap.diagnose` takes, ready to be changed before it is asked."""

    spec: Any
    """The model's specification, as `MjSpec`."""
    simulator: Simulator
    trials: list[entries.Trial]
    stages: list[entries.Stage]
    parameters: dict[str, entries.Parameter]
    effects: dict[str, entries.Argument]
    notes: list[str]
    """What was left out, and why."""

    def diagnose(self, **more: Any) -> Diagnosis:
        """Says what the model lacks; further arguments are those of `stretch_gap.diagnose`."""
        from .diagnosis import diagnose

        given: dict[str, Any] = {"stages": self.stages, "parameters": self.parameters, "effects": self.effects}
        made = diagnose(self.simulator, self.trials, **{**given, **more})
        made._answer["notes"] = self.notes + made._answer["notes"]
        return made


def problem(
    model: Any,
    recording: entries.Data,
    *,
    joints: Sequence[str] | Mapping[str, tuple[str, str]] | None = None,
    rate_hz: float | None = None,
    degrees: bool | None = None,
) -> Problem:
    """Makes simulator, parameters with tolerances, and candidates from a model and what was recorded of it.

    `model` is the path of an XML file, its text, or an `MjSpec`. `recording` is whatever `stretch_gap.diagnose` takes as
    data. `joints` says which joints of the model are looked at, by name, or also by which columns: `{"elbow":
    ("elbow_cmd_rad", "elbow_rad")}`; without it, all whose name is in the columns. Angles are in radians; columns that
    end with `_deg` are in degrees, and all with `degrees=True`.

    Refused, with what to do: joints that no column is called like, joints that never moved, a command that is the
    measurement, angles that can only be degrees, joints without a position actuator, balls and free bodies, whose positions
    are quaternions.
    """
    mujoco = library()
    spec = specification(mujoco, model)
    compiled = spec.compile()
    given = trials(recording, rate_hz)
    hinges = {
        compiled.joint(i).name: int(compiled.jnt_type[i]) in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
        for i in range(compiled.njnt)
    }
    actuators = {
        compiled.joint(compiled.actuator_trnid[i, 0]).name: compiled.actuator(i).name
        for i in range(compiled.nu)
        if int(compiled.actuator_trntype[i]) == int(mujoco.mjtTrn.mjTRN_JOINT)
    }
    limits = {
        compiled.joint(i).name: (float(compiled.jnt_range[i, 0]), float(compiled.jnt_range[i, 1]))
        for i in range(compiled.njnt)
        if compiled.jnt_limited[i] and int(compiled.jnt_type[i]) == int(mujoco.mjtJoint.mjJNT_HINGE)
    }
    chosen, notes = found(hinges, actuators, limits, given, joints, degrees)
    require_commands(chosen, given)
    for joint in chosen:
        if (
            read(compiled, joint.actuator, GAIN) <= 0.0
            or compiled.actuator_biasprm[compiled.actuator(joint.actuator).id, 1] >= 0.0
        ):
            raise StretchError(
                f"joint {joint.name}: its actuator {joint.actuator} is no position actuator; give the model <position joint="
                f"{joint.name!r} kp=.../>, or write a simulator of your own"
            )
    parameters, effects = looked_for(compiled, chosen, given)
    stages = [entries.Stage(j.measured, (j.commanded,), name=j.name, unit="rad" if j.scale == 1.0 else "deg") for j in chosen]
    return Problem(spec, Simulator(compiled, chosen, (*parameters, *effects)), given, stages, parameters, effects, notes)


def specification(mujoco: Any, model: Any) -> Any:
    """A model's specification from a path, from text, or as it is."""
    if isinstance(model, mujoco.MjSpec):
        return model
    text = os.fspath(model)
    try:
        return mujoco.MjSpec.from_string(text) if text.lstrip().startswith("<") else mujoco.MjSpec.from_file(text)
    except (ValueError, OSError) as error:
        raise StretchError(f"the model {text[:60]!r} cannot be read: {error}") from None


def looked_for(
    model: Any, joints: Sequence[Joint], given: Sequence[entries.Trial]
) -> tuple[dict[str, entries.Parameter], dict[str, entries.Argument]]:
    """What the model has as parameters with tolerances, and what it lacks as candidates up to what the recording can hold."""
    parameters: dict[str, entries.Parameter] = {}
    effects: dict[str, entries.Argument] = {}
    for joint in joints:
        for owner, what in [(joint.actuator, w) for w in (GAIN, RATE_GAIN)] + [(joint.name, w) for w in DOF]:
            value, name = read(model, owner, what), f"{owner}_{what}"
            if value > 0.0 and what != "frictionloss":
                parameters[name] = entries.Parameter(value, relative=TOLERANCES[what], unit=UNITS[what], least=1e-3 * value)
            elif what != RATE_GAIN:
                most = greatest(model, joint, given)[what]
                effects[name] = entries.Argument(0.0, value + most, off=value, unit=UNITS[what])
    return parameters, effects


def greatest(model: Any, joint: Joint, given: Sequence[entries.Trial]) -> dict[str, float]:
    """How large what is lacking could be: the torque of the servo over speed and acceleration that were recorded."""
    gain, torque, speed, acceleration = read(model, joint.actuator, GAIN), 0.0, 0.0, 0.0
    for trial in given:
        measured = joint.scale * np.asarray(trial.columns[joint.measured], dtype=float)
        commanded = joint.scale * np.asarray(trial.columns[joint.commanded], dtype=float)
        stamps = np.arange(measured.size) / (trial.rate_hz or 1.0) if trial.time_s is None else np.asarray(trial.time_s, float)
        reach = max(1, measured.size // 2000)
        rate = (measured[2 * reach :] - measured[: -2 * reach]) / (stamps[2 * reach :] - stamps[: -2 * reach])
        torque = max(torque, gain * float(np.quantile(np.abs(commanded - measured), 0.99)))
        speed = max(speed, float(np.quantile(np.abs(rate), 0.9)))
        acceleration = max(acceleration, float(np.quantile(np.abs(np.gradient(rate, stamps[reach:-reach])), 0.9)))
    return {
        "frictionloss": torque,
        "damping": torque / max(speed, 1e-9),
        "armature": torque / max(acceleration, 1e-9),
        GAIN: gain,
    }
