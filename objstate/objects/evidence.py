"""The likelihood of one scan for one object's states, from each sample of the robot belief."""

from __future__ import annotations

from dataclasses import dataclass

from objstate.geometry import BoolArray, FloatArray
from objstate.objects.belief import ObjectBelief
from objstate.particles import Weights
from objstate.sensing import Comparison, ScanView


@dataclass(frozen=True, eq=False)
class ScanEvidence:
    """A scan's log-likelihood p(o | s, l) of an object's states from robot samples."""

    name: str
    view: ScanView
    poses: FloatArray  # (l, 3) samples of the robot belief
    robot_weights: Weights  # (l,)
    background: FloatArray  # (l, n) m, expected ranges of everything else
    log_absent: FloatArray  # (l,) log p(o | object absent, l)
    tempering: float  # exponent on p(o | s, l)
    shift_std: float = 0.0  # m; deviation of the whole object from its place

    def cast(
        self, states: FloatArray, normals: FloatArray | None = None
    ) -> tuple[FloatArray, BoolArray]:
        """Tempered log p(o | s, l) (l, s) of states (s, d), relative to the object's absence.

        Also the beams (n,) that reach the object in some of these states. With ``normals`` (s, 2),
        the object may be off its place along them, and neighbouring beams that stop before it share
        one unexpected cause. Furniture may be anywhere, so that it would be such a cause itself.
        """
        return self.view.object_log_likelihood(
            self.name,
            states,
            self.poses,
            Comparison(
                background=self.background,
                tempering=self.tempering,
                shift_std=0.0 if normals is None else self.shift_std,
                normals=normals,
                in_runs=normals is not None,
            ),
        )


@dataclass(frozen=True, eq=False)
class Update:
    """An object's belief after a scan, and the evidence for each robot sample."""

    belief: ObjectBelief
    log_evidence: FloatArray  # (l,) log p(o | l), relative to the object's absence; tempered
    bears: BoolArray  # (n,) the beams that reach the object
