"""Diagnosis of a MuJoCo model with a recording. Requires the package `mujoco`.

The function `problem` defines the problem from the model and the recording, `Problem.diagnose` diagnoses it, and
`Diagnosis.apply` writes the result into the specification of the model. Here a joint has a friction that the model lacks. The
examples of the functions use these names.

>>> import mujoco
>>> import numpy as np
>>> import stretch_gap.mujoco
>>> model = '''<mujoco>
...   <worldbody><body>
...     <joint name="elbow" axis="0 1 0" armature="0.02"/>
...     <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.5"/>
...   </body></worldbody>
...   <actuator><position name="motor" joint="elbow" kp="20" kv="1"/></actuator>
... </mujoco>'''
>>> time_s = np.arange(0, 20, 0.02)
>>> command = 0.5 * np.sin(1.5 * time_s) + 0.2 * np.sin(5 * time_s)
>>> position = 0.001 * np.random.default_rng(0).normal(size=time_s.size)
>>> machine = mujoco.MjModel.from_xml_string(model.replace("armature", 'frictionloss="0.8" armature'))
>>> state = mujoco.MjData(machine)
>>> for i, state.ctrl[0] in enumerate(command):
...     position[i] += state.qpos[0]
...     mujoco.mj_step(machine, state, 10)
>>> recording = {"time_s": time_s, "elbow_cmd_rad": command, "elbow_rad": position}  # or the path of a file
>>> problem = stretch_gap.mujoco.problem(model, recording)
>>> found = problem.diagnose(wrap=None)
>>> found.named
['elbow_frictionloss']
>>> found.apply(problem.spec)
[]
>>> round(float(problem.spec.joint("elbow").frictionloss), 1)
0.8

Columns are assigned to joints by name. Gains, damping and armature that the model has become parameters with tolerances.
Friction loss, damping and armature that the model lacks become candidate effects. Effects around the simulator, such as delay
and backlash, are examined as well.
"""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from . import problem as entries
from ._stretch import StretchError
from .joints import Joint, found, require_commands, trials
from .model_values import DOF, GAIN, RATE_GAIN, SENSOR, UNITS, apply, parts, read, write
from .recordings import Array

if TYPE_CHECKING:
    from .diagnosis import Diagnosis

__all__ = ["Problem", "Simulator", "apply", "problem"]

TOLERANCES = {GAIN: 0.2, RATE_GAIN: 0.5, "damping": 0.5, "armature": 0.5, "frictionloss": 0.5}
"""Tolerances of the values of a model, one standard deviation, as a share of the value."""


def library() -> Any:
    """Import the package `mujoco`. If it is not installed, raise a `StretchError` with the command that installs it."""
    try:
        import mujoco  # type: ignore[import-untyped,import-not-found,unused-ignore]
        import mujoco.rollout  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        raise StretchError("the package mujoco is not installed; run pip install mujoco") from None
    return mujoco


@dataclass
class Simulator:
    """Simulator of a MuJoCo model that is driven by the commands of joints. It simulates several models per call.

    `problem` creates a simulator, and `stretch_gap.diagnose` calls it.

    Parameters
    ----------
    model : mujoco.MjModel
        Compiled model.
    joints : sequence of stretch_gap.joints.Joint
        Joints that are diagnosed, with their actuators and columns.
    names : sequence of str
        Names of the parameters and effects of the model: the joint or actuator, and the value, as in `elbow_damping`.
    batch : int, default 32
        Largest number of models per call.
    columns : dict of str to ndarray of shape (samples,), optional
        Columns of the recordings end to end. `begin` sets them.

    Examples
    --------
    >>> simulator = stretch_gap.mujoco.problem(model, recording).simulator
    >>> [joint.actuator for joint in simulator.joints], simulator.batch
    (['motor'], 32)
    """

    model: Any
    joints: Sequence[Joint]
    names: Sequence[str]
    batch: int = 32
    columns: Mapping[str, Array] = field(default_factory=dict)

    def begin(self, session: Mapping[str, Any]) -> None:
        """Store the recording, and set the time step of the model such that the sample interval is a multiple of it.

        Parameters
        ----------
        session : dict
            Everything that stays the same during a diagnosis. `dt_s` (the sample interval, s) and `columns` (arrays by name)
            are used.

        Examples
        --------
        >>> problem.simulator.begin({"dt_s": 0.02, "columns": recording})
        >>> problem.simulator.steps
        10
        """
        self.dt_s, self.columns = float(session["dt_s"]), session["columns"]
        self.steps = max(1, round(self.dt_s / float(self.model.opt.timestep)))
        self.model.opt.timestep = self.dt_s / self.steps

    def varied(self, values: Mapping[str, float]) -> Any:
        """Return a copy of the model with other values.

        Parameters
        ----------
        values : dict of str to float
            Values by name, as in `names`.

        Returns
        -------
        mujoco.MjModel
            The changed copy.

        Raises
        ------
        KeyError
            If a name is not that of a value of a joint or an actuator of the model.

        Examples
        --------
        >>> varied = problem.simulator.varied({"elbow_damping": 0.5})
        >>> float(varied.dof_damping[0])
        0.5
        """
        model = copy.copy(self.model)
        for name, value in values.items():
            owner, what = parts(name)
            write(model, owner, what, value)
        return model

    def simulate(self, params: Any, effects: Any, inputs: Mapping[str, Array], trials: Sequence[Any]) -> dict[str, Array]:
        """Simulate n models over the given recordings.

        Each recording starts at rest, at the first measured position of each joint.

        Parameters
        ----------
        params : ndarray of shape (n, parameters)
            Values of the parameters, with columns by name.
        effects : ndarray of shape (n, effects)
            Values of the effects, with columns by name.
        inputs : dict of str to ndarray of shape (n, samples)
            Columns that drive the joints.
        trials : sequence
            Recordings end to end. The attribute `samples` of each is the slice of its samples.

        Returns
        -------
        dict of str to ndarray of shape (n, samples)
            Positions by column, in the unit of the column. NaN for a model that diverges.

        Raises
        ------
        StretchError
            If mujoco is not installed.

        Examples
        --------
        >>> def simulate(params, effects, inputs, trials):  # a simulator of your own around this one, for stretch_gap.diagnose
        ...     return problem.simulator.simulate(params, effects, inputs, trials)
        """
        mujoco = library()
        count = params.shape[0]
        values = {name: params[name] for name in params.names} | {name: effects[name] for name in effects.names}
        models = [self.varied({name: float(v[i]) for name, v in values.items()}) for i in range(count)]
        samples = trials[-1].samples.stop
        out = {joint.measured: np.empty((count, samples)) for joint in self.joints}
        data = [mujoco.MjData(self.model) for _ in range(min(count, os.cpu_count() or 1))]
        for part in trials:
            state, control = self._begun(mujoco, count, inputs, part.samples)
            states, sensors = mujoco.rollout.rollout(models, data, state, control)
            for joint in self.joints:
                at = 1 + int(self.model.jnt_qposadr[self.model.joint(joint.name).id])
                out[joint.measured][:, part.samples.start] = state[:, at] / joint.scale
                sensor = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_SENSOR, SENSOR.format(joint.name))
                shown = states[:, :, at] if sensor < 0 else sensors[:, :, self.model.sensor_adr[sensor]]
                rest = shown[:, self.steps - 1 :: self.steps][:, : part.samples.stop - part.samples.start - 1]
                out[joint.measured][:, part.samples.start + 1 : part.samples.stop] = rest / joint.scale
        broken = [i for i in range(count) if not all(np.isfinite(x[i]).all() for x in out.values())]
        for i in broken:  # NaN excludes the model from the fit.
            for x in out.values():
                x[i] = np.nan
        return out

    def _begun(self, mujoco: Any, count: int, inputs: Mapping[str, Array], span: slice) -> tuple[Array, Array]:
        """Return the initial states of a trial, and the controls at each of its steps."""
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
        states = np.empty((count, mujoco.mj_stateSize(self.model, kind)))
        for row, state in enumerate(states):
            self._fill_history(mujoco, start, control[row, 0])
            mujoco.mj_getState(self.model, start, state, kind)
        return states, np.ascontiguousarray(control)

    def _fill_history(self, mujoco: Any, start: Any, control: Array) -> None:
        """Let delays of the model begin with the first command and the first position, as a machine at rest does."""
        for joint in self.joints if getattr(self.model, "nhistory", 0) else ():
            actuator = self.model.actuator(joint.actuator).id
            sensor = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_SENSOR, SENSOR.format(joint.name))
            if count := int(self.model.actuator_history[actuator, 0]):
                mujoco.mj_initCtrlHistory(self.model, start, actuator, None, np.full((count, 1), control[actuator]))
            if sensor >= 0 and (count := int(self.model.sensor_history[sensor, 0])):
                at = int(self.model.jnt_qposadr[self.model.joint(joint.name).id])
                mujoco.mj_initSensorHistory(self.model, start, sensor, None, np.full((count, 1), start.qpos[at]), 0.0)


@dataclass
class Problem:
    """MuJoCo model with recordings: the arguments of `stretch_gap.diagnose`, which may be changed before the diagnosis.

    The function `problem` creates a problem.

    Attributes
    ----------
    spec : mujoco.MjSpec
        Specification of the model.
    simulator : Simulator
        Simulator of the model.
    trials : list of Trial
        Recordings.
    stages : list of Stage
        One stage for each joint.
    parameters : dict of str to Parameter
        Values that the model has, with tolerances, such as `motor_kp` and `elbow_armature`.
    effects : dict of str to Argument
        Values that the model lacks, with ranges, such as `elbow_frictionloss`.
    notes : list of str
        Joints that are not diagnosed, with the reasons.

    Examples
    --------
    >>> problem = stretch_gap.mujoco.problem(model, recording)
    >>> problem.effects["elbow_frictionloss"].unit
    'N m'
    """

    spec: Any
    simulator: Simulator
    trials: list[entries.Trial]
    stages: list[entries.Stage]
    parameters: dict[str, entries.Parameter]
    effects: dict[str, entries.Argument]
    notes: list[str]

    def diagnose(self, **more: Any) -> Diagnosis:
        """Diagnose the model with `stretch_gap.diagnose`.

        Parameters
        ----------
        **more : Any
            Further arguments of `stretch_gap.diagnose`. They replace `stages`, `parameters` and `effects` of the problem if
            given.

        Returns
        -------
        Diagnosis
            The diagnosis. Its notes begin with the notes of the problem.

        Raises
        ------
        StretchError
            If an argument or a recording is wrong.

        Warns
        -----
        DoubtWarning
            As `stretch_gap.diagnose`.

        Examples
        --------
        >>> problem = stretch_gap.mujoco.problem(model, recording)
        >>> found = problem.diagnose(wrap=None, depth=1)
        >>> found.named
        ['elbow_frictionloss']
        """
        from .diagnosis import diagnose

        given: dict[str, Any] = {"stages": self.stages, "parameters": self.parameters, "effects": self.effects}
        made = diagnose(self.simulator, self.trials, **{**given, **more})
        made._answer["notes"] = [{"code": "recording", "text": note} for note in self.notes] + made._answer["notes"]
        return made


def problem(
    model: Any,
    recording: entries.Data,
    *,
    joints: Sequence[str] | Mapping[str, tuple[str, str]] | None = None,
    rate_hz: float | None = None,
    degrees: bool | None = None,
) -> Problem:
    """Define a problem from a MuJoCo model and recordings.

    Gains, damping and armature that the model has become parameters with tolerances. Friction loss, damping and armature that
    the model lacks become candidate effects, whose ranges follow from the recordings.

    Parameters
    ----------
    model : str, path-like or mujoco.MjSpec
        Path of an MJCF file, its text, or a specification. Each diagnosed joint needs a position actuator (`<position>`).
    recording : dict of str to array_like, data frame, Trial, str, path-like, or list of these
        Recordings, as in `stretch_gap.diagnose`, with one column for the command and one for the measured position of each joint.
    joints : sequence of str, or dict of str to tuple of str, optional
        Joints to diagnose, by name. A dict also gives the columns of command and position: `{"elbow": ("elbow_cmd_rad",
        "elbow_rad")}`. By default all joints that moved and whose name occurs in the names of both columns.
    rate_hz : float, optional
        Sample rate in Hz. Required if a recording has neither `time_s` nor a rate.
    degrees : bool, optional
        Whether all columns are in degrees. By default a joint is in degrees if its columns end in `_deg` or `_degrees`, and
        otherwise in the unit of the model, radians for hinges.

    Returns
    -------
    Problem
        Simulator, stages, parameters and effects. `Problem.diagnose` runs the diagnosis.

    Raises
    ------
    StretchError
        If the package mujoco is not installed, if the model cannot be read, if no joint matches the columns, or if a joint
        cannot be diagnosed: a joint in `joints` that never moved, a command that is constant or equal to the measurement,
        columns that can only be in degrees although neither their names nor `degrees` say so, a joint without a position
        actuator, or a ball or free joint.

    Warns
    -----
    DoubtWarning
        If samples of a file count as lost, or if the time stamps seem to be in milliseconds.

    Examples
    --------
    >>> problem = stretch_gap.mujoco.problem(model, recording)
    >>> list(problem.parameters), list(problem.effects)
    (['motor_kp', 'motor_kv', 'elbow_armature'], ['elbow_damping', 'elbow_frictionloss'])
    """
    mujoco = library()
    spec = specification(mujoco, model)
    compiled = spec.compile()
    given = trials(recording, rate_hz, joints)
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
                f"joint {joint.name}: its actuator {joint.actuator} is not a position actuator; add <position joint="
                f"{joint.name!r} kp=.../> to the model, or write your own simulator for stretch_gap.diagnose"
            )
    parameters, effects = looked_for(compiled, chosen, given)
    stages = [entries.Stage(j.measured, (j.commanded,), name=j.name, unit="rad" if j.scale == 1.0 else "deg") for j in chosen]
    return Problem(spec, Simulator(compiled, chosen, (*parameters, *effects)), given, stages, parameters, effects, notes)


def specification(mujoco: Any, model: Any) -> Any:
    """Return the specification of a model, which is given as a path, as text, or as a specification."""
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
    """Return the values that the model has as parameters, and those that it lacks as effects with ranges from the recordings."""
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
    """Return the largest plausible value of each effect, from the torque of the servo and the recorded speed and acceleration."""
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
