"""Bayes' rule for a Gaussian mixture over where an object stands, and how it moves on; compiled.

Component c holds that the object stands at a placement (x, y, turn), give or take a Gaussian over
``ERRORS`` numbers: what the robot's pose is off (x, y, yaw), how far the state lies from the
component's middle, and what the object's origin is off (x, y). A scan is linearized in these
about the component's own mean, so that each component takes it in as an extended Kalman filter
does, and its evidence is Laplace's approximation of the integral.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from objstate.compiling import inner, njit
from objstate.geometry import FloatArray, IntArray
from objstate.sensing.surface_kernels import met

ERRORS = 6  # robot x, y, yaw; state; origin x, y
ROBOT = 3  # of them are the robot's
STATE = 3
GRAZING = 0.12  # cosine of incidence below which a range says nothing of where a surface stands
GRAZED_STD = 0.01  # m by which a surface is rough, seen at a grazing incidence
STEP = 0.05  # m between ranges of neighbouring beams, from which they meet different surfaces
LEAST_SHARE = 1e-6  # probability of a hit, below which a beam tells nothing of the object
MOST_LOOKS = 3  # linearizations before the one that the evidence is told by, where errors are wide
WIDE = 4.0  # times the variance of a range: errors from which one is enough are below
REACHED = 4.0  # deviations by which a range may fall short of an object that the beam reaches
FOOTPRINT = 0.02  # m, the deviation of a range whose beam meets the edge of a surface
ROOT_TAU = math.sqrt(2.0 * math.pi)

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


class Beams(NamedTuple):
    """Beams that may meet an object, in the order of the scan, from the robot's mean pose."""

    place: FloatArray  # (2,) m of the robot
    origins: FloatArray  # (n, 2) m in the building
    directions: FloatArray  # (n, 2) unit vectors
    measured: FloatArray  # (n,) m, inf without return
    background: FloatArray  # (n,) m, what is expected without the object
    blur: FloatArray  # (n,) m^2, the variance of that


class Noise(NamedTuple):
    """What a range is likely to be, given the expected one; see ``objstate.likelihood``."""

    hit: float  # probability that what is expected stops the beam
    random: float  # 1/m, density of a range that nothing explains
    missing: float  # probability of a missing return, whatever is expected
    variance: float  # m^2 of a range
    range_max: float  # m
    unexpected: float  # probability that something unexpected stops a beam
    run: float  # probability that the next beam fares as the one before
    decay: float  # 1/m, of unexpected things with their distance
    run_std: float  # m by which ranges to one unexpected thing differ from beam to beam
    independence: float  # exponent on the likelihood of a beam, as their errors go together
    edge: float  # share of beams beside an edge that the surface next to it stops


class Shape(NamedTuple):
    """An object's outline at the laser's height, and how its state moves it."""

    segments: FloatArray  # (k, 4) m about the object's origin, in its home state
    normals: FloatArray  # (k, 2)
    turn: float  # rad that it turns for each unit of the state
    slide: FloatArray  # (2,) m that it moves in the building


class Work(NamedTuple):
    """Arrays that a linearization fills; made once for all components."""

    expected: FloatArray  # (n,) m
    side: IntArray  # (n,) the segment that is met, -1 for the background
    origins: FloatArray  # (n, 2) m of the beams
    directions: FloatArray  # (n, 2)
    row: FloatArray  # (6,) how one range changes with the errors
    gradient: FloatArray  # (6,) of the log-likelihood
    information: FloatArray  # (6, 6) Gauss-Newton's
    matrix: FloatArray  # (6, 6)
    right: FloatArray  # (6, 6)


@_inner
def _cast(beams: Beams, shape: Shape, placement: FloatArray, x: FloatArray, work: Work) -> Any:
    """What beams meet, with the object where a component's errors (6,) put it; where it stands."""
    cos, sin = math.cos(x[2]), math.sin(x[2])
    turned = placement[2] + shape.turn * x[STATE]
    cos_turned, sin_turned = math.cos(turned), math.sin(turned)
    east = placement[0] + shape.slide[0] * x[STATE] + x[4]
    north = placement[1] + shape.slide[1] * x[STATE] + x[5]
    for i in range(beams.measured.shape[0]):
        off_x, off_y = beams.origins[i, 0] - beams.place[0], beams.origins[i, 1] - beams.place[1]
        dx = cos * beams.directions[i, 0] - sin * beams.directions[i, 1]
        dy = sin * beams.directions[i, 0] + cos * beams.directions[i, 1]
        begin_x = beams.place[0] + x[0] + cos * off_x - sin * off_y
        begin_y = beams.place[1] + x[1] + sin * off_x + cos * off_y
        work.origins[i, 0], work.origins[i, 1] = begin_x, begin_y
        work.directions[i, 0], work.directions[i, 1] = dx, dy
        off_x, off_y = begin_x - east, begin_y - north
        own_x = cos_turned * off_x + sin_turned * off_y
        own_y = cos_turned * off_y - sin_turned * off_x
        own_dx, own_dy = cos_turned * dx + sin_turned * dy, cos_turned * dy - sin_turned * dx
        work.expected[i], work.side[i] = beams.background[i], -1
        for k in range(shape.segments.shape[0]):
            distance = met(own_x, own_y, own_dx, own_dy, shape.segments[k], shape.normals[k])
            if distance < work.expected[i]:
                work.expected[i], work.side[i] = distance, k
    return cos_turned, sin_turned, east, north


@_inner
def _bell(off: float, variance: float) -> Any:
    return math.exp(-0.5 * off * off / variance) / (ROOT_TAU * math.sqrt(variance))


@_inner
def _beside_edge(beams: Beams, expected: FloatArray, noise: Noise, i: int) -> Any:
    """Density of a range by the surfaces that the neighbours of a beam meet, where those lie elsewhere."""
    total = 0.0
    for j in (i - 1, i + 1):
        if 0 <= j < expected.shape[0] and abs(expected[j] - expected[i]) > STEP:
            variance = noise.variance + FOOTPRINT * FOOTPRINT + beams.blur[j]
            total += noise.edge * noise.hit * _bell(beams.measured[i] - expected[j], variance)
    return total


@_inner
def _row(beams: Beams, shape: Shape, x: FloatArray, i: int, placed: Any, work: Work) -> Any:
    """How a range changes with each of the errors; the cosine at which the beam meets the surface."""
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
    row[4], row[5] = nx / cosine, ny / cosine
    return cosine


@_inner
def _quadratic(matrix: FloatArray, row: FloatArray) -> Any:
    total = 0.0
    for a in range(row.shape[0]):
        for b in range(row.shape[0]):
            total += row[a] * matrix[a, b] * row[b]
    return total


@_inner
def _variance(
    noise: Noise, blur: float, is_met: bool, cosine: float, spread: FloatArray, row: FloatArray
) -> Any:
    """m^2 of a range to the object, or else to the background, with errors of a covariance ``spread`` (6, 6)."""
    if not is_met:
        return noise.variance + blur
    if abs(cosine) < GRAZING:
        return noise.variance + (GRAZED_STD / max(abs(cosine), GRAZED_STD)) ** 2
    return noise.variance + _quadratic(spread, row)


@_inner
def _fared(
    beams: Beams, noise: Noise, expected: FloatArray, i: int, variance: float, before: Any
) -> Any:
    """Densities of a range that hits what is expected, is free of anything unexpected, and is stopped by that.

    Whether something unexpected stops a beam is a hidden Markov chain along the scan; ``before`` are the
    probabilities that the beam before was free and was stopped.
    """
    measured, stays = beams.measured[i], noise.run if i > 0 else 0.0
    reaches = stays * before[0] + (1.0 - stays) * (1.0 - noise.unexpected)
    goes_on, begins = stays * before[1], (1.0 - stays) * noise.unexpected
    if measured == np.inf:
        missed = noise.missing + (noise.hit if expected[i] >= noise.range_max else 0.0)
        return 0.0, reaches * missed, (goes_on + begins) * noise.missing
    hit = 0.0
    if expected[i] < np.inf:
        hit = reaches * noise.hit * _bell(measured - expected[i], variance)
    free = hit + reaches * (_beside_edge(beams, expected, noise, i) + noise.random)
    stopped = (goes_on + begins) * noise.random
    if measured < expected[i]:
        stopped += begins * noise.decay * math.exp(-noise.decay * measured)
        if i > 0 and beams.measured[i - 1] < np.inf:
            off = measured - beams.measured[i - 1]
            stopped += goes_on * _bell(off, noise.run_std * noise.run_std)
    return hit, free, stopped


@_inner
def _linearize(
    beams: Beams,
    shape: Shape,
    noise: Noise,
    placement: FloatArray,
    x: FloatArray,
    spread: FloatArray,
    work: Work,
) -> Any:
    """Log-likelihood of a scan at errors (6,), whose gradient and information ``work`` takes; how many beams reach it.

    The chain of unexpected things is summed over by the forward recursion. What a beam says counts by the
    probability that it hit. Errors of a covariance ``spread`` (6, 6) are reckoned with in telling hits from others.
    """
    placed = _cast(beams, shape, placement, x, work)
    gradient, information, row = work.gradient, work.information, work.row
    for a in range(ERRORS):
        gradient[a] = 0.0
        for b in range(ERRORS):
            information[a, b] = 0.0
    total, reach, fared, cosine = 0.0, 0, (1.0, 0.0), 1.0
    for i in range(work.expected.shape[0]):
        is_met = work.side[i] >= 0
        if is_met:
            cosine = _row(beams, shape, x, i, placed, work)
        variance = _variance(noise, beams.blur[i], is_met, cosine, spread, row)
        off = beams.measured[i] - work.expected[i]
        reach += is_met and off > -REACHED * math.sqrt(variance)
        hit, free, stopped = _fared(beams, noise, work.expected, i, variance, fared)
        density = free + stopped
        fared = (free / density, stopped / density)
        total += noise.independence * math.log(density)
        if is_met and abs(cosine) >= GRAZING and hit > LEAST_SHARE * density:
            weight = noise.independence * hit / density / noise.variance
            for a in range(ERRORS):
                gradient[a] += weight * off * row[a]
                for b in range(ERRORS):
                    information[a, b] += weight * row[a] * row[b]
    return total, reach


@_inner
def _solve(matrix: FloatArray, right: FloatArray) -> Any:
    """``right`` (6, m) becomes matrix^-1 right; the log of |determinant|. The matrix is overwritten."""
    log_determinant = 0.0
    for k in range(ERRORS):
        pivot = k
        for i in range(k + 1, ERRORS):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(ERRORS):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            for j in range(right.shape[1]):
                right[k, j], right[pivot, j] = right[pivot, j], right[k, j]
        log_determinant += math.log(abs(matrix[k, k]))
        for i in range(k + 1, ERRORS):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, ERRORS):
                matrix[i, j] -= factor * matrix[k, j]
            for j in range(right.shape[1]):
                right[i, j] -= factor * right[k, j]
    for k in range(ERRORS - 1, -1, -1):
        for j in range(right.shape[1]):
            value = right[k, j]
            for i in range(k + 1, ERRORS):
                value -= matrix[k, i] * right[i, j]
            right[k, j] = value / matrix[k, k]
    return log_determinant


@_inner
def _posterior(prior: FloatArray, work: Work) -> Any:
    """The covariance (6, 6) after the information, as ``work.right``; the log-determinant of 1 + prior information."""
    for a in range(ERRORS):
        for b in range(ERRORS):
            value = 1.0 if a == b else 0.0
            for k in range(ERRORS):
                value += prior[a, k] * work.information[k, b]
            work.matrix[a, b], work.right[a, b] = value, prior[a, b]
    return _solve(work.matrix, work.right)


@_inner
def _step(mean: FloatArray, prior: FloatArray, x: FloatArray, pull: FloatArray, work: Work) -> None:
    """Move the errors ``x`` (6,) to the mode of the linearized posterior, mean + prior pull.

    That is the posterior covariance, ``work.right``, times the gradient about the prior mean; as
    it is symmetric, the pull is what remains of that gradient once the information has been met.
    """
    for a in range(ERRORS):
        pull[a] = work.gradient[a]
        for b in range(ERRORS):
            pull[a] += work.information[a, b] * (x[b] - mean[b])
    for a in range(ERRORS):
        x[a] = mean[a]
        for b in range(ERRORS):
            x[a] += work.right[a, b] * pull[b]
    for a in range(ERRORS):
        for b in range(ERRORS):
            pull[a] -= work.information[a, b] * (x[b] - mean[b])


@_inner
def _settle(
    mean: FloatArray, prior: FloatArray, x: FloatArray, pull: FloatArray, work: Work
) -> Any:
    """Let mean and prior be those after the scan, linearized at x = mean + prior pull; what that adds to the evidence."""
    log_determinant, gained, spent = _posterior(prior, work), 0.0, 0.0
    for a in range(ERRORS):
        spent += pull[a] * (x[a] - mean[a])
    for a in range(ERRORS):
        step = 0.0
        for b in range(ERRORS):
            step += work.right[a, b] * (work.gradient[b] - pull[b])
        gained += (work.gradient[a] - pull[a]) * step
        mean[a] = x[a] + step
    for a in range(ERRORS):
        for b in range(ERRORS):
            prior[a, b] = 0.5 * (work.right[a, b] + work.right[b, a])
    return 0.5 * (gained - spent - log_determinant)


@_compile
def condition(
    beams: Beams,
    shape: Shape,
    noise: Noise,
    placements: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    log_evidence: FloatArray,
) -> Any:
    """Bayes' rule in every component: ``means`` (c, 6) and ``covariances`` (c, 6, 6) become the posterior's.

    ``log_evidence`` (c,) is log p(scan | component), by Laplace's approximation about the mean after one or,
    where errors are wide, ``MOST_LOOKS`` Gauss-Newton steps. Also the largest number of beams that reach the object in a component.
    """
    count, most = beams.measured.shape[0], 0
    work = Work(
        np.empty(count),
        np.empty(count, dtype=np.int64),
        np.empty((count, 2)),
        np.empty((count, 2)),
        np.zeros(ERRORS),
        np.empty(ERRORS),
        np.empty((ERRORS, ERRORS)),
        np.empty((ERRORS, ERRORS)),
        np.empty((ERRORS, ERRORS)),
    )
    x, pull, spread = np.empty(ERRORS), np.zeros(ERRORS), np.empty((ERRORS, ERRORS))
    for c in range(placements.shape[0]):
        mean, prior, wide = means[c], covariances[c], 0.0
        for a in range(ERRORS):
            x[a] = mean[a]
            wide += prior[a, a] if a not in (2, STATE) else 0.0
            for b in range(ERRORS):
                spread[a, b] = prior[a, b]
        looks = 1 if wide < WIDE * noise.variance else MOST_LOOKS
        total, reach = 0.0, 0
        for look in range(looks + 1):
            if look == looks:  # the evidence is told without reckoning with errors a second time
                for a in range(ERRORS):
                    for b in range(ERRORS):
                        spread[a, b] = 0.0
            total, reach = _linearize(beams, shape, noise, placements[c], x, spread, work)
            if look < looks:
                _posterior(prior, work)
                _step(mean, prior, x, pull, work)
                for a in range(ERRORS):
                    for b in range(ERRORS):
                        spread[a, b] = work.right[a, b]
        most = max(most, reach)
        log_evidence[c] = total + _settle(mean, prior, x, pull, work)
    return most


@_compile
def renew_robot(means: FloatArray, covariances: FloatArray, kept: float, robot: FloatArray) -> None:
    """Let the robot's errors be others: of what components know of them a share ``kept`` stays, of its covariance (3, 3) the rest."""
    for c in range(means.shape[0]):
        for a in range(ROBOT):
            means[c, a] *= kept
            for b in range(ERRORS):
                covariances[c, a, b] *= kept
                covariances[c, b, a] *= kept
        for a in range(ROBOT):
            for b in range(ROBOT):
                covariances[c, a, b] += (1.0 - kept * kept) * robot[a, b]


@_compile
def pooled(weights: FloatArray, means: FloatArray, covariances: FloatArray) -> Any:
    """Mean (6,) and covariance (6, 6) of a mixture of Gaussians with weights (c,) of sum one."""
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


@_compile
def join(
    arriving: FloatArray,
    mean: FloatArray,
    covariance: FloatArray,
    widths: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
) -> None:
    """Merge what arrives in components, a share ``arriving`` (c,) of their weight, by mean and covariance.

    Those who arrive know of the errors what the whole mixture does, ``mean`` (6,) and ``covariance`` (6, 6), but
    nothing of the state within the component, whose variance is ``widths`` (c,).
    """
    for c in range(arriving.shape[0]):
        share = arriving[c]
        if share < 1e-9:
            continue
        for a in range(ERRORS):
            for b in range(ERRORS):
                other = covariance[a, b]
                if STATE in (a, b):
                    other = widths[c] if a == b else 0.0
                off_a = (0.0 if a == STATE else mean[a]) - means[c, a]
                off_b = (0.0 if b == STATE else mean[b]) - means[c, b]
                covariances[c, a, b] = (
                    (1.0 - share) * covariances[c, a, b]
                    + share * other
                    + share * (1.0 - share) * off_a * off_b
                )
        for a in range(ERRORS):
            means[c, a] += share * ((0.0 if a == STATE else mean[a]) - means[c, a])


@_inner
def _below(value: float, mean: float, std: float) -> Any:
    return 0.5 * math.erfc((mean - value) / (std * 1.4142135623730951))


@_compile
def read_off(
    weights: FloatArray,
    states: FloatArray,
    stds: FloatArray,
    first: float,
    cell: float,
    wraps: bool,
    out: FloatArray,
) -> None:
    """Probabilities ``out`` (n,) of a lattice's cells under Gaussians of weights, states and stds (c,).

    What lies beyond the ends of a lattice that doesn't wrap is cut off from each Gaussian.
    """
    count = out.shape[0]
    for j in range(count):
        out[j] = 0.0
    lower, upper = first, first + cell * (count - 1)
    for c in range(weights.shape[0]):
        if weights[c] < 1e-9:
            continue
        std = max(stds[c], 1e-3 * cell)
        low = math.floor((states[c] - 6.0 * std - first) / cell + 0.5)
        high = math.floor((states[c] + 6.0 * std - first) / cell + 0.5)
        if wraps:
            if high - low >= count:
                low, high = 0, count - 1
            before = _below(first + cell * (low - 0.5), states[c], std)
            for j in range(low, high + 1):
                after = _below(first + cell * (j + 0.5), states[c], std)
                out[j % count] += weights[c] * (after - before)
                before = after
            continue
        inside = _below(upper, states[c], std) - _below(lower, states[c], std)
        if inside < 1e-9:
            out[0 if states[c] < lower else count - 1] += weights[c]
            continue
        low, high = max(low, 0), min(high, count - 1)
        before = _below(lower if low == 0 else first + cell * (low - 0.5), states[c], std)
        for j in range(low, high + 1):
            edge = upper if j == count - 1 else first + cell * (j + 0.5)
            after = _below(edge, states[c], std)
            out[j] += weights[c] * (after - before) / inside
            before = after
    total = 0.0
    for j in range(count):
        total += out[j]
    for j in range(count):
        out[j] /= total
