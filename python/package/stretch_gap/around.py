"""Named effects around a simulator, run by their generated code."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._stretch import StretchError, identifier, wrappers


@dataclass(frozen=True)
class Around:
    """Effect at columns of a simulator, and the functions of its code.

    `signals` are the arguments of the code: `x` is one sample, `v` all samples, `n` their number, and `i` the index of one.
    """

    name: str
    columns: list[str]
    is_in_front: bool
    signals: list[str]
    step: Any
    start: Any

    def act(self, all_columns: Mapping[str, Any], spans: Sequence[slice]) -> dict[str, Any]:
        """Return all columns, those of the effect altered. The effect begins at rest in each span of samples.

        The last axis of a column is that of the samples. There is one span if `spans` do not cover the column.
        """
        made = dict(all_columns)
        for name in [name for name in self.columns if name in made]:
            made[name] = np.array(made[name], dtype=np.float64, order="C")
            samples = made[name].shape[-1]
            is_covered = spans and spans[-1].stop == samples
            for row in made[name].reshape(-1, samples):
                for span in spans if is_covered else [slice(0, samples)]:
                    row[span] = self._run(row[span].tolist())
        return made

    def _run(self, x: list[float]) -> list[float]:
        state = [self.start(*x[: len(inspect.signature(self.start).parameters)])] if self.start and x else []
        given = ({"x": x[i], "v": x, "n": len(x), "i": i} for i in range(len(x)))
        return [self.step(*state, *[one[name] for name in self.signals]) for one in given]


def around(
    described: Sequence[Mapping[str, Any]], functions: Mapping[str, str], stages: Sequence[Mapping[str, Any]]
) -> list[Around]:
    """Return the effects around the simulator, in the order in which they act on a column.

    `described` holds the descriptions of all named effects, and `functions` the code of those around the simulator. An effect
    that depends on more than its column is refused.
    """
    made = []
    for one in described:
        name = one["effect"]
        if name not in functions:  # the simulator itself implements it
            continue
        signals = [signal["name"] for signal in one["inputs"]]
        column = one["inputs"][0]["meaning"].rsplit(", ", 1)[0]
        driven = [stage["name"] for stage in stages if column in stage["inputs"]]
        is_in_front = one["stage"] in driven
        why = [f"{q['name']} ({q['meaning']})" for q in one["inputs"][1:] if q["name"] not in ("n", "i")]
        if is_in_front and len(driven) > 1:
            why.append(f"the stage, because {column} drives {' and '.join(driven)}")
        if why:
            raise StretchError(
                f"{name} cannot be applied from outside the simulator, because it depends on {' and '.join(why)}; "
                "put its function from the attribute code of the fix into the simulator, or use the methods predict and diagnose "
                "of the fix"
            )
        is_recorder = name.startswith("record.") and not is_in_front  # the clock of the recorder shifts every output
        columns = [stage["output"] for stage in stages] if is_recorder else [column]
        pasted: dict[str, Any] = {}
        exec(functions[name], pasted)
        step, start = (pasted.get(identifier(name) + end) for end in ("", "_start"))
        made.append(Around(name, columns, is_in_front, signals, step, start))
    kinds = [kind for kind, *_ in wrappers()]

    def order(effect: Around) -> int:
        return next(at for at, kind in enumerate(kinds) if re.search(rf"\.{kind}(\(.*\))?$", effect.name))

    return sorted(made, key=order)
