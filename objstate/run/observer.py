"""Who watches a run: the one seam between the loop and all that is made of it on the way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from objstate.estimator import Estimator
from objstate.records import Estimate, Record


class Observer(Protocol):
    """Sees every record go by, and what is believed after it; it must change neither."""

    def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        """Take note of a record; ``estimates`` are what the record changed."""
