"""What one scan says about one object, from each sample of the robot belief."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import lazy
from objstate.particles import Weights, evenly_after
from objstate.sensing import Comparison, ScanView

FEW = 8  # robot samples from which states of next to no weight are cast


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
    shift_std: float = 0.0  # m by which the whole object may be off its place

    def cast(
        self, states: FloatArray, whole: BoolArray, normals: FloatArray | None = None
    ) -> tuple[FloatArray, BoolArray]:
        """Tempered log p(o | s, l) (l, s), against the object's absence, of states (s, d).

        Also the beams (n,) that bear on the object in some of these states. States
        that aren't ``whole`` (s,) are cast from a few robot samples only. With
        ``normals`` (s, 2), the object may be off its place along them, and beams that stop before it
        side by side are one unexpected thing. Furniture may be anywhere, so that it would itself be one.
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
                whole=whole,
                few=self._few,
                in_runs=normals is not None,
            ),
        )

    @lazy
    def stopped(self) -> FloatArray:
        """(k, 3) m where beams end that something else than the background stopped.

        Seen from the most probable robot sample.
        """
        best = int(np.argmax(self.robot_weights.log))
        return self.view.stopped_short(self.poses[best], self.background[best])

    @lazy
    def _few(self) -> IntArray:
        """Some robot samples, by an even comb over what they weigh after the scan.

        What the scan says against the object's absence is averaged over them, so a
        sample counts as much as it explains the scan by that absence: then the mean
        is that of p(o | s, l) over p(l).
        """
        return evenly_after(self.robot_weights, self.tempering * self.log_absent, FEW)

    @lazy
    def robot_weights_without(self) -> Weights:
        """(l,) the robot weights after the scan, were the object absent."""
        weights, _ = self.robot_weights.reweight(self.tempering * self.log_absent)
        return weights

    def robot_weights_after(self, log_evidence: FloatArray) -> Weights:
        """(l,) the robot weights after the scan, of which an object changes the log-likelihood.

        ``log_evidence`` (l,) is p(o | l) against the object's absence, tempered.
        """
        weights, _ = self.robot_weights.reweight(self.tempering * self.log_absent + log_evidence)
        return weights
