"""Which objects of a result look the same after a turn."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from objstate.errors import ResultError
from objstate.recording.summary import SUMMARY, read_summary


def read_symmetry(folder: str | Path) -> Mapping[str, int]:
    """Orders by object, by a run's ``run.json``; objects that aren't named have none.

    Raises ResultError.
    """
    try:
        orders = read_summary(folder).get("symmetry", {}).items()
        return {str(name): max(int(order), 1) for name, order in orders}
    except (AttributeError, TypeError, ValueError) as error:
        raise ResultError(
            f"{Path(folder) / SUMMARY} has a 'symmetry' that isn't a whole number for each object; "
            "make the result anew with `objstate estimate`."
        ) from error
