"""What one scan says about one object, integrated over the robot belief."""

from __future__ import annotations

from dataclasses import dataclass

from objstate.geometry import BoolArray, FloatArray
from objstate.objects.bayes import marginal_log_likelihood
from objstate.objects.belief import ObjectBelief
from objstate.particles import Weights
from objstate.sensing import ScanView


@dataclass(frozen=True, eq=False)
class ScanEvidence:
    """A scan's log-likelihood of an object's states, as eqs. (8) and (9) make it."""

    name: str
    view: ScanView
    poses: FloatArray  # (l, 3) samples of the robot belief
    robot_weights: Weights  # (l,)
    background: FloatArray  # (l, n) m, expected ranges of everything else
    tempering: float  # exponent on p(o | s, l)

    def of(self, belief: ObjectBelief) -> tuple[FloatArray, BoolArray]:
        """Log-likelihood (s,) of the belief's samples, and the beams (n,) that bear on the object."""
        change, bears = self.view.object_log_likelihood(
            self.name, belief.states, self.poses, self.background
        )
        tempered = self.tempering * change
        return marginal_log_likelihood(tempered, belief.weights, self.robot_weights), bears
