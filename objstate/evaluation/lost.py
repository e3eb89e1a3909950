"""Estimates that were taken back: those made while the robot was lost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from objstate.errors import ResultError
from objstate.geometry import BoolArray, IntArray
from objstate.recording.summary import SUMMARY, read_summary

Stretches = Sequence[tuple[int, int]]  # ns; from the first stamp on, before the second


def read_lost(folder: str | Path) -> Stretches:
    """The stretches in which a run's robot was lost, by its ``run.json``. Raises ResultError."""
    try:
        return [(int(since), int(found)) for since, found in read_summary(folder)["lost_ns"]]
    except (KeyError, TypeError, ValueError) as error:
        raise ResultError(
            f"{Path(folder) / SUMMARY} doesn't say with 'lost_ns' when the robot was lost; make "
            "the result anew with `objstate estimate`."
        ) from error


def within(stamps_ns: IntArray, stretches: Stretches) -> BoolArray:
    """(n,) which stamps lie in one of the stretches."""
    bounds = np.array(stretches, dtype=np.int64).reshape(-1, 2)
    stamps = np.asarray(stamps_ns)[:, None]
    return np.asarray(((bounds[:, 0] <= stamps) & (stamps < bounds[:, 1])).any(axis=1))
