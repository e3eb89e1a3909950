"""What ranges to walls say of the robot's pose, its lasers' mountings and the walls' places; compiled."""

from __future__ import annotations

import math

import numpy as np

from objstate.compiling import njit
from objstate.geometry import BoolArray, FloatArray, IntArray

COLUMNS = 7  # of a beam: pose x, y, yaw; mounting x, y, yaw; the wall's offset
OFFSET = 6
ROOT_TAU = math.sqrt(2.0 * math.pi)

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})


@_compile
def rows(
    normals: FloatArray,
    numbers: IntArray,
    ranges: FloatArray,
    origins: FloatArray,
    directions: FloatArray,
    pose: FloatArray,
    laser: FloatArray,
    out: FloatArray,
) -> None:
    """How each range changes with the robot's pose, the laser's mounting and the wall's offset, ``out`` (n, 7).

    Beams from ``origins`` (n, 2), in ``directions`` (n, 2), meet walls of ``normals`` (k, 2) by their ``numbers`` (n,)
    at ``ranges`` (n,). The robot stands at a ``pose`` (3,), the laser at a place ``laser`` (2,).
    """
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    for i in range(out.shape[0]):
        if numbers[i] < 0:
            for a in range(COLUMNS):
                out[i, a] = 0.0
            continue
        nx, ny = normals[numbers[i], 0], normals[numbers[i], 1]
        cosine = nx * directions[i, 0] + ny * directions[i, 1]
        x = origins[i, 0] + ranges[i] * directions[i, 0]
        y = origins[i, 1] + ranges[i] * directions[i, 1]
        out[i, 0], out[i, 1] = -nx / cosine, -ny / cosine
        out[i, 2] = (nx * (y - pose[1]) - ny * (x - pose[0])) / cosine
        out[i, 3] = -(nx * cos + ny * sin) / cosine
        out[i, 4] = -(ny * cos - nx * sin) / cosine
        out[i, 5] = (nx * (y - laser[1]) - ny * (x - laser[0])) / cosine
        out[i, OFFSET] = 1.0 / cosine


@_compile
def gather(
    used: BoolArray,
    measured: FloatArray,
    ranges: FloatArray,
    entered: FloatArray,
    row: FloatArray,
    columns: IntArray,
    off: FloatArray,
    offsets: FloatArray,
    covariance: FloatArray,
    hit: float,
    random: float,
    short: float,
    standing: float,
    variance: float,
    wall_variance: float,
    independence: float,
    information: FloatArray,
    gradient: FloatArray,
    sums: FloatArray,
    residuals: FloatArray,
) -> None:
    """Add what ``used`` beams (n,) say to the ``information`` (m, m) and the ``gradient`` (m,) about the prior mean.

    Ranges were ``measured`` (n,) where ``ranges`` (n,) are expected at the present mean, which is ``off`` (m,) from the prior
    mean; they change by ``row`` (n, 7) with the state's ``columns`` (n, 7), of which the last is -1 for walls whose
    ``offsets`` (n,) aren't followed. Beyond the range at which a beam is ``entered`` (n,), an object may stop it, with a
    density ``standing``, 1/m. A beam counts by the probability that the wall stopped it, by the state's
    ``covariance`` (m, m), times the ``independence`` of its error. ``sums`` (2,) are of squared residuals, and of these
    probabilities; ``residuals`` (n,) are in deviations, not a number where something else stopped the beam.
    """
    for i in range(used.shape[0]):
        residuals[i] = np.nan
        if not used[i]:
            continue
        count = COLUMNS if columns[i, OFFSET] >= 0 else OFFSET
        residual = measured[i] - ranges[i] - row[i, OFFSET] * offsets[i]
        own, predicted, back = variance, 0.0, 0.0
        if count == OFFSET:
            own += row[i, OFFSET] * row[i, OFFSET] * wall_variance
        for a in range(count):
            back += row[i, a] * off[columns[i, a]]
            for b in range(count):
                predicted += row[i, a] * covariance[columns[i, a], columns[i, b]] * row[i, b]
        spread = own + predicted
        density = (
            hit * math.exp(-0.5 * residual * residual / spread) / (ROOT_TAU * math.sqrt(spread))
        )
        beyond = measured[i] > entered[i]
        other = random + (short if residual < 0.0 else 0.0) + (standing if beyond else 0.0)
        share = density / (density + other)
        if share < 1e-6:
            continue
        weight = independence * share / own
        for a in range(count):
            gradient[columns[i, a]] += weight * row[i, a] * (residual + back)
            for b in range(count):
                information[columns[i, a], columns[i, b]] += weight * row[i, a] * row[i, b]
        if share > 0.5:
            residuals[i] = residual / math.sqrt(own)
        if count == COLUMNS and not beyond:
            sums[0] += share * (residual * residual + predicted)
            sums[1] += share


@_compile
def surely_met(
    used: BoolArray,
    measured: FloatArray,
    ranges: FloatArray,
    numbers: IntArray,
    row: FloatArray,
    most: FloatArray,
    step: float,
    grazing: float,
) -> None:
    """Keep of the ``used`` beams (n,) those that return, meet a wall before ``most`` (n,) m, and not beside its edge.

    A wall has an edge where neighbouring beams meet others, ``step`` and a tenth of their range apart. Nor does one
    count that is met at a ``grazing`` cosine.
    """
    last = used.shape[0] - 1
    for i in range(last + 1):
        if numbers[i] < 0 or not measured[i] < np.inf or ranges[i] >= most[i]:
            used[i] = False
            continue
        if abs(row[i, OFFSET]) * grazing > 1.0:
            used[i] = False
            continue
        for j in (max(i - 1, 0), min(i + 1, last)):
            if not abs(ranges[j] - ranges[i]) <= step + 0.1 * ranges[i]:
                used[i] = False


@_compile
def agreement(residuals: FloatArray, before: FloatArray, sums: FloatArray) -> None:
    """Add to ``sums`` (4,) how residuals (n,) go together with those ``before`` (n,), and with their neighbours'.

    Products and squares, of both in turn.
    """
    for i in range(residuals.shape[0]):
        here = residuals[i]
        if not abs(here) < np.inf:
            continue
        then = before[i]
        if abs(then) < np.inf:
            sums[0] += here * then
            sums[1] += 0.5 * (here * here + then * then)
        if i + 1 < residuals.shape[0] and abs(residuals[i + 1]) < np.inf:
            beside = residuals[i + 1]
            sums[2] += here * beside
            sums[3] += 0.5 * (here * here + beside * beside)
