"""Summaries of many errors: means, quantiles, shares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.geometry import BoolArray, FloatArray

ROTATIONS = frozenset({"angle", "yaw"})  # coordinates in rad, which wrap; the others are in m
NEAR_RAD, FAR_RAD = np.radians([5.0, 10.0])  # what a person calls right, and nearly right
NEAR_M, FAR_M = 0.05, 0.10


def unit_of(coordinate: str) -> str:
    """The SI unit of a coordinate: ``rad`` or ``m``."""
    return "rad" if coordinate in ROTATIONS else "m"


@dataclass(frozen=True)
class StateErrors:
    """Errors of estimates of one kind of coordinate, estimate minus truth, in its unit."""

    count: int
    bias: float  # mean error, with its sign
    mean: float  # of the absolute errors, as are the median and the quantile
    rms: float
    median: float
    p90: float
    within_near: float  # share of errors of at most 5 degrees or 5 cm
    within_far: float  # share of errors of at most 10 degrees or 10 cm
    coverage: float  # share of truths inside the 90 % intervals


@dataclass(frozen=True)
class Distances:
    """How far a path lies from the true one, in m or rad."""

    rms: float  # root of the mean square
    mean: float
    median: float
    p90: float
    end: float  # at the last pose


def summarize_states(coordinate: str, errors: FloatArray, inside: BoolArray) -> StateErrors | None:
    """The summary of ``errors`` (n,) in the coordinate's unit; None of no errors.

    ``inside`` (n,) says which truths lie inside their 90 % intervals.
    """
    if len(errors) == 0:
        return None
    near, far = (NEAR_RAD, FAR_RAD) if coordinate in ROTATIONS else (NEAR_M, FAR_M)
    absolute = np.abs(errors)
    return StateErrors(
        count=len(errors),
        bias=float(errors.mean()),
        mean=float(absolute.mean()),
        rms=float(np.sqrt(np.mean(errors**2))),
        median=float(np.median(absolute)),
        p90=float(np.quantile(absolute, 0.9)),
        within_near=float(np.mean(absolute <= near)),
        within_far=float(np.mean(absolute <= far)),
        coverage=float(np.mean(inside)),
    )


def summarize_distances(distances: FloatArray) -> Distances:
    """The summary of distances (n,), at least one, in order of time."""
    return Distances(
        rms=float(np.sqrt(np.mean(distances**2))),
        mean=float(distances.mean()),
        median=float(np.median(distances)),
        p90=float(np.quantile(distances, 0.9)),
        end=float(distances[-1]),
    )
