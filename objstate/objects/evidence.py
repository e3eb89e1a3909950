"""What one scan says about one object, integrated over the robot belief."""

from __future__ import annotations

from dataclasses import dataclass

from objstate.geometry import BoolArray, FloatArray
from objstate.objects.bayes import marginal_log_likelihood
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

    def cast(self, states: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Tempered log p(o | s, l) (l, s), each row up to a constant, of states (s, d).

        Also the beams (n,) that bear on the object in some of these states.
        """
        change, bears = self.view.object_log_likelihood(
            self.name, states, self.poses, self.background
        )
        return self.tempering * change, bears

    def integrated(self, log_likelihood: FloatArray, weights: Weights) -> FloatArray:
        """Log-likelihood (s,) of states with weights (s,), integrated over the robot belief."""
        return marginal_log_likelihood(log_likelihood, weights, self.robot_weights)
