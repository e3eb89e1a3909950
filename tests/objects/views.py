"""A view of a scan by formula, in place of a laser and a building."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from objstate.geometry import BoolArray, FloatArray
from objstate.objects import ObjectBelief, ObjectFilter, ScanEvidence
from objstate.particles import Weights
from objstate.sensing import Comparison, UncertainObject

# states (s, d) and robot poses (p, 3) to log p(o | s, l) (p, s)
Formula = Callable[[FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class FormulaView:
    """One beam whose likelihood is known; it bears on the object or not."""

    formula: Formula
    bears: bool = True

    def take(self, beams: BoolArray) -> FormulaView:
        return self

    def walls(self, poses: FloatArray) -> FloatArray:
        return np.full((len(poses), 1), np.inf)

    def object(self, name: str, states: FloatArray, poses: FloatArray) -> FloatArray:
        raise NotImplementedError

    def share_explained(
        self,
        name: str,
        states: FloatArray,
        pose: FloatArray,
        background: FloatArray,
        bears: BoolArray,
    ) -> float:
        raise NotImplementedError

    def stopped_short(self, pose: FloatArray, expected: FloatArray) -> FloatArray:
        return np.empty((0, 3))

    def log_likelihood(self, expected: FloatArray) -> FloatArray:
        return np.zeros(len(expected))

    def pose_log_likelihood(
        self, poses: FloatArray, blur: float, objects: Sequence[UncertainObject]
    ) -> FloatArray:
        raise NotImplementedError

    def object_log_likelihood(
        self, name: str, states: FloatArray, poses: FloatArray, comparison: Comparison
    ) -> tuple[FloatArray, BoolArray]:
        return comparison.tempering * self.formula(states, poses), np.array([self.bears])


def evidence_by(
    formula: Formula,
    poses: FloatArray | None = None,
    robot_weights: Weights | None = None,
    tempering: float = 1.0,
    bears: bool = True,
) -> ScanEvidence:
    """A scan that tells log p(o | s, l) by a formula of states (s, d) and poses (p, 3)."""
    poses = np.zeros((1, 3)) if poses is None else poses
    weights = Weights.uniform(len(poses)) if robot_weights is None else robot_weights
    view = FormulaView(formula, bears)
    absent = np.zeros(len(poses))
    return ScanEvidence("object", view, poses, weights, view.walls(poses), absent, tempering)


def updated(
    filter_: ObjectFilter, belief: ObjectBelief, evidence: ScanEvidence, rng: np.random.Generator
) -> ObjectBelief:
    """The belief after a scan."""
    update = filter_.update(belief, evidence, rng)
    return belief if update is None else update.belief


def gaussian_about(mean: FloatArray, std: FloatArray) -> Formula:
    """The object is seen at ``mean`` (d,), whatever the robot's pose."""

    def formula(states: FloatArray, poses: FloatArray) -> FloatArray:
        log_likelihood = -0.5 * (((states - mean) / std) ** 2).sum(axis=1)
        return np.tile(log_likelihood, (len(poses), 1))

    return formula
