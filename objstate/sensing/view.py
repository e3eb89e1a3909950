"""The likelihood of one scan as a function of robot poses and object states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from objstate.geometry import BoolArray, FloatArray
from objstate.sensing.level import UncertainObject

EXPLAINED_SIGMAS = 3.0  # of sigma_hit, within which a range counts as explained


@dataclass(frozen=True, eq=False)
class Comparison:
    """How the states of an object are compared: the background, errors and exponent."""

    background: FloatArray  # (p, n) m, expected ranges without the object
    tempering: float = 1.0  # exponent on the likelihood
    shift_std: float = 0.0  # m by which the whole object may be off its place
    # (s, 2) directions of this shift; unit vectors in the building
    normals: FloatArray | None = None
    in_runs: bool = True  # whether one unexpected thing may stop several beams


@dataclass(frozen=True, eq=False)
class Around:
    """Objects of which a scan may meet some."""

    objects: tuple[UncertainObject, ...]
    circles: FloatArray  # (j, 3) x, y and radius, m, of a circle within which each stays


class ScanView(Protocol):
    """One scan's beams, for any robot poses (p, 3) and object states (s, d)."""

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
        """Share of the beams reaching an object (n,) that read what is expected.

        Within ``EXPLAINED_SIGMAS``. Expected from a robot pose (3,) is the smaller of the
        ``background`` (n,) and the range to the object in its states (s, d); without states the
        object is absent.
        """

    def stopped_short(self, pose: FloatArray, expected: FloatArray) -> FloatArray:
        """Ends (k, 3) m of beams that read less than expected (n,), from a robot pose (3,)."""

    def log_likelihood(self, expected: FloatArray) -> FloatArray:
        """log p(o | d-hat) (p,) of all beams, for expected ranges (p, n)."""

    def pose_log_likelihood(
        self,
        poses: FloatArray,
        blur: float,
        objects: Sequence[UncertainObject],
        walls: FloatArray | None = None,
    ) -> FloatArray:
        """log p(o | l) (p,), each beam averaged over where the objects may be.

        ``blur`` m is added to the beam model's ``sigma_hit``, as variances add. ``walls`` (p, n) m
        are the ranges of the walls, where they are known.
        """

    def nearby_log_likelihood(self, poses: FloatArray, blur: float, around: Around) -> FloatArray:
        """The same (h, p) from poses (h, p, 3) in h groups, each of which lies close together.

        Each group has the objects that its beams may reach before a wall.
        """

    def object_log_likelihood(
        self, name: str, states: FloatArray, poses: FloatArray, comparison: Comparison
    ) -> tuple[FloatArray, BoolArray]:
        """log p(o | s, l) - log p(o | object absent, l) (p, s), and the beams (n,) reaching it."""


def agree(measured: FloatArray, expected: FloatArray, range_max: float, margin: float) -> BoolArray:
    """Which ranges (n,) agree within ``margin`` m; all beyond ``range_max`` are equal."""
    off = np.minimum(measured, range_max) - np.minimum(expected, range_max)
    return np.asarray(np.abs(off) <= margin)
