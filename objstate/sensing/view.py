"""What one scan can tell: functions of robot poses and object states, conditioned on its readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from objstate.geometry import BoolArray, FloatArray
from objstate.sensing.level import UncertainObject

EXPLAINED_SIGMAS = 3.0  # of sigma_hit, within which a range reads what was expected


@dataclass(frozen=True, eq=False)
class Comparison:
    """How the states of an object are compared: against what, from where, and how much it counts."""

    background: FloatArray  # (p, n) m, expected ranges of everything else
    tempering: float = 1.0  # exponent on the likelihood
    shift_std: float = 0.0  # m by which the whole object may stand off its place
    normals: FloatArray | None = None  # (s, 2) along which; unit vectors in the building
    in_runs: bool = (
        True  # whether one unexpected thing may stop several beams, or each is stopped by itself
    )


class ScanView(Protocol):
    """One scan's beams, against any robot poses (p, 3) and object states (s, d)."""

    def take(self, beams: BoolArray) -> ScanView:
        """The view of some of its beams (n,)."""

    def walls(self, poses: FloatArray) -> FloatArray:
        """Expected ranges (p, n) m of the fixed walls."""

    def object(self, name: str, states: FloatArray, poses: FloatArray) -> FloatArray:
        """Expected ranges (p, s, n) m of one object alone."""

    def share_explained(
        self,
        name: str,
        states: FloatArray,
        pose: FloatArray,
        background: FloatArray,
        bears: BoolArray,
    ) -> float:
        """Share of the beams that bear on an object (n,) which read what they should, within ``EXPLAINED_SIGMAS``.

        From a robot pose (3,), that is the nearer of the ``background`` (n,) and the object in its
        states (s, d); none, and it is absent.
        """

    def stopped_short(self, pose: FloatArray, expected: FloatArray) -> FloatArray:
        """Where beams end (k, 3) m that read less than expected (n,), from a robot pose (3,)."""

    def log_likelihood(self, expected: FloatArray) -> FloatArray:
        """log p(o | d-hat) (p,) of all beams together, for expected ranges (p, n)."""

    def pose_log_likelihood(
        self,
        poses: FloatArray,
        blur: float,
        objects: Sequence[UncertainObject],
        walls: FloatArray | None = None,
    ) -> FloatArray:
        """log p(o | l) (p,), each beam averaged over where the objects may be.

        ``blur`` m is added to the beam model's ``sigma_hit``, as variances add. ``walls`` (p, n) m
        saves casting them, where they are known.
        """

    def object_log_likelihood(
        self, name: str, states: FloatArray, poses: FloatArray, comparison: Comparison
    ) -> tuple[FloatArray, BoolArray]:
        """log p(o | s, l) - log p(o | object absent, l) (p, s), and which beams (n,) bear on it."""


def agree(measured: FloatArray, expected: FloatArray, range_max: float, margin: float) -> BoolArray:
    """Which ranges (n,) agree within ``margin`` m; all beyond ``range_max`` are one."""
    off = np.minimum(measured, range_max) - np.minimum(expected, range_max)
    return np.asarray(np.abs(off) <= margin)
