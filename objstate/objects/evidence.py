"""What one scan says about one object, from each sample of the robot belief."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.particles import Weights
from objstate.sensing import ScanView

FEW = 8  # robot samples from which states of next to no weight are cast


@dataclass(frozen=True, eq=False)
class ScanEvidence:
    """A scan's log-likelihood p(o | s, l) of an object's states from robot samples."""

    name: str
    view: ScanView
    poses: FloatArray  # (l, 3) samples of the robot belief
    robot_weights: Weights  # (l,)
    background: FloatArray  # (l, n) m, expected ranges of everything else
    tempering: float  # exponent on p(o | s, l)
    shift_std: float = 0.0  # m by which the whole object may be off its place

    def cast(self, states: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Tempered log p(o | s, l) (l, s), against the object's absence, of states (s, d).

        Also the beams (n,) that bear on the object in some of these states.
        """
        change, bears = self.view.object_log_likelihood(
            self.name, states, self.poses, self.background
        )
        return self.tempering * change, bears

    def cast_shifted(
        self, states: FloatArray, normals: FloatArray, whole: BoolArray
    ) -> tuple[FloatArray, BoolArray]:
        """The same, averaged over where the object's place is off: see ``ScanView``."""
        return self.view.shifted_log_likelihood(
            self.name,
            states,
            normals,
            self.shift_std,
            self.poses,
            self.background,
            whole,
            self._few,
            self.tempering,
        )

    @property
    def _few(self) -> IntArray:
        """Some robot samples, evenly spread."""
        count = len(self.poses)
        return np.unique(np.linspace(0, count - 1, min(FEW, count)).astype(np.int64))
