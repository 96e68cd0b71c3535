"""How a simulator in Python is called: the wheel calls one that it was handed, a worker one that a problem's file names.

An object has a method `simulate(params[n, p], effects[n, e]) -> [n, samples]`, asked for many models at once (at most its
attribute `batch`); a function takes two dicts for one model and returns `[samples]`. Both may take by keyword

- `inputs`: every column by name, those that drive the stage as they were altered,
- `first`: the measured value of every column in the first sample of the trial, by name,
- `trials`: name, slice, start_s and `first` of each trial that is asked for,
- `stage`: the number of the stage that is asked for.

A simulator that takes `inputs` or `first` is called once a trial. One that takes `trials` as well is called once for all of
them, which follow each other; so is one that takes none of these. `**kw` takes all. With several outputs a simulator that does
not take `stage` returns a dict of arrays by output. A method `begin(session)` is called once with everything that stays the
same.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ._stretch import StretchError
else:
    try:
        from ._stretch import StretchError
    except ImportError:  # a worker is started from this text alone

        class StretchError(ValueError):
            """What is wrong with the simulator, in a sentence."""


Array = NDArray[np.float64]

BATCH = 64
"""Models that are asked for at once where the simulator does not say how many (its attribute `batch`)."""


class Named(np.ndarray[Any, np.dtype[np.float64]]):
    """An array `[n, names]` whose columns go by name, too: `effects["delay_s"]` is one number for each model."""

    names: tuple[str, ...]

    @classmethod
    def of(cls, array: Array, names: Sequence[str]) -> Named:
        """The array with names for its columns."""
        named = array.view(cls)
        named.names = tuple(names)
        return named

    def __array_finalize__(self, other: Any) -> None:
        # whatever is made of it has its names, but means them only where it is still the whole table
        self.names = getattr(other, "names", ())

    def __getitem__(self, at: Any) -> Any:
        if not isinstance(at, str):
            return np.asarray(self)[at]
        if at not in self.names:
            raise KeyError(f"there is no {at}; there are {', '.join(self.names) or 'none'}")
        return np.asarray(self)[:, self.names.index(at)]


@dataclass(frozen=True)
class TrialSpan:
    """A trial among the samples of all trials end to end."""

    name: str
    samples: slice
    start_s: float
    """Session time of its first sample, s."""
    first: Mapping[str, float]
    """Every column's measured value in its first sample: the position of the machine when the trial begins."""


class Asked:
    """Turns what the diagnosis asks into calls of the user's simulator, and checks what comes back."""

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
        self.call: Callable[..., Any] = method if self.many else simulator  # type: ignore[assignment]
        self.batch = max(1, int(getattr(simulator, "batch", BATCH))) if self.many else 1
        self.optional = self._optional()

    def _optional(self) -> set[str]:
        """Which of the arguments that may be left out the simulator takes."""
        known = {"inputs", "first", "trials", "stage"}
        try:
            taken = inspect.signature(self.call).parameters
        except (TypeError, ValueError):  # a builtin
            return set()
        if any(p.kind is inspect.Parameter.VAR_KEYWORD for p in taken.values()):
            return known
        return known & set(taken)

    @property
    def takes_inputs(self) -> bool:
        """Whether it can be driven by other inputs than those that were measured."""
        return "inputs" in self.optional

    @property
    def answers_all(self) -> bool:
        """Whether it answers with all outputs at once, whichever stage is asked for."""
        return "stage" not in self.optional

    @property
    def is_called_once_a_trial(self) -> bool:
        """Whether each trial is a separate call."""
        return "trials" not in self.optional and not self.optional.isdisjoint({"inputs", "first"})

    def bind(self, session: Mapping[str, Any]) -> None:
        """Notes what stays the same from one model to the next: columns on one grid, trials, names."""
        self.columns: dict[str, Array] = session["columns"]
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

    def samples(self, trials: int) -> int:
        """Samples of the first trials."""
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
        """Outputs of some models, `[n, samples]`; with several stages those of all, one after the other.

        `altered` holds a row a model for each column that drives the stage, `others` the same with stage and input for columns of
        other stages.
        """
        models, samples = params.shape[0], self.samples(trials)
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
        """A table `[n, samples]` for each output."""
        models = params.shape[0]
        if self.many:
            given = more if inputs is None else {**more, "inputs": inputs}
            answer = self.call(Named.of(params, self.parameters), Named.of(effects, self.effects), **given)
            return self._tables(answer, models, samples, outputs)
        rows = []
        for model in range(models):
            one = dict(zip(self.parameters, params[model].tolist()))
            values = dict(zip(self.effects, effects[model].tolist()))
            own = {} if inputs is None else {"inputs": {name: columns[model] for name, columns in inputs.items()}}
            answer = self.call(one, values, **more, **own)
            rows.append(self._tables(_first_axis(answer), 1, samples, outputs))
        return [np.concatenate(tables) for tables in zip(*rows)]

    def _inputs(self, samples: int, models: int, altered: Mapping[str, Sequence[Array]]) -> dict[str, Array] | None:
        """Every column by name, `[n, samples]`: those that were altered as they are now, the others as measured."""
        if not self.takes_inputs:
            return None
        given = {name: np.broadcast_to(values[:samples], (models, samples)) for name, values in self.columns.items()}
        return {**given, **{name: np.stack(rows) for name, rows in altered.items()}}

    def _tables(self, answer: Any, models: int, samples: int, outputs: Sequence[str]) -> list[Array]:
        """What came back, checked; a table for each output."""
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
            form = f"({models}, {samples})" if self.many else f"({samples},)"
            also = f" or ({models}, {whole}), all trials end to end" if samples != whole and self.many else ""
            shape = table.shape if self.many else table.shape[1:]
            each = "trial behind trial"
            if self.is_called_once_a_trial:
                each = "in this trial; a simulator that also takes the argument trials is called once for all of them"
            raise StretchError(
                f"the simulator returned the shape {shape} for {output}; {form} was expected{also}: one sample for each that "
                f"was measured, {each}"
            )
        return np.ascontiguousarray(table[:, :samples])


def _first_axis(answer: Any) -> Any:
    """One model's outputs as a batch of one."""
    if isinstance(answer, dict):
        return {output: _numbers(values, f" for {output}")[np.newaxis] for output, values in answer.items()}
    return _numbers(answer)[np.newaxis]


def _numbers(values: Any, what: str = "") -> Array:
    """An answer as numbers; a masked sample is no number, and complex numbers, times and texts are refused."""
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
