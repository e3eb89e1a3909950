"""``run.json``: inputs, settings and outcome of a run."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from objstate.errors import ResultError
from objstate.kinds import RESULT, instead

SUMMARY = "run.json"


def write_summary(folder: str | Path, summary: Mapping[str, Any]) -> None:
    """Write ``run.json``: keys sorted, so that equal summaries are equal bytes.

    Raises ValueError for numbers that JSON can't hold (NaN, infinities).
    """
    for place, number in _numbers(summary, ""):
        if not math.isfinite(number):
            raise ValueError(f"{number} at {place} can't stand in {SUMMARY}; use null")
    text = json.dumps(summary, indent=2, sort_keys=True, allow_nan=False, ensure_ascii=False)
    (Path(folder) / SUMMARY).write_text(text + "\n", encoding="utf-8")


def read_summary(folder: str | Path) -> dict[str, Any]:
    """Read ``run.json`` of a result folder. Raises ResultError where there is none."""
    path = Path(folder) / SUMMARY
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ResultError(
            instead(folder, RESULT)
            or f"Can't read {path}: {error.strerror}; is {folder} a result of `objstate estimate`?"
        ) from error
    except ValueError as error:
        raise ResultError(f"{path} is not JSON ({error}); make the result anew.") from error
    if not isinstance(summary, dict):
        raise ResultError(f"{path} must hold a JSON object; make the result anew.")
    return summary


def _numbers(value: Any, place: str) -> Iterator[tuple[str, float]]:
    if isinstance(value, float):
        yield place, value
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _numbers(inner, f"{place}.{key}".lstrip("."))
    elif isinstance(value, list | tuple):
        for index, inner in enumerate(value):
            yield from _numbers(inner, f"{place}[{index}]")
