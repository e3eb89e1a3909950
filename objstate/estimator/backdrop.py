"""Expected ranges of a scan's beams without one object: the walls and all other objects."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce

import numpy as np

from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief
from objstate.sensing import ScanView


class Backdrop:
    """Expected ranges (l, n) of a view from robot samples, with each object left out in turn.

    Objects whose state is certain stand in the scene at their mean.
    """

    def __init__(
        self,
        view: ScanView,
        poses: FloatArray,
        beliefs: Mapping[str, ObjectBelief],
    ) -> None:
        self.view = view
        self._walls = view.walls(poses)
        self._alone = {
            name: view.object(name, each.mean[None], poses)[:, 0]
            for name, each in beliefs.items()
            if each.is_certain
        }

    def without(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Expected ranges (l, n) m without one object, and log p(o | l) (l,) given them."""
        others = (ranges for other, ranges in self._alone.items() if other != name)
        expected = reduce(np.minimum, others, self._walls)
        return expected, self.view.log_likelihood(expected)
