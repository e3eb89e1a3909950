"""What a scan's beams read behind and beside an object: the walls and the other objects."""

from __future__ import annotations

from collections.abc import Mapping

from objstate.geometry import FloatArray
from objstate.lazy import lazy
from objstate.objects import ObjectBelief
from objstate.sensing import ScanView


class Backdrop:
    """Expected ranges (l, n) of a view from robot samples, each object left out in turn.

    Of the objects, those whose state is known stand in the scene at their mean.
    """

    def __init__(
        self,
        view: ScanView,
        poses: FloatArray,
        beliefs: Mapping[str, ObjectBelief],
    ) -> None:
        self.view = view
        self._known = {name: each.mean for name, each in beliefs.items() if each.settled}
        self._scene = view.scenes(self._known, poses)

    def without(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Expected ranges (l, n) m of everything but one object, and log p(o | l) (l,) given them."""
        if name not in self._known:
            return self._whole, self.log_likelihood
        expected = self._scene(name)
        return expected, self.view.log_likelihood(expected)

    @lazy
    def log_likelihood(self) -> FloatArray:
        """log p(o | l) (l,) given the walls and all objects whose state is known."""
        return self.view.log_likelihood(self._whole)

    @lazy
    def _whole(self) -> FloatArray:
        """Expected ranges (l, n) m of the walls and of all objects whose state is known."""
        return self._scene(None)
