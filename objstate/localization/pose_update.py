"""Compiled update of the robot's pose, the lasers' mountings and the walls' offsets by ranges."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from objstate.compiling import called_with, inner, njit, record
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.linear import ROOT_TAU, solve
from objstate.localization.carried import POSE
from objstate.sensing.pieces import GRAZING
from objstate.sensing.sweeps import COS, SIN, Scenery, X, Y

# columns of a beam: pose x, y, yaw; shift x, y; laser x, y, yaw, range bias, clock, sweep; wall
COLUMNS = 12
SHIFTS = 2
OFFSET = 11
SURELY_HIT = 3.0  # deviations within which a range counts for the noise
CUT_OFF = 0.973  # mean square of a standard normal variable that is cut off there
STANDING = 0.5  # 1/m, density of ranges to an object in any of its states

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_maker = inner(makes_arrays=True, nogil=True, error_model="numpy", fastmath={"contract"})


@record("densities", "f f f f f f f f")
class Densities(NamedTuple):
    """The beam model of a scan, for beams that should meet walls."""

    hit: float  # probability that the wall stops the beam
    random: float  # 1/m, density of a random range
    short: float  # 1/m, density of a range that something unexpected stopped
    variance: float  # m^2 of a short range
    growth: float  # its growth with the square of the range
    slant: float  # and with that square times the squared tangent of the incidence
    wall_variance: float  # m^2 of a wall whose offset isn't followed
    independence: float  # exponent on the likelihood of a beam, for dependent errors


@record("readings", "f1 f1 f1 f1 f2 i1 i1 f1")
class Readings(NamedTuple):
    """The beams of a scan, and the walls that they should meet at the mean of the state (m,)."""

    measured: FloatArray  # (n,) m
    expected: FloatArray  # (n,) m
    entered: FloatArray  # (n,) m; beyond, an object may stop the beam
    standing: FloatArray  # (n,) 1/m, density of what is measured, if one does
    row: FloatArray  # (n, 12) derivatives of the range by ``columns`` and by the wall's offset
    columns: IntArray  # (11,) of the state, on which all beams depend
    walls: IntArray  # (n,) column of the wall's offset, -1 where it isn't followed
    offsets: FloatArray  # (n,) m, these offsets, else 0


@_inner
def _scatter(noise: Densities, distance: float, slope: float) -> Any:
    """m^2 of a range to a wall by the laser's noise, by one over the cosine of incidence."""
    square = distance * distance
    return noise.variance + square * (noise.growth + noise.slant * (slope * slope - 1.0))


@_inner
def _wall_sums(
    mean: FloatArray, covariance: FloatArray, columns: IntArray, prior: float, farthest: float
) -> Any:
    """See ``wall_sums``."""
    squares, count = 0.0, 0.0
    for k in range(columns.shape[0]):
        variance, off = covariance[columns[k], columns[k]], mean[columns[k]]
        known = max(1.0 - variance / prior, 0.0)
        squares += known * (min(off * off, farthest * farthest * prior) + variance)
        count += known
    return squares, count


@called_with("f1 f2 i1 f f")
@_compile
def wall_sums(
    mean: FloatArray, covariance: FloatArray, columns: IntArray, prior: float, farthest: float
) -> Any:
    """Sums of squared offsets, m^2, of the pieces of wall in some ``columns`` (k,), and of pieces.

    Each is weighted by the share of its ``prior`` variance that has been removed. Squares are
    limited to ``farthest`` deviations.
    """
    return _wall_sums(mean, covariance, columns, prior, farthest)


@_maker
def _shared(covariance: FloatArray, columns: IntArray) -> Any:
    """Covariance (11, 11) of the state's ``columns`` (11,) on which all beams depend."""
    out = np.empty((OFFSET, OFFSET))
    for a in range(OFFSET):
        for b in range(OFFSET):
            out[a, b] = covariance[columns[a], columns[b]]
    return out


@_inner
def _predicted(
    row: FloatArray,
    first: int,
    wall: int,
    shared: FloatArray,
    covariance: FloatArray,
    columns: IntArray,
) -> Any:
    """m^2 of a range by errors of the state, from the ``first`` of those of ``shared`` on."""
    total = 0.0
    for a in range(first, OFFSET):
        part = 0.5 * shared[a, a] * row[a]
        for b in range(first, a):
            part += shared[a, b] * row[b]
        total += row[a] * part
    if wall >= 0:
        part = 0.5 * covariance[wall, wall] * row[OFFSET]
        for a in range(first, OFFSET):
            part += covariance[wall, columns[a]] * row[a]
        total += row[OFFSET] * part
    return 2.0 * total


@called_with("f1 f2 f2 f1 f f f f f f i1 f f f")
@_compile
def drive(
    mean: FloatArray,
    covariance: FloatArray,
    cross: FloatArray,
    step: FloatArray,
    length: float,
    turn: float,
    sideways: float,
    lever: float,
    wall_length: float,
    shifted: float,
    pieces: IntArray,
    first_squares: float,
    first_count: float,
    farthest: float,
) -> None:
    """Predict the state (m,), its ``covariance`` (m, m) and cross covariances ``cross`` (m, k).

    ``length`` and ``turn`` are the variances of the ``step`` (3,), and ``sideways`` is the share of
    the former to the sides. The model's shift and the offsets of ``pieces`` (j,) decorrelate over
    ``wall_length`` m, a radian of turning counting as ``lever`` m; ``shifted`` is the shift's
    deviation in units of the offsets'. That follows from sums of squares and of pieces, see
    ``wall_sums``.
    """
    size = mean.shape[0]
    way, cos, sin = math.hypot(step[0], step[1]), math.cos(mean[2]), math.sin(mean[2])
    dx, dy = cos * step[0] - sin * step[1], sin * step[0] + cos * step[1]
    mean[0] += dx
    mean[1] += dy
    mean[2] += step[2]
    for a in range(size):
        covariance[0, a] -= dy * covariance[2, a]
        covariance[1, a] += dx * covariance[2, a]
    for a in range(size):
        covariance[a, 0] -= dy * covariance[a, 2]
        covariance[a, 1] += dx * covariance[a, 2]
    for a in range(cross.shape[1]):
        cross[0, a] -= dy * cross[2, a]
        cross[1, a] += dx * cross[2, a]
    x, y = dx / max(way, 1e-12), dy / max(way, 1e-12)
    standing = 1.0 if way == 0.0 else 0.0
    covariance[0, 0] += length * (x * x + sideways * y * y + standing)
    covariance[1, 1] += length * (y * y + sideways * x * x + standing)
    covariance[0, 1] += length * (1.0 - sideways) * x * y
    covariance[1, 0] += length * (1.0 - sideways) * x * y
    covariance[2, 2] += turn
    kept = math.exp(-(way + lever * abs(step[2])) / wall_length)
    if kept == 1.0:
        return
    for k in range(SHIFTS + pieces.shape[0]):
        row = POSE + k if k < SHIFTS else pieces[k - SHIFTS]
        mean[row] *= kept
        for a in range(size):
            covariance[row, a] *= kept
        for a in range(size):
            covariance[a, row] *= kept
        for a in range(cross.shape[1]):
            cross[row, a] *= kept
    prior = first_squares / first_count
    squares, count = _wall_sums(mean, covariance, pieces, prior, farthest)
    added = (1.0 - kept * kept) * (first_squares + squares) / (first_count + count)
    for k in range(SHIFTS):
        covariance[POSE + k, POSE + k] += shifted * shifted * added
    for k in range(pieces.shape[0]):
        covariance[pieces[k], pieces[k]] += added


def evenly(count: int) -> FloatArray:
    """(n,) times of beams, one after the other, in durations of the sweep from its middle."""
    return np.arange(count) / max(count - 1, 1) - 0.5


@called_with("f2 f2 f1 f1 f1 i f2 f2 f1 f1 f1")
@_compile
def leave(
    origins: FloatArray,
    directions: FloatArray,
    times: FloatArray,
    mean: FloatArray,
    velocity: FloatArray,
    first: int,
    begins: FloatArray,
    towards: FloatArray,
    pose: FloatArray,
    laser: FloatArray,
    moving: FloatArray,
) -> None:
    """The origins of beams and their directions in the building, by the state (m,).

    ``origins`` and ``directions`` (n, 3) are those in the robot's frame; ``begins`` (n, 2) and
    ``towards`` (n, 2) are written, as are the robot's ``pose`` (3,) at that time, the ``laser``'s
    place (2,), and the pose's ``moving`` (3,) m/s, m/s, rad/s. The laser's errors begin with a
    column ``first``; the ``velocity`` (3,) is in the robot's frame. Beams are taken at
    ``times`` (n,) in durations of the sweep from its middle, at which the pose and the laser's
    place are given.
    """
    count, sweep = origins.shape[0], mean[first + 5]
    cos, sin = math.cos(mean[2]), math.sin(mean[2])
    moving[0] = cos * velocity[0] - sin * velocity[1]
    moving[1] = sin * velocity[0] + cos * velocity[1]
    moving[2] = velocity[2]
    for a in range(POSE):
        pose[a] = mean[a] + mean[first + 4] * moving[a]
    for a in range(SHIFTS):
        pose[a] += mean[POSE + a]
    middle_x, middle_y = 0.0, 0.0
    for i in range(count):
        middle_x += origins[i, 0] / count
        middle_y += origins[i, 1] / count
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    cos_yaw, sin_yaw = math.cos(mean[first + 2]), math.sin(mean[first + 2])
    cos_both, sin_both = cos * cos_yaw - sin * sin_yaw, sin * cos_yaw + cos * sin_yaw
    x, y = middle_x + mean[first], middle_y + mean[first + 1]
    laser[0], laser[1] = cos * x - sin * y + pose[0], sin * x + cos * y + pose[1]
    for i in range(count):
        off_x, off_y = origins[i, 0] - middle_x, origins[i, 1] - middle_y
        dx, dy = directions[i, 0], directions[i, 1]
        time = sweep * times[i]
        turn_cos, turn_sin = math.cos(time * moving[2]), math.sin(time * moving[2])
        arm_x, arm_y = cos * x - sin * y, sin * x + cos * y
        arm_x += cos_both * off_x - sin_both * off_y
        arm_y += sin_both * off_x + cos_both * off_y
        begins[i, 0] = pose[0] + time * moving[0] + turn_cos * arm_x - turn_sin * arm_y
        begins[i, 1] = pose[1] + time * moving[1] + turn_sin * arm_x + turn_cos * arm_y
        x_now, y_now = cos_both * dx - sin_both * dy, sin_both * dx + cos_both * dy
        towards[i, 0] = turn_cos * x_now - turn_sin * y_now
        towards[i, 1] = turn_sin * x_now + turn_cos * y_now


@_inner
def _derive(
    nx: float,
    ny: float,
    dx: float,
    dy: float,
    x: float,
    y: float,
    time: float,
    cos: float,
    sin: float,
    pose: FloatArray,
    laser: FloatArray,
    velocity: FloatArray,
    out: FloatArray,
) -> None:
    """Derivatives ``out`` (12,) of the range of a beam that meets a surface's normal at a place.

    ``cos`` and ``sin`` are those of the pose's yaw.
    """
    cosine = nx * dx + ny * dy
    out[0], out[1] = -nx / cosine, -ny / cosine
    out[2] = (nx * (y - pose[1]) - ny * (x - pose[0])) / cosine
    out[3], out[4] = out[0], out[1]
    out[5] = -(nx * cos + ny * sin) / cosine
    out[6] = -(ny * cos - nx * sin) / cosine
    out[7] = (nx * (y - laser[1]) - ny * (x - laser[0])) / cosine
    out[8] = 1.0
    out[9] = out[0] * velocity[0] + out[1] * velocity[1] + out[2] * velocity[2]
    out[10] = out[9] * time
    out[OFFSET] = 1.0 / cosine


@called_with("f2 i1 f1 f2 f2 f1 f1 f1 f1 f2")
@_compile
def rows(
    normals: FloatArray,
    numbers: IntArray,
    ranges: FloatArray,
    origins: FloatArray,
    directions: FloatArray,
    times: FloatArray,
    pose: FloatArray,
    laser: FloatArray,
    velocity: FloatArray,
    out: FloatArray,
) -> None:
    """Derivatives ``out`` (n, 12) of each range by pose, laser errors and wall offset.

    Beams from ``origins`` (n, 2), in ``directions`` (n, 2), meet walls of ``normals`` (k, 2) by
    their ``numbers`` (n,) at ``ranges`` (n,). The robot stands at a ``pose`` (3,) that changes by
    ``velocity`` (3,) m/s and rad/s, the laser at a place ``laser`` (2,). For ``times`` (n,) see
    ``leave``.
    """
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    for i in range(out.shape[0]):
        if numbers[i] < 0:
            for a in range(COLUMNS):
                out[i, a] = 0.0
            continue
        dx, dy = directions[i, 0], directions[i, 1]
        x, y = origins[i, 0] + ranges[i] * dx, origins[i, 1] + ranges[i] * dy
        nx, ny = normals[numbers[i], 0], normals[numbers[i], 1]
        _derive(nx, ny, dx, dy, x, y, times[i], cos, sin, pose, laser, velocity, out[i])


@_inner
def _meet_outline(
    outlines: FloatArray,
    first: int,
    past: int,
    placement: FloatArray,
    x: float,
    y: float,
    dx: float,
    dy: float,
) -> Any:
    """Distance of a ray from an object's segments, inf if it misses, and the normal met."""
    cos, sin = placement[COS], placement[SIN]
    east, north = x - placement[X], y - placement[Y]
    east, north = cos * east + sin * north, cos * north - sin * east
    right, up = cos * dx + sin * dy, cos * dy - sin * dx
    nearest, along, across = np.inf, 0.0, 1.0
    for k in range(first, past):
        ax, ay = outlines[k, 0] - east, outlines[k, 1] - north
        bx, by = outlines[k, 2] - east, outlines[k, 3] - north
        if (right * ay - up * ax > 0.0) == (right * by - up * bx > 0.0):
            continue
        nx, ny = ay - by, bx - ax
        distance = (nx * ax + ny * ay) / (nx * right + ny * up)
        if 0.0 <= distance < nearest:
            size = math.hypot(nx, ny)
            nearest, along, across = distance, nx / size, ny / size
    return nearest, cos * along - sin * across, sin * along + cos * across


@called_with("scenery f2 f2 f1")
@_compile
def meet_objects(
    objects: Scenery, origins: FloatArray, directions: FloatArray, ranges: FloatArray
) -> None:
    """Set ``ranges`` (n,) m of beams to the nearest of some objects in any place; inf to none."""
    for i in range(ranges.shape[0]):
        ranges[i] = np.inf
        first, start = 0, 0
        for j in range(objects.rims.shape[0]):
            for s in range(start, objects.placement_ends[j]):
                distance, _, _ = _meet_outline(
                    objects.outlines,
                    first,
                    objects.outline_ends[j],
                    objects.placements[s],
                    origins[i, 0],
                    origins[i, 1],
                    directions[i, 0],
                    directions[i, 1],
                )
                ranges[i] = min(ranges[i], distance)
            first, start = objects.outline_ends[j], objects.placement_ends[j]


@called_with("scenery f2 f2 f2 f1 f1 f f f f2")
@_compile
def expect_each(
    objects: Scenery,
    entries: FloatArray,
    origins: FloatArray,
    directions: FloatArray,
    measured: FloatArray,
    walls: FloatArray,
    variance: float,
    growth: float,
    blur: float,
    out: FloatArray,
) -> None:
    """Set ``out`` (j, n) to the density, 1/m, with which each object in its places reads a range.

    The ``measured`` ranges (n,) m have a ``variance`` m^2 that grows with the squared range by
    ``growth``. The objects' surfaces are ``blur`` m^2 off, along their normals. What stands behind
    the ``walls`` (n,) m isn't met. Beams come to the objects at ``entries`` (j, n) m.
    """
    for i in range(measured.shape[0]):
        first, start, dx, dy = 0, 0, directions[i, 0], directions[i, 1]
        for j in range(objects.rims.shape[0]):
            past, out[j, i] = objects.outline_ends[j], 0.0
            may_meet = entries[j, i] < measured[i] < np.inf
            for s in range(start, objects.placement_ends[j] if may_meet else start):
                distance, nx, ny = _meet_outline(
                    objects.outlines,
                    first,
                    past,
                    objects.placements[s],
                    origins[i, 0],
                    origins[i, 1],
                    dx,
                    dy,
                )
                if distance < walls[i]:
                    cosine, off = max(abs(nx * dx + ny * dy), GRAZING), measured[i] - distance
                    spread = variance + growth * distance * distance + blur / (cosine * cosine)
                    density = math.exp(-0.5 * off * off / spread) / (ROOT_TAU * math.sqrt(spread))
                    out[j, i] += objects.shares[s] * density
            first, start = past, objects.placement_ends[j]


@called_with("b1 readings scenery f2 f2 f1 f1 f1 f1 f f2 densities")
@_compile
def expect_objects(
    used: BoolArray,
    beams: Readings,
    objects: Scenery,
    origins: FloatArray,
    directions: FloatArray,
    times: FloatArray,
    pose: FloatArray,
    laser: FloatArray,
    velocity: FloatArray,
    bias: float,
    covariance: FloatArray,
    noise: Densities,
) -> None:
    """Set the density ``beams.standing`` (n,) of what ``used`` beams (n,) measure to objects.

    Each object stands in one of some places, or in any other. Beams are those of ``rows``, and too
    long by a ``bias``, m. The state has a ``covariance`` (m, m).
    """
    row, shared = np.empty(COLUMNS), _shared(covariance, beams.columns)
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    for i in range(used.shape[0]):
        measured, x, y = beams.measured[i], origins[i, 0], origins[i, 1]
        beams.standing[i] = STANDING
        if not used[i] or not measured > beams.entered[i]:
            continue
        dx, dy, first, start = directions[i, 0], directions[i, 1], 0, 0
        for j in range(objects.rims.shape[0]):
            past = objects.outline_ends[j]
            for s in range(start, objects.placement_ends[j]):
                distance, nx, ny = _meet_outline(
                    objects.outlines, first, past, objects.placements[s], x, y, dx, dy
                )
                if distance == np.inf:
                    continue
                at_x, at_y = x + distance * dx, y + distance * dy
                place = at_x, at_y, times[i], cos, sin, pose, laser, velocity
                _derive(nx, ny, dx, dy, *place, row)
                slope = row[OFFSET]
                spread = _scatter(noise, distance, slope) + slope * slope * noise.wall_variance
                spread += _predicted(row, 0, -1, shared, covariance, beams.columns)
                off = measured - bias - distance
                density = math.exp(-0.5 * off * off / spread) / (ROOT_TAU * math.sqrt(spread))
                beams.standing[i] += objects.shares[s] * noise.hit * density
            first, start = past, objects.placement_ends[j]


@_inner
def _inform(
    weight: float,
    pull: float,
    row: FloatArray,
    columns: IntArray,
    wall: int | np.int64,
    known: FloatArray,
    information: FloatArray,
    gradient: FloatArray,
) -> None:
    """Add a beam that pulls: the lower half of ``known`` (11, 11) by ``columns``, and the rest."""
    for a in range(OFFSET):
        gradient[columns[a]] += pull * row[a]
        for b in range(a + 1):
            known[a, b] += weight * row[a] * row[b]
    if wall >= 0:
        gradient[wall] += pull * row[OFFSET]
        information[wall, wall] += weight * row[OFFSET] * row[OFFSET]
        for a in range(OFFSET):
            information[wall, columns[a]] += weight * row[OFFSET] * row[a]


@_inner
def _note_error(
    weight: float, square: float, slanted: float, error: float, sums: FloatArray
) -> None:
    """Add a beam's squared range, squared tangent and squared error to ``sums`` (10,)."""
    slanted *= square
    sums[0] += weight
    sums[1] += weight * square
    sums[2] += weight * slanted
    sums[3] += weight * square * square
    sums[4] += weight * square * slanted
    sums[5] += weight * slanted * slanted
    sums[6] += weight * error
    sums[7] += weight * square * error
    sums[8] += weight * slanted * error
    sums[9] += 1.0


@called_with("b1 readings f1 f2 densities f2 f1 f1 f1")
@_compile
def gather(
    used: BoolArray,
    beams: Readings,
    off: FloatArray,
    covariance: FloatArray,
    noise: Densities,
    information: FloatArray,
    gradient: FloatArray,
    sums: FloatArray,
    residuals: FloatArray,
) -> None:
    """Add ``used`` beams (n,) to ``information`` (m, m) and ``gradient`` (m,) at the prior mean.

    The present mean is ``off`` (m,) from the prior mean. The wall stopped a beam with a probability
    that the state's ``covariance`` (m, m) gives, or something else did: the beam counts as much as
    the mixture of both posteriors has mean and covariance (probabilistic data association,
    Bar-Shalom and Tse 1975), to the power of the independence of its error.
    ``sums`` (10,) are those of a weighted least squares fit of squared errors to their variance,
    over beams that are off by less than ``SURELY_HIT`` deviations: products of its three terms (6),
    and of these with the squared errors (3), and their number. ``residuals`` (n,) are in
    deviations, NaN for other beams.
    """
    columns, known = beams.columns, np.zeros((OFFSET, OFFSET))
    shared = _shared(covariance, columns)
    for i in range(used.shape[0]):
        residuals[i] = np.nan
        if not used[i]:
            continue
        h, wall, slope, expected = (
            beams.row[i],
            beams.walls[i],
            beams.row[i, OFFSET],
            beams.expected[i],
        )
        residual = beams.measured[i] - expected - slope * beams.offsets[i]
        scatter, back = _scatter(noise, expected, slope), 0.0
        own = scatter
        for a in range(OFFSET):
            back += h[a] * off[columns[a]]
        if wall >= 0:
            back += slope * off[wall]
        else:
            own += slope * slope * noise.wall_variance
        spread = own + _predicted(h, 0, wall, shared, covariance, columns)
        density = (
            noise.hit
            * math.exp(-0.5 * residual * residual / spread)
            / (ROOT_TAU * math.sqrt(spread))
        )
        beyond = beams.measured[i] > beams.entered[i]
        other = noise.random + (noise.short if residual < 0.0 else 0.0)
        other += beams.standing[i] if beyond else 0.0
        share = density / (density + other)
        if share < 1e-6:
            continue
        sure = max(share * (1.0 - (1.0 - share) * residual * residual / spread), 0.0)
        per_variance = noise.independence / (spread - sure * (spread - own))
        pull = per_variance * (share * residual + sure * back)
        _inform(per_variance * sure, pull, h, columns, wall, known, information, gradient)
        if residual * residual > SURELY_HIT * SURELY_HIT * spread:
            continue
        residuals[i] = residual / math.sqrt(spread)
        if wall >= 0 and not beyond:
            weight, error = share / (scatter * scatter), residual * residual / CUT_OFF
            _note_error(weight, expected * expected, slope * slope - 1.0, error, sums)
    for a in range(OFFSET):
        for k in range(information.shape[0]):
            information[columns[a], k] = information[k, columns[a]]
    for a in range(OFFSET):
        for b in range(a + 1):
            information[columns[a], columns[b]] = information[columns[b], columns[a]] = known[a, b]


@_maker
def _evidence_of_pose(  # noqa: PLR0912
    residuals: FloatArray,
    own: FloatArray,
    row: FloatArray,
    some: IntArray,
    other: FloatArray,
    hit: float,
    independence: float,
    prior: FloatArray,
) -> Any:
    """log p(beams) for a prior covariance (3, 3) of the pose, by Laplace's approximation.

    Two linearizations. ``residuals`` (k,) of ``some`` beams (k,) are those at the prior's mean,
    with variances ``own`` (k,) and derivatives ``row`` (n, 12) of all beams. Other causes of a
    reading have densities ``other`` (k, 2), of longer and of shorter ranges.
    """
    shift, gate = np.zeros(3), prior.copy()
    both, right = np.empty((3, 3)), np.empty((3, 4))
    information, gradient, total, pull = np.zeros((3, 3)), np.zeros(3), 0.0, 0.0
    for step in range(3):
        total = 0.0
        for a in range(3):
            gradient[a] = 0.0
            for b in range(3):
                information[a, b] = 0.0
        for i in range(residuals.shape[0]):
            h, back, spread = row[some[i]], 0.0, own[i]
            for a in range(3):
                back += h[a] * shift[a]
                for b in range(3):
                    spread += h[a] * gate[a, b] * h[b] if step < 2 else 0.0
            residual = residuals[i] - back
            density = hit * math.exp(-0.5 * residual * residual / spread)
            density /= ROOT_TAU * math.sqrt(spread)
            rest = other[i, 1] if residual < 0.0 else other[i, 0]
            total += math.log(density + rest)
            weight = independence * density / (density + rest) / own[i]
            for a in range(3):
                gradient[a] += weight * h[a] * residuals[i]
                for b in range(3):
                    information[a, b] += weight * h[a] * h[b]
        for a in range(3):
            right[a, 3] = 0.0
            for b in range(3):
                both[a, b], right[a, b] = (1.0 if a == b else 0.0), prior[a, b]
                right[a, 3] += prior[a, b] * gradient[b]
                for k in range(3):
                    both[a, b] += prior[a, k] * information[k, b]
        log_determinant = solve(both, right)
        if step == 2:
            break
        pull = 0.0
        for a in range(3):
            shift[a] = right[a, 3]
            for b in range(3):
                gate[a, b] = right[a, b]
        for a in range(3):
            pull += shift[a] * gradient[a]
            for b in range(3):
                pull -= shift[a] * information[a, b] * shift[b]
    return independence * total - 0.5 * (pull + log_determinant)


@called_with("i1 readings f2 densities f1 f")
@_compile
def slipped(
    some: IntArray,
    beams: Readings,
    covariance: FloatArray,
    noise: Densities,
    slipping: FloatArray,
    slips: float,
) -> float:
    """Probability that wheels slipped before a scan, which adds variances ``slipping`` (3,).

    The prior probability is ``slips``. By ``some`` beams (k,), for a state that has only the pose:
    errors from the rest of the state, of ``covariance`` (m, m), count as noise.
    """
    own, residuals, other = np.empty(len(some)), np.empty(len(some)), np.empty((len(some), 2))
    shared = _shared(covariance, beams.columns)
    for k in range(len(some)):
        i = some[k]
        slope, wall = beams.row[i, OFFSET], beams.walls[i]
        residuals[k] = beams.measured[i] - beams.expected[i] - slope * beams.offsets[i]
        own[k] = _scatter(noise, beams.expected[i], slope)
        own[k] += slope * slope * noise.wall_variance if wall < 0 else 0.0
        own[k] += _predicted(beams.row[i], POSE, wall, shared, covariance, beams.columns)
        is_beyond = beams.measured[i] > beams.entered[i]
        other[k, 0] = noise.random + (beams.standing[i] if is_beyond else 0.0)
        other[k, 1] = other[k, 0] + noise.short
    gripping, widened = np.empty((3, 3)), np.empty((3, 3))
    for a in range(3):
        for b in range(3):
            gripping[a, b] = widened[a, b] = covariance[a, b]
        widened[a, a] += slipping[a]
    readings = residuals, own, beams.row, some, other, noise.hit, noise.independence
    log_odds = math.log(slips) - math.log1p(-slips)
    log_odds += _evidence_of_pose(*readings, widened) - _evidence_of_pose(*readings, gripping)
    return 1.0 / (1.0 + math.exp(-min(max(log_odds, -50.0), 50.0)))


@called_with("b1 f1 f1 i1 f2 f1 f")
@_compile
def surely_met(
    used: BoolArray,
    measured: FloatArray,
    ranges: FloatArray,
    numbers: IntArray,
    row: FloatArray,
    most: FloatArray,
    step: float,
) -> None:
    """Keep those ``used`` beams (n,) that return and meet a wall before ``most`` (n,) m.

    Not beside an edge: a wall has an edge where neighbouring beams meet others, ``step`` and a
    tenth of their range apart, or something before it. Not at a grazing incidence.
    """
    last = used.shape[0] - 1
    for i in range(last + 1):
        if numbers[i] < 0 or not measured[i] < np.inf or ranges[i] >= most[i]:
            used[i] = False
            continue
        if abs(row[i, OFFSET]) * GRAZING > 1.0:
            used[i] = False
            continue
        for j in (max(i - 1, 0), min(i + 1, last)):
            if ranges[j] >= most[j] or not abs(ranges[j] - ranges[i]) <= step + 0.1 * ranges[i]:
                used[i] = False


@called_with("f1 f1 f1")
@_compile
def agreement(residuals: FloatArray, before: FloatArray, sums: FloatArray) -> None:
    """Add to ``sums`` (4,) the products of residuals (n,) with those ``before`` and neighbours.

    Products and squares, for both in turn. The residuals ``before`` (m,) are of about the same
    directions: the beams that are used of a dense laser change from scan to scan, and their number
    by one.
    """
    for i in range(residuals.shape[0]):
        here = residuals[i]
        if not abs(here) < np.inf:
            continue
        if i < before.shape[0] and abs(before[i]) < np.inf:
            then = before[i]
            sums[0] += here * then
            sums[1] += 0.5 * (here * here + then * then)
        if i + 1 < residuals.shape[0] and abs(residuals[i + 1]) < np.inf:
            beside = residuals[i + 1]
            sums[2] += here * beside
            sums[3] += 0.5 * (here * here + beside * beside)
