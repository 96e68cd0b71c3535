"""Tables, as pandas frames if pandas is installed."""

from __future__ import annotations

from typing import Any


def frame(rows: list[dict[str, Any]]) -> Any:
    """Return rows as a pandas frame, or as a dict of lists by column if pandas is not installed."""
    try:
        import pandas  # type: ignore[import-untyped,unused-ignore]
    except ImportError:
        return {key: [row.get(key) for row in rows] for key in (rows[0] if rows else {})}
    return pandas.DataFrame(rows)
