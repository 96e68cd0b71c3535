"""The changes that a diagnosis asks for: parameters re-tuned, and the named effects as code."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any


@dataclass(frozen=True)
class Fix:
    """Parameters re-tuned and effects added."""

    parameters: dict[str, float]
    """Every nominal parameter, re-tuned together with the named effects."""
    effects: dict[str, dict[str, float]]
    """Values of the named effects, by effect."""
    code: str
    """The same as Python code to paste: the parameters, a function for each effect around the simulator, and the values of
    effects that the simulator has itself."""

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.code)}</pre>"


def fix(
    parameters: Mapping[str, float],
    found: Mapping[str, dict[str, float]],
    implement: Sequence[Mapping[str, Any]],
    functions: Mapping[str, str],
) -> Fix:
    """The fix from re-tuned parameters, and the values, descriptions and functions of the named effects."""
    described = {one["effect"]: one for one in implement}
    lines = ["# parameters, re-tuned together with the named effects", "parameters = {"]
    lines += [f"    {name!r}: {value!r}," for name, value in parameters.items()]
    lines.append("}")
    for name, values in found.items():
        if name in functions:
            lines += ["", "", functions[name].rstrip()]
            continue
        one = described.get(name, {})
        lines += ["", f"# {name}: {one.get('words', '')}", f"#   {one.get('equation', '')}", f"{_identifier(name)} = {values!r}"]
    return Fix(dict(parameters), dict(found), "\n".join(lines) + "\n")


def _identifier(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name)
