"""What to change in a simulator so that nothing is missing any more."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from . import _stretch, effects


@dataclass(frozen=True)
class Fix:
    """Parameters re-tuned and effects added."""

    parameters: dict[str, float]
    """Every nominal parameter, as it is with the effects in."""
    effects: dict[str, dict[str, float]]
    """Values of the named effects, by effect."""
    code: str
    """The same as Python that can be pasted: parameters, values, and a function for each effect that stands around."""

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.code)}</pre>"


def fix(parameters: Mapping[str, float], values: Sequence[Mapping[str, Any]], named: Sequence[str]) -> Fix:
    """Of a diagnosis' numbers."""
    found: dict[str, dict[str, float]] = {name: {v["name"]: v["value"] for v in values if v["effect"] == name} for name in named}
    code = [inspect.getsource(function).rstrip() for function in _functions(named)]
    lines = ["# parameters, re-tuned with what was missing in place", "parameters = {"]
    lines += [f"    {name!r}: {value!r}," for name, value in parameters.items()]
    lines.append("}")
    for name, own in found.items():
        lines += ["", *_told(name), f"{_identifier(name)} = {own!r}"]
    if code:
        head = "from __future__ import annotations\n\nimport numpy as np\n"
        code = [head, *code, "\n".join(lines)]
        return Fix(dict(parameters), found, "\n\n".join(code) + "\n")
    return Fix(dict(parameters), found, "\n".join(lines) + "\n")


def _kind(name: str) -> str | None:
    """Which wrapper an effect is; None for an argument of the user's own."""
    kind = name.rsplit(".", 1)[-1].split("(", 1)[0]
    return kind if "." in name and _stretch.wrapper(kind) is not None else None


def _functions(named: Sequence[str]) -> list[Any]:
    """Functions of the wrappers that are named, and what they need, each once."""
    wanted: list[Any] = []
    for kind in map(_kind, named):
        if kind in effects.CODE:
            wanted += [*effects.NEEDS.get(kind, []), effects.CODE[kind]]
    return list(dict.fromkeys(wanted))


def _told(name: str) -> list[str]:
    """What an effect is: how it is called, or its equation."""
    kind = _kind(name)
    if kind is None:
        return [f"# {name}: an argument of the simulator"]
    words, equation = _stretch.wrapper(kind) or ("", "")
    place = "the input" if name.split(".")[-2] == "input" else "the output"
    told = [f"# {name}: {words}", f"#   {equation}"]
    if kind in effects.CODE:
        beside = "v" if kind.endswith("friction") else "dt_s"
        told.append(f"#   with x {place}: {kind}(x, {beside}, **{_identifier(name)})")
    return told


def _identifier(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name)
