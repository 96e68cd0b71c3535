"""Calls of a simulator that is written in Python.

The package calls the simulator that the user passes to `diagnose`. A worker process, which is started from the text of this file,
calls the simulator that a problem.toml names.

An object has a method `simulate(params[n, p], effects[n, e]) -> [n, samples]`, which simulates up to `batch` models per call. A
function takes two dicts of one model and returns `[samples]`. Both may take further arguments by name:

- `inputs`: all columns by name, with the altered values of altered inputs, and `time_s`, the time since the start of the trial,
- `first`: the first measured value of each column in the trial, by name,
- `trials`: `name`, `samples`, `start_s` and `first` of each requested trial,
- `stage`: the number of the requested stage.

`**kw` takes all of them. A simulator that takes `inputs` or `first`, but not `trials`, is called once per trial. Any other
simulator is called once for all trials end to end. With several outputs, a simulator that does not take `stage` returns a dict of
arrays by output. A method `begin(session)` is called once, with everything that stays the same.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ._stretch import StretchError
else:
    try:
        from ._stretch import StretchError
    except ImportError:  # A worker is started from the text of this file alone.

        class StretchError(ValueError):
            """Error in the simulator. The message is one sentence."""


Array = NDArray[np.float64]

BATCH = 64
"""Largest number of models per call if the simulator has no attribute `batch`."""

OPTIONAL = ("inputs", "first", "trials", "stage")
"""Names of the arguments that a simulator may take after `params` and `effects`."""


class Named(np.ndarray[Any, np.dtype[np.float64]]):
    """Array `[n, names]` that also returns a column by its name: `effects["delay_s"]` holds one number for each model."""

    names: tuple[str, ...]

    @classmethod
    def of(cls, array: Array, names: Sequence[str]) -> Named:
        """Return the array with names for its columns."""
        named = array.view(cls)
        named.names = tuple(names)
        return named

    def __array_finalize__(self, other: Any) -> None:
        # Arrays derived from this one inherit the names. The names are valid only for a whole table.
        self.names = getattr(other, "names", ())

    def __getitem__(self, at: Any) -> Any:
        if not isinstance(at, str):
            return np.asarray(self)[at]
        if at not in self.names:
            raise KeyError(f"there is no {at}; there are {', '.join(self.names) or 'none'}")
        return np.asarray(self)[:, self.names.index(at)]


@dataclass(frozen=True)
class TrialSpan:
    """Position of a trial among the samples of all trials end to end."""

    name: str
    samples: slice
    start_s: float
    """Session time of its first sample, s."""
    first: Mapping[str, float]
    """First measured value of each column, that is, the state of the machine at the start of the trial."""


class Asked:
    """Adapter that converts requests of the diagnosis to calls of the user's simulator, and checks the returned arrays."""

    def __init__(self, simulator: Any) -> None:
        method = getattr(simulator, "simulate", None)
        self.many = callable(method)
        if not self.many and not callable(simulator):
            raise StretchError(
                f"the simulator is a {type(simulator).__name__}; give an object with a method "
                "simulate(params[n, p], effects) -> [n, samples], or a function of one model, "
                "f(params, effects) -> [samples]"
            )
        self.simulator = simulator
        self.answers = 0  # calls that returned something
        self.counted: Callable[[int], Any] | None = None  # called with the number of models of each call
        self.refusal: ValueError | None = None  # the last one that the simulator raised
        self.recorded: frozenset[str] = frozenset()  # columns of the recordings, also those that `inputs` does not contain
        self.call: Callable[..., Any] = method if self.many else simulator  # type: ignore[assignment]
        self.batch = max(1, int(getattr(simulator, "batch", BATCH))) if self.many else 1
        self.optional = self._optional()
        try:
            self.signature.bind({}, {}, **dict.fromkeys(self.optional))
        except TypeError as error:
            raise StretchError(
                f"the simulator takes {self.signature}, but its first two arguments are params and effects, and its further "
                f"arguments may only be {', '.join(OPTIONAL)}: {error}; rename the arguments, as in simulate(params, effects, "
                "inputs)"
            ) from None

    @property
    def signature(self) -> inspect.Signature:
        """Arguments that the simulator takes."""
        try:
            return inspect.signature(self.call)
        except (TypeError, ValueError):  # a builtin
            return inspect.signature(lambda params, effects: None)

    def _optional(self) -> set[str]:
        """Return the optional arguments that the simulator takes."""
        known = set(OPTIONAL)
        taken = self.signature.parameters
        if any(p.kind is inspect.Parameter.VAR_KEYWORD for p in taken.values()):
            return known
        return known & set(taken)

    @property
    def takes_inputs(self) -> bool:
        """Whether the simulator accepts altered inputs."""
        return "inputs" in self.optional

    @property
    def answers_all(self) -> bool:
        """Whether a call returns all outputs, whichever stage is requested."""
        return "stage" not in self.optional

    @property
    def is_called_once_a_trial(self) -> bool:
        """Whether the simulator is called separately for each trial."""
        return "trials" not in self.optional and not self.optional.isdisjoint({"inputs", "first"})

    def bind(self, session: Mapping[str, Any]) -> None:
        """Store what is the same for all models: the columns on one grid, the trials and the names.

        Call `begin` of the simulator.
        """
        dt_s, counts = session.get("dt_s", np.nan), [trial["samples"] for trial in session["trials"]]
        time_s: Array = np.concatenate([dt_s * np.arange(count) for count in counts] or [np.empty(0)])
        self.columns: dict[str, Array] = {"time_s": time_s, **session["columns"]}
        self.inputs: list[list[str]] = [stage["inputs"] for stage in session["stages"]]
        self.outputs: list[str] = [stage["output"] for stage in session["stages"]]
        self.parameters: list[str] = session["parameters"]
        self.effects: list[str] = session["effects"]
        self.spans: list[TrialSpan] = []
        for trial in session["trials"]:
            first = self.samples(len(self.spans))
            samples = slice(first, first + trial["samples"])
            at_first = {name: float(values[first]) for name, values in self.columns.items()}
            self.spans.append(TrialSpan(trial["name"], samples, trial["start_s"], at_first))
        begin = getattr(self.simulator, "begin", None)
        if callable(begin):
            begin(session)

    def called(self, params: Any, effects: Any, **more: Any) -> Any:
        """Call the simulator, and return its answer. An exception gets a note with the values of the call."""
        try:
            answer = self.call(params, effects, **more)
        except Exception as error:
            for words in self._circumstances(error, params, effects, more):
                if hasattr(error, "add_note"):  # from Python 3.11
                    error.add_note(words)
            if isinstance(error, ValueError):
                self.refusal = error
            if type(error) is ValueError and "read-only" in str(error) and "inputs" in more:
                raise StretchError(
                    f"the simulator changes inputs in place, but inputs are read-only ({error}); "
                    'change a copy, as in inputs["COLUMN"].copy()'
                ) from error
            raise
        self.answers += 1
        return answer

    def _circumstances(self, error: Exception, params: Any, effects: Any, more: Mapping[str, Any]) -> Iterator[str]:
        """Yield notes on an exception of the simulator."""
        named = [(name, table[name]) for table, names in ((params, self.parameters), (effects, self.effects)) for name in names]
        first = ", ".join(f"{name} = {np.ravel(values)[0]:.6g}" for name, values in named) or "no parameters and no effects"
        models = len(params) if self.many else 1
        yield f"the simulator was called with {f'{models} models, the first of them with ' if models > 1 else ''}{first}"
        missing = error.args[0] if isinstance(error, KeyError) and error.args else None
        if "inputs" in more and missing in self.recorded.difference(more["inputs"]):
            yield (
                f"the recording has the column {missing}, but the argument inputs= of diagnose (or of a Stage) does not name it; "
                "add it there"
            )

    def samples(self, trials: int) -> int:
        """Return the number of samples of the first `trials` trials."""
        return int(self.spans[trials - 1].samples.stop) if trials else 0

    def __call__(
        self,
        stage: int,
        trials: int,
        params: Array,
        effects: Array,
        altered: Sequence[Sequence[Array]] | None,
        others: Sequence[tuple[int, int, Sequence[Array]]] = (),
    ) -> Array:
        """Return the outputs of n models, `[n, samples]`. If a call returns all outputs, they are concatenated along the samples.

        `altered` holds, for each input of the stage, one row per model. `others` holds the same for inputs of other stages,
        each with the number of the stage and of the input.
        """
        models, samples = params.shape[0], self.samples(trials)
        if self.counted:
            self.counted(models)
        rows_by_name = dict(zip(self.inputs[stage], altered or ()))
        rows_by_name.update((self.inputs[other][at], rows) for other, at, rows in others)
        inputs = self._inputs(samples, models, rows_by_name)
        outputs = self.outputs if self.answers_all else [self.outputs[stage]]
        more: dict[str, Any] = {"stage": stage} if "stage" in self.optional else {}
        if not self.is_called_once_a_trial:
            if "trials" in self.optional:
                more["trials"] = self.spans[:trials]
            return np.concatenate(self._answers(params, effects, inputs, more, samples, outputs), axis=1)
        parts = []
        for span in self.spans[:trials]:
            if "first" in self.optional:
                more["first"] = span.first
            own = inputs and {name: values[:, span.samples] for name, values in inputs.items()}
            count = int(span.samples.stop - span.samples.start)
            parts.append(self._answers(params, effects, own, more, count, outputs))
        return np.concatenate([table for tables in zip(*parts) for table in tables], axis=1)

    def _answers(
        self,
        params: Array,
        effects: Array,
        inputs: dict[str, Array] | None,
        more: dict[str, Any],
        samples: int,
        outputs: Sequence[str],
    ) -> list[Array]:
        """Return an array `[n, samples]` for each output."""
        models = params.shape[0]
        if self.many:
            given = more if inputs is None else {**more, "inputs": inputs}
            answer = self.called(Named.of(params, self.parameters), Named.of(effects, self.effects), **given)
            return self._tables(answer, models, samples, outputs)
        rows = []
        for model in range(models):
            one = dict(zip(self.parameters, params[model].tolist()))
            values = dict(zip(self.effects, effects[model].tolist()))
            own = {} if inputs is None else {"inputs": {name: columns[model] for name, columns in inputs.items()}}
            answer = self.called(one, values, **more, **own)
            rows.append(self._tables(_first_axis(answer), 1, samples, outputs))
        return [np.concatenate(tables) for tables in zip(*rows)]

    def _inputs(self, samples: int, models: int, altered: Mapping[str, Sequence[Array]]) -> dict[str, Array] | None:
        """Return all columns by name, `[n, samples]`: altered columns as altered, the others as measured."""
        if not self.takes_inputs:
            return None
        given = {name: np.broadcast_to(values[:samples], (models, samples)) for name, values in self.columns.items()}
        return {**given, **{name: np.stack(rows) for name, rows in altered.items()}}

    def _tables(self, answer: Any, models: int, samples: int, outputs: Sequence[str]) -> list[Array]:
        """Check the answer of the simulator, and return an array `[n, samples]` for each output."""
        if len(outputs) == 1 and not isinstance(answer, dict):
            return [self._rows(answer, models, samples, outputs[0])]
        if not isinstance(answer, dict):
            raise StretchError(
                f"the simulator returned a {type(answer).__name__}; with {len(outputs)} outputs it must return a dict of "
                f"arrays by output: {', '.join(outputs)}"
            )
        missing = [output for output in outputs if output not in answer]
        if missing:
            raise StretchError(f"the simulator returned no {missing[0]}; it returned {', '.join(map(str, answer))}")
        return [self._rows(answer[o], models, samples, o) for o in outputs]

    def _rows(self, answer: Any, models: int, samples: int, output: str) -> Array:
        table = _numbers(answer, f" for {output}")
        if table.ndim == 1 and models == 1:
            table = table[np.newaxis]
        whole = samples if self.is_called_once_a_trial else self.samples(len(self.spans))
        if table.ndim != 2 or table.shape[0] != models or table.shape[1] not in (samples, whole):
            found, needed = (table.shape, (models, samples)) if self.many else (table.shape[1:], (samples,))
            wrong = f"the shape {found} instead of {needed}"
            if len(found) == len(needed) and table.shape[0] == models:
                wrong = f"{found[-1]} samples instead of {samples}"
            also = f" (or {whole} for all trials)" if samples != whole and self.many else ""
            each = "this trial" if self.is_called_once_a_trial else "all trials end to end"
            raise StretchError(
                f"the simulator returned {wrong}{also} for {output}; return one sample for each that was measured in {each}"
            )
        return np.ascontiguousarray(table[:, :samples])


def _first_axis(answer: Any) -> Any:
    """Return the outputs of one model as a batch of one model."""
    if isinstance(answer, dict):
        return {output: _numbers(values, f" for {output}")[np.newaxis] for output, values in answer.items()}
    return _numbers(answer)[np.newaxis]


def _numbers(values: Any, what: str = "") -> Array:
    """Return an answer as an array of floats. Masked samples become NaN. Complex numbers, times and text are refused."""
    if values is None:
        raise StretchError(f"the simulator returned None{what}; is a return statement missing?")
    kinds = {"c": "complex numbers", "m": "durations", "M": "times", "U": "text", "S": "text"}
    try:
        if np.ma.isMaskedArray(values):
            values = np.ma.filled(np.ma.asarray(values, dtype=np.float64), np.nan)
        table = np.asarray(values)
        if table.dtype.kind not in kinds:
            return table.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise StretchError(f"the simulator returned no numbers{what}: {error}") from None
    raise StretchError(f"the simulator returned {kinds[table.dtype.kind]}{what}; return real numbers in the output's unit")
