"""What to change in a simulator so that nothing is missing any more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from . import _stretch


@dataclass(frozen=True)
class Fix:
    """Parameters re-tuned and effects added."""

    parameters: dict[str, float]
    """Every nominal parameter, as it is with the effects in."""
    effects: dict[str, dict[str, float]]
    """Values of the named effects, by effect."""
    code: str
    """The same as Python that can be pasted: parameters, values, and what each effect computes."""

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.code)}</pre>"


def fix(parameters: Mapping[str, float], values: Sequence[Mapping[str, Any]], named: Sequence[str]) -> Fix:
    """Of a diagnosis' numbers."""
    effects: dict[str, dict[str, float]] = {
        name: {v["name"]: v["value"] for v in values if v["effect"] == name} for name in named
    }
    lines = ["# parameters, re-tuned with what was missing in place", "parameters = {"]
    lines += [f"    {name!r}: {value!r}," for name, value in parameters.items()]
    lines.append("}")
    for name, own in effects.items():
        lines += ["", *_comment(name), f"{_identifier(name)} = {own!r}"]
    return Fix(dict(parameters), effects, "\n".join(lines) + "\n")


def _comment(name: str) -> list[str]:
    """What an effect is, in words and as an equation."""
    kind = name.rsplit(".", 1)[-1].split("(", 1)[0]
    told = _stretch.wrapper(kind) if "." in name else None
    if told is None:
        return [f"# {name}: an argument of the simulator"]
    words, equation = told
    return [f"# {name}: {words}", f"#   {equation}"]


def _identifier(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name)
