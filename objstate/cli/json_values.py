"""Summaries as values that JSON has words for."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from objstate.cli.console import print_text
from objstate.outputs import write_text

JSON_HELP = "Write the figures here too; '-' prints them instead of tables."
STDOUT = Path("-")


def write_json(file: Path | None, value: Any) -> bool:
    """Write a summary as JSON, in the place of an older one, where a file is named.

    Returns whether it was printed, for ``-``, so that nothing else should be. Raises ResultError.
    """
    if file is None:
        return False
    text = json.dumps(json_values(value), indent=2)
    if file == STDOUT:
        print_text(text)
        return True
    write_text(file, text + "\n")
    return False


def json_values(value: Any) -> Any:
    """Dataclasses as objects, arrays as lists, numbers that aren't finite as null."""
    match value:
        case bool() | int() | str() | None:
            return value
        case float():
            return value if math.isfinite(value) else None
        case Enum():
            return json_values(value.value)
        case Path():
            return str(value)
        case Mapping():
            return {str(key): json_values(inner) for key, inner in value.items()}
        case list() | tuple() | set() | frozenset():
            return [json_values(inner) for inner in value]
    if is_dataclass(value):
        return {each.name: json_values(getattr(value, each.name)) for each in fields(value)}
    return json_values(value.tolist())  # an array or scalar of NumPy
