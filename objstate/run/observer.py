"""The interface between the loop and everything that is written or shown during a run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from objstate.estimator import Estimator
from objstate.records import Estimate, Record


class Observer(Protocol):
    """Receives every record and the belief after it; it must change neither."""

    def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        """Called after a record; ``estimates`` are those that the record changed."""
