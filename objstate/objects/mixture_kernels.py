"""Bayes' rule for a Gaussian mixture over an object's placement, and its prediction; compiled.

Component c has a placement (x, y, turn) of the object and a Gaussian over ``ERRORS`` numbers: the
error of the robot's pose (x, y, yaw), the distance of the state from the component's middle, the
offset of the object's origin (x, y), the error of a leaf's thickness, and that of its state's zero.
A scan is linearized in these about the component's own mean, so that each component is updated as
by an extended Kalman filter, and its evidence is Laplace's approximation of the integral.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from objstate.compiling import called_with, inner, njit, record
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.linear import ROOT_2, ROOT_TAU, solve
from objstate.sensing.pieces import GRAZING, met

ERRORS = 8  # robot x, y, yaw; state; origin x, y; thickness; zero of the state
ROBOT = 3  # the first of these
STATE, ORIGIN, THICKNESS, ZERO = 3, 4, 6, 7
OBSERVED = ZERO  # the number of errors, the first ones, on which readings depend
FLAT = np.zeros(ERRORS)  # inverse variances of static errors of which nothing is known before
GRAZED_STD = 0.01  # m; roughness of a surface at a grazing incidence
STEP = 0.05  # m between ranges of neighbouring beams that meet different surfaces
# probability of a hit below which a beam carries no information about the object
LEAST_SHARE = 1e-6
HALVINGS = 2  # of a step that makes the errors less probable; after these there is none
MOST_LOOKS = 3  # most linearizations before that of the evidence, where errors are wide
WIDE = 4.0  # times the variance of a range: errors below which one is enough
REACHED = 4.0  # deviations by which a range may fall short of an object that the beam reaches
FOOTPRINT = 0.02  # m, half the width of a beam, and variation of ranges at the edge of a surface
BESIDE = 4  # surfaces beside a beam, see ``Work.beside``
SURE = 4.0  # deviations of its distance from a corner from which a beam surely passes on its side
# what a leaf may have: a handle at the laser's height, and glass; probabilities before any scan,
# and the least that is left of each
HANDLE, GLASS = 0, 1
KINDS, LEAST_KIND = (0.5, 0.02), 1e-3
HANDLE_STOPS, HANDLE_STD = 0.8, 0.02  # share of the beams that meet its outline; m that it is off
GLASS_PASSES = 0.4  # share of the beams that pass a leaf of glass
# nats below the most probable component from which a component isn't refined; doors come to
# others within a fifth of a second with about e^-14 of the weight
HOPELESS = 16.0

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_maker = inner(makes_arrays=True, nogil=True, error_model="numpy", fastmath={"contract"})


@record("beams", "f1 f2 f2 f1 f1 f1 f2 f1")
class Beams(NamedTuple):
    """The beams that may meet an object, in the scan's order, from the robot's mean pose."""

    place: FloatArray  # (2,) m of the robot
    origins: FloatArray  # (n, 2) m in the building
    directions: FloatArray  # (n, 2) unit vectors
    measured: FloatArray  # (n,) m, inf without return
    background: FloatArray  # (n,) m, expected without the object
    blur: FloatArray  # (n,) m^2, the variance of the background
    normals: FloatArray  # (n, 2) of the wall that is met there, 0 for none
    others: FloatArray  # (n,) 1/m, density of the range to other objects, whose state isn't known


@record("noise", "f f f f f f f f f f f f f f")
class Noise(NamedTuple):
    """The beam model, given the expected range; see ``objstate.likelihood``."""

    hit: float  # probability that the expected surface stops the beam
    random: float  # 1/m, density of a random range
    missing: float  # probability of a missing return, whatever is expected
    variance: float  # m^2 of a short range
    growth: float  # its growth with the square of the range
    slant: float  # and with that square times the squared tangent of the incidence
    range_max: float  # m
    unexpected: float  # probability that something unexpected stops a beam
    run: float  # probability that the next beam has the same state
    decay: float  # 1/m, decrease of unexpected things with distance
    run_std: float  # m by which ranges to one unexpected thing differ from beam to beam
    independence: float  # exponent on the likelihood of a beam, for dependent errors
    in_scan: float  # the same in the evidence, for errors that are dependent within a scan
    edge: float  # share of beams beside an edge that meet the other surface, and of mixed ones


@record("shape", "f2 f2 f1 f2 i2 f f1 f2 f2 f1")
class Shape(NamedTuple):
    """An object's outline at the laser's height, and how its state moves it."""

    segments: FloatArray  # (k, 4) m about the object's origin, in its home state
    normals: FloatArray  # (k, 2)
    faces: FloatArray  # (k,) m along its normal by which each is off for each m of thickness
    corners: FloatArray  # (m, 2) m, the ends of the segments
    among: IntArray  # (k, 2) the first corner of each segment's part, and one past the last
    turn: float  # rad of turn for each unit of the state
    slide: FloatArray  # (2,) m of motion in the building for each unit of the state
    handle: FloatArray  # (h, 4) m, segments of what may stick out of it, in the same frame
    handle_normals: FloatArray  # (h, 2)
    about_handle: FloatArray  # (3,) m; x, y and radius of a circle that holds these segments


class Work(NamedTuple):
    """Work arrays of a linearization; shared by all components."""

    expected: FloatArray  # (n,) m to the object, inf where it is missed
    side: IntArray  # (n,) the segment that is met, -1 for none
    bump: FloatArray  # (n,) m to what may stick out of the object, inf where it is missed
    bump_variance: FloatArray  # (n,) m^2, of that range
    share: FloatArray  # (n,) probability that the beam meets the object
    # (n,) relative change of the density between surely meeting and surely missing the object
    odds: FloatArray
    ends: IntArray  # (n, 2) the corners to its left and right that the beam may miss, -1 for none
    corners: FloatArray  # (m, 2) m in the building
    stds: FloatArray  # (m,) m of the distance of a corner from a beam
    flanked: IntArray  # (m,) 1 for corners beside which no background lies behind, else 0
    kinds: FloatArray  # (2,) probabilities of a handle and of glass, by the beams so far
    slopes: FloatArray  # (2,) derivatives of the density of a range by these
    past: FloatArray  # (n,) density of a range that misses the object and hits the background
    # (n, 4) 1/m, densities of a range to surfaces that end beside it: on its two sides in the
    # model, and as the two neighbours read, which only stop a part of it
    beside: FloatArray
    edges: FloatArray  # (n, 4) m to these surfaces, inf for none
    # (n, 2) m to the object behind the beam's background, inf for none, and the probability that
    # a beam beside the background's edge meets it
    behind: FloatArray
    # (n,) 1/m, density of a range to something unexpected that didn't stop the beam before
    begun: FloatArray
    gone_on: FloatArray  # (n,) 1/m, of one to the same thing as the beam before
    ended: FloatArray  # (n,) probability that a thing which stopped the beam before ends there
    origins: FloatArray  # (n, 2) m of the beams
    directions: FloatArray  # (n, 2)
    row: FloatArray  # (7,) derivatives of one range by the errors
    gradient: FloatArray  # (7,) of the log-likelihood
    information: FloatArray  # (7, 7) Gauss-Newton approximation
    matrix: FloatArray  # (8, 8)
    right: FloatArray  # (8, 8)
    x: FloatArray  # (8,) errors about which readings are linearized: mean + prior pull
    pull: FloatArray  # (8,)
    spread: FloatArray  # (8, 8) covariance of errors that count in distinguishing hits from others


@_inner
def _cast(
    beams: Beams,
    shape: Shape,
    placement: FloatArray,
    x: FloatArray,
    prior: FloatArray,
    work: Work,
) -> Any:
    """Cast the beams with the object at a component's errors (8,); return its placement.

    Whether a beam passes beside a corner is uncertain by errors of the covariance ``prior`` (8, 8).
    A corner that was flanked in an earlier cast is where it is modelled: the opening ends there,
    wherever the leaf hangs.
    """
    cos, sin = math.cos(x[2]), math.sin(x[2])
    turned = placement[2] + shape.turn * x[STATE]
    cos_turned, sin_turned = math.cos(turned), math.sin(turned)
    east = placement[0] + shape.slide[0] * x[STATE] + x[4]
    north = placement[1] + shape.slide[1] * x[STATE] + x[5]
    placed = cos_turned, sin_turned, east, north
    for j in range(shape.corners.shape[0]):
        own_x, own_y = shape.corners[j, 0], shape.corners[j, 1]
        work.corners[j, 0] = east + cos_turned * own_x - sin_turned * own_y
        work.corners[j, 1] = north + sin_turned * own_x + cos_turned * own_y
        if work.flanked[j] == 1:
            work.corners[j, 0] -= x[ORIGIN]
            work.corners[j, 1] -= x[ORIGIN + 1]
    for i in range(beams.measured.shape[0]):
        off_x, off_y = beams.origins[i, 0] - beams.place[0], beams.origins[i, 1] - beams.place[1]
        dx = cos * beams.directions[i, 0] - sin * beams.directions[i, 1]
        dy = sin * beams.directions[i, 0] + cos * beams.directions[i, 1]
        begin_x = beams.place[0] + x[0] + cos * off_x - sin * off_y
        begin_y = beams.place[1] + x[1] + sin * off_x + cos * off_y
        work.origins[i, 0], work.origins[i, 1] = begin_x, begin_y
        work.directions[i, 0], work.directions[i, 1] = dx, dy
        work.expected[i], work.side[i], work.bump[i] = np.inf, -1, np.inf
        work.behind[i, 0], work.behind[i, 1] = np.inf, 0.0
        if i == 0:
            _see_corners(beams, shape, x, prior, placed, work)
        left, right = _outermost(i, np.int64(0), work.corners.shape[0], work)
        work.share[i] = 0.0
        if left < 0 or _surely_past(i, left, 1.0, work) or _surely_past(i, right, -1.0, work):
            continue
        off_x, off_y = begin_x - east, begin_y - north
        own_x = cos_turned * off_x + sin_turned * off_y
        own_y = cos_turned * off_y - sin_turned * off_x
        own_dx, own_dy = cos_turned * dx + sin_turned * dy, cos_turned * dy - sin_turned * dx
        nearest, work.side[i] = _nearest(shape, own_x, own_y, own_dx, own_dy, x[THICKNESS])
        may_bump = _passes(own_x, own_y, own_dx, own_dy, shape.about_handle)
        for k in range(shape.handle.shape[0] if may_bump else 0):
            normal = shape.handle_normals[k]
            bump = met(own_x, own_y, own_dx, own_dy, shape.handle[k], normal)
            if bump < min(work.bump[i], nearest, beams.background[i]):
                cosine = max(abs(normal[0] * own_dx + normal[1] * own_dy), GRAZING)
                work.bump[i], work.bump_variance[i] = bump, (HANDLE_STD / cosine) ** 2
        if work.side[i] >= 0:
            work.expected[i] = nearest
            _cover(i, shape.among[work.side[i]], beams.background[i], work)
        else:
            _graze(i, beams.background[i], work)
        if work.expected[i] >= beams.background[i]:
            work.behind[i, 0], work.behind[i, 1] = work.expected[i], work.share[i]
            work.expected[i], work.side[i], work.share[i] = np.inf, -1, 0.0
    return placed


@_inner
def _passes(x: float, y: float, dx: float, dy: float, circle: FloatArray) -> Any:
    """Whether the line of a ray passes through a circle (3,)."""
    return abs(dx * (circle[1] - y) - dy * (circle[0] - x)) <= circle[2]


@_inner
def _nearest(shape: Shape, x: float, y: float, dx: float, dy: float, thicker: float) -> Any:
    """Distance along a ray to the first segment that it meets, and its number; -1 for none.

    Faces of the object lie as much farther out as it is ``thicker``, but not seen at a grazing
    incidence.
    """
    nearest, side = np.inf, -1
    for k in range(shape.segments.shape[0]):
        normal = shape.normals[k]
        distance = met(x, y, dx, dy, shape.segments[k], normal)
        cosine = normal[0] * dx + normal[1] * dy
        if abs(cosine) >= GRAZING:
            distance += shape.faces[k] * thicker / cosine
        if distance < nearest:
            nearest, side = distance, k
    return nearest, side


@_inner
def _see_corners(
    beams: Beams,
    shape: Shape,
    x: FloatArray,
    prior: FloatArray,
    placed: Any,
    work: Work,
) -> None:
    """Set ``work.stds``: deviations of the distances of corners from beams beside them."""
    for j in range(work.corners.shape[0]):
        dx, dy = work.corners[j, 0] - work.origins[0, 0], work.corners[j, 1] - work.origins[0, 1]
        away = max(math.hypot(dx, dy), FOOTPRINT)
        _sideways(beams, shape, x, dx / away, dy / away, j, placed, work)
        work.stds[j] = math.sqrt(FOOTPRINT * FOOTPRINT + _quadratic(prior, work.row))


@_inner
def _across(i: int, corner: int, work: Work) -> Any:
    """m by which a corner lies to the left of a beam, and along it."""
    dx, dy = work.directions[i, 0], work.directions[i, 1]
    off_x = work.corners[corner, 0] - work.origins[i, 0]
    off_y = work.corners[corner, 1] - work.origins[i, 1]
    return dx * off_y - dy * off_x, dx * off_x + dy * off_y


@_inner
def _surely_past(i: int, corner: int, side: float, work: Work) -> Any:
    """Whether a beam passes the outermost corner on its left (side 1) or right (-1)."""
    return side * _across(i, corner, work)[0] < -SURE * work.stds[corner]


@_inner
def _outermost(i: int, first: int | np.int64, past: int, work: Work) -> Any:
    """The outermost corners to a beam's left and right, of a part that begins at ``first``.

    Only corners before the beam; -1 for none.
    """
    right, left, rightmost, leftmost = np.inf, -np.inf, -1, -1
    for j in range(first, past):
        across, along = _across(i, j, work)
        if along <= 0.0:
            continue
        if across < right:
            right, rightmost = across, j
        if across > left:
            left, leftmost = across, j
    return leftmost, rightmost


@_inner
def _cover(i: int, among: IntArray, background: float, work: Work) -> None:
    """Set ``work.share`` of a beam that meets a part with corners ``among`` some.

    It is the probability that the beam passes between the outermost of them. Corners near by are
    flanked where the ``background`` of the beam isn't behind.
    """
    left, right = _outermost(i, among[0], among[1], work)
    work.ends[i, 0], work.ends[i, 1] = left, right
    share = 1.0
    for side in range(2):
        corner, sign = work.ends[i, side], 1.0 - 2.0 * side
        if corner >= 0:
            across = sign * _across(i, corner, work)[0]
            if across < SURE * work.stds[corner]:
                if background < work.expected[i] + STEP:
                    work.flanked[corner] = 1
                share -= 0.5 * math.erfc(across / (ROOT_2 * work.stds[corner]))
    work.share[i] = max(share, 0.0)


@_inner
def _graze(i: int, background: float, work: Work) -> None:
    """Set ``work.share`` of a beam that meets no segment: it may meet the closest corner.

    The expected range of the object is then the range to that corner, which is flanked where the
    ``background`` isn't behind.
    """
    nearest, closest, towards = -1, np.inf, 0.0
    for j in range(work.corners.shape[0]):
        across, along = _across(i, j, work)
        if along > 0.0 and abs(across) < closest * work.stds[j]:
            nearest, closest, towards = j, abs(across) / work.stds[j], across
            work.expected[i] = along
    work.ends[i, 0], work.ends[i, 1] = -1, -1
    if closest < SURE:
        work.ends[i, 0 if towards < 0.0 else 1] = nearest
        if background < work.expected[i] + STEP:
            work.flanked[nearest] = 1
        work.share[i] = 0.5 * math.erfc(closest / ROOT_2)
    else:
        work.expected[i] = np.inf


@_inner
def _sideways(
    beams: Beams,
    shape: Shape,
    x: FloatArray,
    dx: float,
    dy: float,
    corner: int,
    placed: Any,
    work: Work,
) -> None:
    """Set ``work.row``: derivatives of a corner's distance from a beam by the errors."""
    _, _, east, north = placed
    row = work.row
    corner_x, corner_y = work.corners[corner, 0], work.corners[corner, 1]
    row[0], row[1] = dy, -dx
    row[2] = -dx * (corner_x - beams.place[0] - x[0]) - dy * (corner_y - beams.place[1] - x[1])
    turned = shape.turn * (dx * (corner_x - east) + dy * (corner_y - north))
    row[STATE] = turned + dx * shape.slide[1] - dy * shape.slide[0]
    row[4], row[5], row[THICKNESS] = -dy, dx, 0.0


@_inner
def _bell(off: float, variance: float) -> Any:
    return math.exp(-0.5 * off * off / variance) / (ROOT_TAU * math.sqrt(variance))


@_inner
def _continued(beams: Beams, i: int, j: int) -> Any:
    """Range of beam i to the wall that beam j meets in the background; that of j without a wall."""
    distance, normals = beams.background[j], beams.normals
    across = normals[j, 0] * beams.directions[i, 0] + normals[j, 1] * beams.directions[i, 1]
    if abs(across) < GRAZING:
        return distance
    off_x = beams.origins[j, 0] + distance * beams.directions[j, 0] - beams.origins[i, 0]
    off_y = beams.origins[j, 1] + distance * beams.directions[j, 1] - beams.origins[i, 1]
    continued = (normals[j, 0] * off_x + normals[j, 1] * off_y) / across
    return continued if continued > 0.0 else distance


@_inner
def _mixed(noise: Noise, measured: float, first: float, second: float) -> Any:
    """Density of a range of a beam that meets two surfaces at once: it lies between theirs.

    Uniform between them, and blurred by a uniform error with the variance of the noise.
    """
    nearer, farther = min(first, second), min(max(first, second), noise.range_max)
    is_edge = 1.0 if nearer + STEP < farther else 0.0
    blur = math.sqrt(12.0 * (_scatter(noise, measured) + FOOTPRINT * FOOTPRINT))
    begun, ended = (measured - nearer) / blur + 0.5, (measured - farther) / blur + 0.5
    inside = min(max(begun, 0.0), 1.0) - min(max(ended, 0.0), 1.0)
    return is_edge * noise.edge * noise.hit * inside / max(farther - nearer, STEP)


@_inner
def _set_edges(beams: Beams, noise: Noise, i: int, work: Work) -> Any:
    """Set ``work.beside`` and ``work.edges``: a beam may meet what its neighbours do.

    That is so where the surface that a neighbour should meet, continued, is another than the beam's
    own. It may end farther on than modelled, or stop a part of the beam. So may what a neighbour
    did meet, nearer or farther than the beam. Returned is the density of the range where nothing is
    before the background.
    """
    background, measured, density = beams.background, beams.measured, 0.0
    for side in range(2):
        j = i + 2 * side - 1
        if not 0 <= j < background.shape[0]:
            continue
        if background[j] < np.inf:
            distance = _continued(beams, i, j)
            if abs(distance - background[i]) > STEP:
                variance = _scatter(noise, distance) + FOOTPRINT * FOOTPRINT + beams.blur[j]
                bell = _bell(measured[i] - distance, variance)
                work.beside[i, side], work.edges[i, side] = noise.edge * noise.hit * bell, distance
                density += work.beside[i, side]
        if measured[j] < np.inf and abs(measured[j] - measured[i]) > STEP:
            work.edges[i, 2 + side] = measured[j]
    for side in range(BESIDE):
        if work.edges[i, side] < np.inf:
            density += _mixed(noise, measured[i], work.edges[i, side], background[i])
    return density


@_inner
def _row(beams: Beams, shape: Shape, x: FloatArray, i: int, placed: Any, work: Work) -> Any:
    """Derivatives of a range by the errors; the cosine of incidence."""
    cos, sin, east, north = placed
    side, dx, dy = work.side[i], work.directions[i, 0], work.directions[i, 1]
    nx = cos * shape.normals[side, 0] - sin * shape.normals[side, 1]
    ny = sin * shape.normals[side, 0] + cos * shape.normals[side, 1]
    cosine, row = nx * dx + ny * dy, work.row
    met_x = work.origins[i, 0] + work.expected[i] * dx
    met_y = work.origins[i, 1] + work.expected[i] * dy
    about_x, about_y = met_x - beams.place[0] - x[0], met_y - beams.place[1] - x[1]
    row[0], row[1] = -nx / cosine, -ny / cosine
    row[2] = (nx * about_y - ny * about_x) / cosine
    turned = shape.turn * (ny * (met_x - east) - nx * (met_y - north))
    row[STATE] = (turned + nx * shape.slide[0] + ny * shape.slide[1]) / cosine
    row[4], row[5], row[THICKNESS] = nx / cosine, ny / cosine, shape.faces[side] / cosine
    return cosine


@_inner
def _quadratic(matrix: FloatArray, row: FloatArray) -> Any:
    """row^T matrix row, of a symmetric matrix."""
    total = 0.0
    for a in range(row.shape[0]):
        for b in range(a):
            total += 2.0 * row[a] * matrix[a, b] * row[b]
        total += row[a] * matrix[a, a] * row[a]
    return total


@_inner
def _scatter(noise: Noise, distance: float) -> Any:
    """m^2 of a range by the laser's noise alone."""
    return noise.variance + noise.growth * distance * distance


@_inner
def _slanted(noise: Noise, distance: float, cosine: float) -> Any:
    """m^2 that the noise of a range has more at an incidence."""
    squared = max(cosine * cosine, GRAZING * GRAZING)
    return noise.slant * distance * distance * (1.0 / squared - 1.0)


@_inner
def _variance(
    scatter: float, is_met: bool, cosine: float, spread: FloatArray, row: FloatArray
) -> Any:
    """m^2 of a range to the object, with errors of a covariance ``spread`` (8, 8)."""
    if not is_met:
        return scatter + FOOTPRINT * FOOTPRINT
    if abs(cosine) < GRAZING:
        return scatter + (GRAZED_STD / max(abs(cosine), GRAZED_STD)) ** 2
    return scatter + (_quadratic(spread, row) if spread[0, 0] > 0.0 else 0.0)


@_inner
def _set_runs(beams: Beams, noise: Noise, new: FloatArray, work: Work) -> None:
    """Let unexpected things that were met before begin and end at little cost.

    A thing begins and ends once, not in each scan that shows another piece of it. Readings that are
    likelier of one thing than of two belong to a run. In as far as some beam of a run is less
    ``new`` (n,) than its first one, that goes on from the next beam; and in as far as it is less
    new than the beam behind the run, the run is known to end there.
    """
    least = new[-1]
    for i in range(new.shape[0] - 2, -1, -1):
        step, begun = work.gone_on[i + 1], work.begun[i]
        least = least if step > work.begun[i + 1] > 0.0 else new[i]
        if least < new[i] and begun > 0.0:
            begins = noise.unexpected * (1.0 - noise.run if i > 0 else 1.0)
            ratio = noise.run * step / (begins * begun)
            work.begun[i] *= max(ratio, 1.0) ** (1.0 - least / new[i])
        least = min(least, new[i])
    ends, least = (1.0 - noise.run) * (1.0 - noise.unexpected), new[0]
    for i in range(1, new.shape[0]):
        if work.gone_on[i] > work.begun[i] > 0.0:
            least = min(least, new[i])
            continue
        work.ended[i] = ends ** min(least / new[i], 1.0)
        least = new[i]


@_inner
def _set_densities(beams: Beams, noise: Noise, new: FloatArray, work: Work) -> None:
    """Set the densities of ``work`` that don't depend on the state; beams are so ``new`` (n,)."""
    for i in range(beams.measured.shape[0]):
        measured, background = beams.measured[i], beams.background[i]
        work.past[i], work.begun[i], work.gone_on[i] = 0.0, 0.0, 0.0
        work.ended[i] = (1.0 - noise.run) * (1.0 - noise.unexpected)
        if measured == np.inf:
            work.past[i] = noise.hit if background >= noise.range_max else 0.0
            continue
        work.past[i] = _set_edges(beams, noise, i, work)
        work.past[i] += noise.hit * beams.others[i]
        if background < np.inf:
            blurred = _scatter(noise, background) + beams.blur[i]
            work.past[i] += noise.hit * _bell(measured - background, blurred)
        work.begun[i] = noise.decay * math.exp(-noise.decay * measured)
        if i > 0 and beams.measured[i - 1] < np.inf:
            off = measured - beams.measured[i - 1]
            work.gone_on[i] = _bell(off, noise.run_std * noise.run_std)
    if noise.unexpected > 0.0:
        _set_runs(beams, noise, new, work)


@_inner
def _past_edge(noise: Noise, measured: float, passes: float, i: int, work: Work) -> Any:
    """By how much an object behind a beam's background changes the density of its range.

    A beam that passes beside the background's edge meets the object there, before what lies behind.
    """
    behind, share = work.behind[i, 0], (1.0 - passes) * work.behind[i, 1]
    beside = 0.0
    for side in range(2):
        if behind < work.edges[i, side] < np.inf:
            bell = _bell(measured - behind, _scatter(noise, behind) + FOOTPRINT * FOOTPRINT)
            beside += noise.edge * noise.hit * bell - work.beside[i, side]
    return share * beside


@_inner
def _reaches(beams: Beams, noise: Noise, i: int, passes: float, work: Work) -> Any:
    """Probability that a beam gets as far as it was measured, if nothing unexpected stops it."""
    measured, beside = beams.measured[i], 0.0
    if measured < beams.background[i]:
        return 1.0 if measured < work.expected[i] else 1.0 - work.share[i]
    for side in range(2):
        if measured < work.edges[i, side] < np.inf:
            beside = noise.edge
    behind = measured > work.behind[i, 0]
    return beside * (1.0 - (1.0 - passes) * work.behind[i, 1]) if behind else beside


@_inner
def _fared(beams: Beams, noise: Noise, work: Work, i: int, variance: float, before: Any) -> Any:
    """Densities of a range: a hit of the object, a free beam, and one stopped unexpectedly.

    The last value is the difference of the density between meeting the object and missing it.
    Whether something unexpected stops a beam is a hidden Markov chain along the scan; ``before``
    are the probabilities that the beam before was free and was stopped.
    """
    measured, stays = beams.measured[i], noise.run if i > 0 else 0.0
    free = stays + (1.0 - stays) * (1.0 - noise.unexpected)
    reaches = free * before[0] + work.ended[i] * before[1]
    goes_on, begins = stays * before[1], (1.0 - stays) * noise.unexpected
    expected, past, share = work.expected[i], work.past[i], work.share[i]
    passes, work.slopes[HANDLE] = GLASS_PASSES * work.kinds[GLASS], 0.0
    if measured == np.inf:
        met_it = noise.hit if expected >= noise.range_max else 0.0
        work.slopes[GLASS] = reaches * share * GLASS_PASSES * (past - met_it)
        met_it += passes * (past - met_it)
        missed = noise.missing + share * met_it + (1.0 - share) * past
        return 0.0, reaches * missed, (goes_on + begins) * noise.missing, reaches * (met_it - past)
    met_it, bumped, clear, before_it = 0.0, 0.0, 1.0, 0.0
    if work.behind[i, 0] < np.inf:
        past += _past_edge(noise, measured, passes, i, work)
    if share > 0.0:
        met_it = noise.hit * _bell(measured - expected, variance)
        for side in range(BESIDE):
            is_before = 1.0 if work.edges[i, side] < expected else 0.0
            mixed = _mixed(noise, measured, work.edges[i, side], expected)
            before_it += is_before * (work.beside[i, side] + mixed)
        before_it += noise.hit * beams.others[i] if measured < expected else 0.0
    solid = (1.0 - passes) * met_it
    by_glass = past - met_it - before_it
    if work.bump[i] < np.inf:
        spread = _scatter(noise, work.bump[i]) + work.bump_variance[i]
        bumped = noise.hit * _bell(measured - work.bump[i], spread)
        otherwise = past - share * (1.0 - passes) * by_glass
        work.slopes[HANDLE] = reaches * HANDLE_STOPS * (bumped - otherwise)
        clear = 1.0 - HANDLE_STOPS * work.kinds[HANDLE]
    work.slopes[GLASS] = reaches * clear * share * GLASS_PASSES * by_glass
    past *= clear
    hit = reaches * share * clear * solid
    met_it = clear * (solid + (1.0 - passes) * before_it) + passes * past
    free = reaches * (share * met_it + (1.0 - share) * past + (1.0 - clear) * bumped + noise.random)
    stopped = begins * work.begun[i] + goes_on * work.gone_on[i]
    stopped *= _reaches(beams, noise, i, passes, work)
    stopped += (goes_on + begins) * noise.random
    return hit, free, stopped, reaches * (met_it - past)


@_inner
def _begin(kinds: FloatArray, work: Work) -> None:
    """Set the sums of a linearization to zero, and ``work.kinds`` to what is known so far (2,)."""
    work.kinds[HANDLE], work.kinds[GLASS] = kinds[HANDLE], kinds[GLASS]
    for a in range(OBSERVED):
        work.gradient[a] = 0.0
        for b in range(OBSERVED):
            work.information[a, b] = 0.0


@_inner
def _tell_kinds(work: Work, density: float, independence: float) -> None:
    """Update the probabilities of a handle and of glass by a range of a density."""
    for k in range(len(KINDS)):
        slope, before = work.slopes[k], work.kinds[k]
        if slope == 0.0 or before == 0.0 or (slope < 0.0 and before <= LEAST_KIND):
            continue
        ratio = (density + (1.0 - before) * slope) / (density - before * slope)
        odds = before / (1.0 - before) * ratio**independence
        work.kinds[k] = min(max(odds / (1.0 + odds), LEAST_KIND), 1.0 - LEAST_KIND)


@_inner
def _linearize(
    beams: Beams,
    shape: Shape,
    noise: Noise,
    placement: FloatArray,
    x: FloatArray,
    prior: FloatArray,
    spread: FloatArray,
    kinds: FloatArray,
    fresh: FloatArray,
    repeated: FloatArray,
    work: Work,
) -> Any:
    """Log-likelihood of a scan at errors (8,), and the number of beams that reach the object.

    ``work`` takes its gradient and information, and ``kinds`` (2,) after the scan. The chain of
    unexpected things is summed over by the forward recursion. A beam contributes by the probability
    that it hit. Errors of a covariance ``spread`` (8, 8) are included in distinguishing hits from
    others. Beams count by ``fresh`` (n,) in the likelihood. The last two values are the share of
    the information that is fresh, and the log-likelihood in which beams count by ``repeated`` (n,).
    """
    placed = _cast(beams, shape, placement, x, prior, work)
    gradient, information, row = work.gradient, work.information, work.row
    _begin(kinds, work)
    total, reach, fared, cosine = 0.0, 0, (1.0, 0.0), 1.0
    all_told, freshly, again = 0.0, 0.0, 0.0
    for i in range(work.expected.shape[0]):
        is_met = work.side[i] >= 0
        if is_met:
            cosine = _row(beams, shape, x, i, placed, work)
        scatter, variance = 0.0, 0.0
        if work.share[i] > 0.0:
            scatter = _scatter(noise, work.expected[i])
            if is_met:
                scatter += _slanted(noise, work.expected[i], cosine)
            variance = _variance(scatter, is_met, cosine, spread, row)
        off = beams.measured[i] - work.expected[i]
        reach += is_met and off > -REACHED * math.sqrt(variance)
        hit, free, stopped, odds = _fared(beams, noise, work, i, variance, fared)
        density = free + stopped
        work.odds[i] = odds / density
        fared = (free / density, stopped / density)
        _tell_kinds(work, density, noise.independence)
        log = math.log(density)
        total, again = total + fresh[i] * log, again + repeated[i] * log
        if is_met and abs(cosine) >= GRAZING and hit > LEAST_SHARE * density:
            weight = noise.independence * hit / density / scatter
            all_told, freshly = all_told + weight, freshly + fresh[i] * weight
            for a in range(OBSERVED):
                gradient[a] += weight * off * row[a]
                for b in range(a + 1):
                    information[a, b] += weight * row[a] * row[b]
    for a in range(OBSERVED):
        for b in range(a):
            information[b, a] = information[a, b]
    share = freshly / all_told if all_told > 0.0 else 1.0
    return noise.in_scan * total, reach, placed, share, noise.in_scan * again


@_inner
def _posterior(prior: FloatArray, work: Work) -> Any:
    """Set ``work.right`` to the posterior covariance (8, 8); return log |1 + prior information|."""
    for a in range(ERRORS):
        for b in range(ERRORS):
            value = 1.0 if a == b else 0.0
            for k in range(OBSERVED if b < OBSERVED else 0):
                value += prior[a, k] * work.information[k, b]
            work.matrix[a, b], work.right[a, b] = value, prior[a, b]
    return solve(work.matrix, work.right)


@_inner
def _step(mean: FloatArray, prior: FloatArray, work: Work) -> None:
    """Move the errors ``work.x`` (8,) to the mode of the linearized posterior, mean + prior pull.

    That is the posterior covariance, ``work.right``, times the gradient about the prior mean; as
    it is symmetric, the pull is what remains of that gradient once the information has been met.
    """
    x, pull = work.x, work.pull
    for a in range(OBSERVED):
        pull[a] = work.gradient[a]
        for b in range(OBSERVED):
            pull[a] += work.information[a, b] * (x[b] - mean[b])
    for a in range(ERRORS):
        x[a] = mean[a]
        for b in range(OBSERVED):
            x[a] += work.right[a, b] * pull[b]
    for a in range(OBSERVED):
        for b in range(OBSERVED):
            pull[a] -= work.information[a, b] * (x[b] - mean[b])


@_inner
def _spent(mean: FloatArray, x: FloatArray, pull: FloatArray) -> Any:
    """Squared Mahalanobis distance of errors x = mean + prior pull from the prior's mean."""
    spent = 0.0
    for a in range(OBSERVED):
        spent += pull[a] * (x[a] - mean[a])
    return spent


@_inner
def _unlikely(errors: FloatArray, precisions: FloatArray) -> Any:
    """Negative log prior density of static errors, up to a constant.

    The prior of the origin has heavy tails: Student's t with two degrees of freedom.
    """
    away = errors[ORIGIN] * errors[ORIGIN] + errors[ORIGIN + 1] * errors[ORIGIN + 1]
    inside = precisions[STATE] * errors[STATE] * errors[STATE]
    inside += precisions[THICKNESS] * errors[THICKNESS] * errors[THICKNESS]
    return 2.0 * math.log(1.0 + 0.5 * precisions[ORIGIN] * away) + 0.5 * inside


@_inner
def _cost(mean: FloatArray, share: float, precisions: FloatArray, work: Work) -> Any:
    """What the errors ``work.x`` cost in log density by a scan of which a share is fresh."""
    x, pull = work.x, work.pull
    static = _unlikely(x, precisions) - _unlikely(mean, precisions)
    return 0.5 * share * _spent(mean, x, pull) + (1.0 - share) * static


@_inner
def _set_posterior(
    mean: FloatArray,
    prior: FloatArray,
    log_determinant: float,
    share: float,
    work: Work,
) -> Any:
    """Set mean and prior to the posterior, linearized at ``work.x``; log evidence.

    ``work`` has the posterior covariance, and ``_posterior`` gave the logarithm of its determinant.
    A scan of which a share is fresh counts by that share.
    """
    x, pull = work.x, work.pull
    gained, spent = 0.0, _spent(mean, x, pull)
    for a in range(ERRORS):
        step = 0.0
        for b in range(OBSERVED):
            step += work.right[a, b] * (work.gradient[b] - pull[b])
        gained += (work.gradient[a] - pull[a]) * step if a < OBSERVED else 0.0
        mean[a] = x[a] + step
    for a in range(ERRORS):
        for b in range(ERRORS):
            prior[a, b] = 0.5 * (work.right[a, b] + work.right[b, a])
    return 0.5 * share * (gained - log_determinant - spent)


@_inner
def _see_edges(
    beams: Beams,
    shape: Shape,
    independence: float,
    mean: FloatArray,
    covariance: FloatArray,
    placed: Any,
    times: FloatArray,
    work: Work,
) -> None:
    """Update by the side of the corners on which beams passed: assumed density filtering.

    Beam by beam. A flanked corner isn't seen: what beams show is where an opening ends, at a frame
    whose place the model doesn't know and all scans share. Shares and corners are those at the
    errors ``work.x`` (8,). Given the margin by which a beam meets the object, it does so with the
    probability of a normal distribution function as wide as the beam. What was met so many
    ``times`` (n,) counts by one over that.
    """
    row, x, step = work.row, work.x, work.pull
    for i in range(work.share.shape[0]):
        if not LEAST_SHARE < work.share[i] < 1.0 - LEAST_SHARE:
            continue
        counted = independence / times[i]
        for side in range(2):
            corner, sign = work.ends[i, side], 1.0 - 2.0 * side
            if corner < 0 or work.flanked[corner] == 1:
                continue
            dx, dy = work.directions[i, 0], work.directions[i, 1]
            margin = dx * (work.corners[corner, 1] - work.origins[i, 1])
            margin -= dy * (work.corners[corner, 0] - work.origins[i, 0])
            if abs(margin) > SURE * work.stds[corner]:
                continue
            _sideways(beams, shape, x, dx, dy, corner, placed, work)
            variance = FOOTPRINT * FOOTPRINT
            for a in range(ERRORS):
                step[a] = 0.0
                for b in range(OBSERVED):
                    step[a] += covariance[a, b] * row[b]
            for a in range(OBSERVED):
                margin += row[a] * (mean[a] - x[a])
                variance += row[a] * step[a]
            std = math.sqrt(variance)
            off = sign * margin / std
            share = 0.5 * math.erfc(-off / ROOT_2)
            density = max(1.0 + work.odds[i] * (share - work.share[i]), LEAST_SHARE)
            slope = work.odds[i] * math.exp(-0.5 * off * off) / (ROOT_TAU * std * density)
            bend = counted * max(slope * (slope + off / std), 0.0)
            slope *= counted * sign
            for a in range(ERRORS):
                mean[a] += slope * step[a]
                for b in range(ERRORS):
                    covariance[a, b] -= bend * step[a] * step[b]


@_inner
def _copy(mean: FloatArray, covariance: FloatArray, to: FloatArray, spread: FloatArray) -> None:
    """Set ``to`` (8,) to a mean, and ``spread`` (8, 8) to a covariance."""
    for a in range(ERRORS):
        to[a] = mean[a]
        for b in range(ERRORS):
            spread[a, b] = covariance[a, b]


@_inner
def _refine(
    beams: Beams,
    shape: Shape,
    noise: Noise,
    placement: FloatArray,
    mean: FloatArray,
    prior: FloatArray,
    precisions: FloatArray,
    kinds: FloatArray,
    fresh: FloatArray,
    repeated: FloatArray,
    against: Any,
    looks: int,
    work: Work,
) -> Any:
    """Move the errors ``work.x`` (8,) from a component's mean to the mode of its posterior.

    After some ``looks``, each a Gauss-Newton step, the evidence is computed without the errors'
    covariance, which such a step includes. Steps that lead to less probable errors are halved.
    ``against`` has whether the object just arrived in the component, whether it is the first one,
    the log-likelihood of what is repeated in the first one, with which arrivals are compared, and
    the least log-likelihoods, before and after the steps, from which on the component counts.
    Returned are the log-likelihood, that before the steps, that with which arrivals are compared,
    the number of beams that reach the object, the share of the information that is fresh, the
    placement, and log |1 + prior information|, NaN for a component that doesn't count.
    """
    is_new, is_first, expected, least_before, least_after = against
    x, pull, spread = work.x, work.pull, work.spread
    _copy(mean, prior, x, spread)
    total, unrefined, reach, share = 0.0, 0.0, 0, 1.0
    placed, log_determinant, at_mean, scale = (1.0, 0.0, 0.0, 0.0), np.nan, 0.0, 1.0
    for look in range(looks + HALVINGS + 3):
        if look == looks:
            spread[:] = 0.0
        total, reach, placed, share, again = _linearize(
            beams,
            shape,
            noise,
            placement,
            mean if look == looks else x,
            prior,
            spread,
            kinds,
            fresh,
            repeated,
            work,
        )
        expected = again if is_first else expected
        total -= expected if is_new else 0.0
        unrefined = total if look == 0 else unrefined
        if look < looks:
            if unrefined < least_before:
                break
            _posterior(prior, work)
            _step(mean, prior, work)
            _copy(x, work.right, x, spread)
        elif look == looks:
            at_mean = total
        elif total - _cost(mean, share, precisions, work) >= at_mean or scale == 0.0:
            if total >= least_after:
                log_determinant = _posterior(prior, work)
            break
        else:
            scale = 0.5 if look <= looks + HALVINGS else 0.0
            for a in range(ERRORS):
                x[a], pull[a] = mean[a] + scale * (x[a] - mean[a]), scale * pull[a]
    return total, unrefined, expected, reach, share, placed, log_determinant


@_maker
def _heaviest_first(weights: FloatArray) -> Any:
    """Components by descending weights (c,), none of 0; ``argsort`` takes longer to compile."""
    order, count = np.empty(weights.shape[0], dtype=np.int64), 0
    for c in range(weights.shape[0]):
        if weights[c] == 0.0:
            continue
        k = count
        while k > 0 and weights[order[k - 1]] < weights[c]:
            order[k] = order[k - 1]
            k -= 1
        order[k] = c
        count += 1
    return order[:count]


@called_with("beams shape noise f1 f1 b1 f2 f1 f1 f2 f3 f2 f1")
@_compile
def condition(
    beams: Beams,
    shape: Shape,
    noise: Noise,
    shares: FloatArray,
    times: FloatArray,
    arrived: BoolArray,
    placements: FloatArray,
    weights: FloatArray,
    precisions: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    kinds: FloatArray,
    log_evidence: FloatArray,
) -> Any:
    """Bayes' rule in every component: ``means`` (c, 8) and ``covariances`` (c, 8, 8) are updated.

    ``log_evidence`` (c,) is log p(scan | component), by Laplace's approximation about the mean
    after one or, where errors are wide, ``MOST_LOOKS`` Gauss-Newton steps. The error of the state's
    zero doesn't move the object. Components of ``weights`` (c,) that the scan makes nearly
    impossible stay as they are, and those of 0 are left out. With a placement of nan the object is
    nowhere, and no beam meets it. ``precisions`` (8,) are inverse prior variances of static errors,
    see ``_unlikely``. ``kinds`` (c, 2) are the probabilities of a handle and of glass. Returned is
    the largest number of beams that reach the object in a component.

    Beams count by ``shares`` (n,) over how many ``times`` (n,) what they tell was told. In
    components that the object just ``arrived`` in (c,), what they count less also counts, relative
    to the heaviest component: readings that repeat earlier ones speak against a movement.
    """
    count, most = beams.measured.shape[0], 0
    work = Work(
        np.empty(count),
        np.empty(count, dtype=np.int64),
        np.empty(count),
        np.empty(count),
        np.empty(count),
        np.empty(count),
        np.empty((count, 2), dtype=np.int64),
        np.empty((shape.corners.shape[0], 2)),
        np.empty(shape.corners.shape[0]),
        np.empty(shape.corners.shape[0], dtype=np.int64),
        np.empty(len(KINDS)),
        np.empty(len(KINDS)),
        np.empty(count),
        np.zeros((count, BESIDE)),
        np.full((count, BESIDE), np.inf),
        np.empty((count, 2)),
        np.empty(count),
        np.empty(count),
        np.empty(count),
        np.empty((count, 2)),
        np.empty((count, 2)),
        np.empty(OBSERVED),
        np.empty(OBSERVED),
        np.empty((OBSERVED, OBSERVED)),
        np.empty((ERRORS, ERRORS)),
        np.empty((ERRORS, ERRORS)),
        np.empty(ERRORS),
        np.zeros(ERRORS),
        np.empty((ERRORS, ERRORS)),
    )
    new = shares / times
    repeated = shares - new
    _set_densities(beams, noise, new, work)
    likeliest, first = -np.inf, -np.inf  # log posteriors, after and before refinement
    expected, is_first = 0.0, True  # log-likelihood of what is repeated, in the heaviest component
    for c in _heaviest_first(weights):
        mean, prior, wide = means[c], covariances[c], 0.0
        for a in range(ERRORS):
            wide += prior[a, a] if a not in (2, STATE, ZERO) else 0.0
        looks = 1 if wide < WIDE * noise.variance else MOST_LOOKS
        work.flanked[:] = 0
        fresh = shares if arrived[c] else new
        log_weight, unlikely = math.log(weights[c]), _unlikely(mean, precisions)
        bounds = first - HOPELESS - log_weight, likeliest - HOPELESS - log_weight
        total, unrefined, expected, reach, share, placed, log_determinant = _refine(
            beams,
            shape,
            noise,
            placements[c],
            mean,
            prior,
            precisions,
            kinds[c],
            fresh,
            repeated,
            (arrived[c], is_first, expected, *bounds),
            looks,
            work,
        )
        is_first = False
        first = max(first, log_weight + unrefined)
        most = max(most, reach)
        log_evidence[c] = total
        if np.isnan(log_determinant):
            continue
        log_evidence[c] += _set_posterior(mean, prior, log_determinant, share, work)
        kinds[c, HANDLE], kinds[c, GLASS] = work.kinds[HANDLE], work.kinds[GLASS]
        likeliest = max(likeliest, log_weight + log_evidence[c])
        _see_edges(beams, shape, noise.independence, mean, prior, placed, times, work)
        log_evidence[c] -= (1.0 - share) * (_unlikely(mean, precisions) - unlikely)
    return most


@called_with("f2 f3 f2 f2")
@_compile
def renew_robot(
    means: FloatArray, covariances: FloatArray, transfer: FloatArray, added: FloatArray
) -> None:
    """Set the robot's errors to ``transfer`` (3, 3) times themselves, plus covariance ``added``."""
    moved = np.empty((ROBOT, ERRORS))
    for c in range(means.shape[0]):
        mean, covariance = means[c], covariances[c]
        first, second, third = mean[0], mean[1], mean[2]
        for a in range(ROBOT):
            mean[a] = transfer[a, 0] * first + transfer[a, 1] * second + transfer[a, 2] * third
            for b in range(ERRORS):
                moved[a, b] = 0.0
                for k in range(ROBOT):
                    moved[a, b] += transfer[a, k] * covariance[k, b]
        for a in range(ROBOT):
            for b in range(ROBOT, ERRORS):
                covariance[a, b] = covariance[b, a] = moved[a, b]
            for b in range(ROBOT):
                covariance[a, b] = added[a, b]
                for k in range(ROBOT):
                    covariance[a, b] += moved[a, k] * transfer[b, k]


@_maker
def _pooled(weights: FloatArray, means: FloatArray, covariances: FloatArray) -> Any:
    """Mean (8,) and covariance (8, 8) of a mixture of Gaussians with weights (c,) of sum one."""
    mean, covariance = np.zeros(ERRORS), np.zeros((ERRORS, ERRORS))
    for c in range(weights.shape[0]):
        for a in range(ERRORS):
            mean[a] += weights[c] * means[c, a]
    for c in range(weights.shape[0]):
        if weights[c] < 1e-12:
            continue
        for a in range(ERRORS):
            for b in range(ERRORS):
                off = (means[c, a] - mean[a]) * (means[c, b] - mean[b])
                covariance[a, b] += weights[c] * (covariances[c, a, b] + off)
    return mean, covariance


@called_with("f1 f2 f3")
@_compile
def pooled(weights: FloatArray, means: FloatArray, covariances: FloatArray) -> Any:
    """``_pooled``, for Python."""
    return _pooled(weights, means, covariances)


@_maker
def join(
    weights: FloatArray,
    arriving: FloatArray,
    widths: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    kinds: FloatArray,
) -> None:
    """Update components by arrivals, a share ``arriving`` (c,) of their weight.

    What arrives has the errors and the ``kinds`` (c, 2) of the whole mixture, by the ``weights`` of
    the first components before, but no information about the state within the component, whose
    variance is ``widths`` (c,). Only components of which most of the weight has arrived change.
    """
    most, handle, glass = 0.0, 0.0, 0.0
    for c in range(arriving.shape[0]):
        most = max(most, arriving[c])
    if most < 0.5:
        return
    mean, covariance = _pooled(weights, means, covariances)
    for c in range(weights.shape[0]):
        handle += weights[c] * kinds[c, HANDLE]
        glass += weights[c] * kinds[c, GLASS]
    for c in range(arriving.shape[0]):
        if arriving[c] < 0.5:
            continue
        kinds[c, HANDLE], kinds[c, GLASS] = handle, glass
        for a in range(ERRORS):
            means[c, a] = 0.0 if a == STATE else mean[a]
            for b in range(ERRORS):
                covariances[c, a, b] = 0.0 if STATE in (a, b) else covariance[a, b]
        covariances[c, STATE, STATE] = widths[c]
