"""The loops of furniture's filter over robot samples and free samples of x, y, yaw, compiled.

Beliefs of robot samples are rows: ``given`` (l, n) holds p(s | l) over n samples, of which the
last are scouts.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from objstate.compiling import inner, njit
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.particles.kernels import keeping

TINY = 1e-300
TURN = 2.0 * np.pi
KERNEL = 0.31  # of the deviation of a place's samples, by which copies of a sample are spread

FINELY = 0.25  # of the deviations by which scouts stray, for every other one
ROOT_TAU = np.sqrt(2.0 * np.pi)

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_compile_nearest = njit(
    nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nnan", "nsz"}
)
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def _wrapped(angle: float) -> Any:
    """An angle in [-pi, pi)."""
    return (angle + np.pi) % TURN - np.pi


class Moves(NamedTuple):
    """Where furniture may be moved to: near where it stood, or as the prior says."""

    home: FloatArray  # (3,) the middle of the prior
    width: FloatArray  # (3,) its deviations; half its widths, where it is uniform
    is_gaussian: bool
    nudge: FloatArray  # (3,) deviations of what is near
    order: int  # of the symmetry
    centre: FloatArray  # (2,)


# --- where samples are --------------------------------------------------------------


@_inner
def _turned(state: FloatArray, yaw: float, order: int, centre: FloatArray) -> Any:
    """Of the states that look like one (3,), the one whose yaw is nearest to another; by ``Symmetry``."""
    if order == 1:
        return state[0], state[1], state[2]
    part = TURN / order
    turn = -part * np.round(_wrapped(state[2] - yaw) / part)
    c, s, to_c, to_s = (
        np.cos(state[2]),
        np.sin(state[2]),
        np.cos(state[2] + turn),
        np.sin(state[2] + turn),
    )
    x = state[0] + (c - to_c) * centre[0] - (s - to_s) * centre[1]
    y = state[1] + (s - to_s) * centre[0] + (c - to_c) * centre[1]
    return x, y, _wrapped(state[2] + turn)


@_compile
def moments(
    states: FloatArray,
    weights: FloatArray,
    home: float,
    order: int,
    centre: FloatArray,
    mean: FloatArray,
    std: FloatArray,
) -> None:
    """Mean (3,) and standard deviations (3,) of states (n, 3), of which those that look alike count as one.

    Their weights may have any sum. The yaw is a circular mean; of those that look alike, the nearest
    to ``home`` rad.
    """
    total, east, north = 0.0, 0.0, 0.0
    for j in range(weights.shape[0]):
        turned = order * (states[j, 2] - home)
        total += weights[j]
        east += weights[j] * np.cos(turned)
        north += weights[j] * np.sin(turned)
    mean[0], mean[1] = 0.0, 0.0
    mean[2] = _wrapped(home + np.arctan2(north, east) / order)
    for j in range(weights.shape[0]):
        x, y, _ = _turned(states[j], mean[2], order, centre)
        mean[0] += weights[j] * x / total
        mean[1] += weights[j] * y / total
    std.fill(0.0)
    for j in range(weights.shape[0]):
        x, y, yaw = _turned(states[j], mean[2], order, centre)
        std[0] += weights[j] * (x - mean[0]) ** 2 / total
        std[1] += weights[j] * (y - mean[1]) ** 2 / total
        std[2] += weights[j] * _wrapped(yaw - mean[2]) ** 2 / total
    for axis in range(3):
        std[axis] = np.sqrt(std[axis])


@_compile
def offsets(
    states: FloatArray, place: FloatArray, order: int, centre: FloatArray, out: FloatArray
) -> None:
    """From a place (3,) to states (n, 3), or to those that look the same and are nearest: ``out`` (n, 3)."""
    for j in range(states.shape[0]):
        x, y, yaw = _turned(states[j], place[2], order, centre)
        out[j, 0], out[j, 1] = x - place[0], y - place[1]
        out[j, 2] = _wrapped(yaw - place[2])


@_compile_nearest
def lie_on(
    states: FloatArray, points: FloatArray, ends: FloatArray, within: float, out: BoolArray
) -> None:
    """Which ends of beams (m, 2) lie ``within`` m of an outline's points (q, 2): ``out`` (s, m).

    The outline stands in states (s, 3).
    """
    for k in range(states.shape[0]):
        cos, sin = np.cos(states[k, 2]), np.sin(states[k, 2])
        for i in range(ends.shape[0]):
            dx, dy = ends[i, 0] - states[k, 0], ends[i, 1] - states[k, 1]
            x, y, least = cos * dx + sin * dy, cos * dy - sin * dx, np.inf
            for q in range(points.shape[1]):
                least = min(least, (points[0, q] - x) ** 2 + (points[1, q] - y) ** 2)
            out[k, i] = least <= within * within


# --- Bayes' rule --------------------------------------------------------------------


@_inner
def _raise(log_likelihood: FloatArray, exponent: float, top: FloatArray, out: FloatArray) -> None:
    """Likelihoods (l, n) to an exponent, into ``out`` (l, n), of which each row's largest is one.

    The logarithms of what they really are go into ``top`` (l,).
    """
    for p in range(out.shape[0]):
        top[p] = -np.inf
        for j in range(out.shape[1]):
            top[p] = max(top[p], exponent * log_likelihood[p, j])
        for j in range(out.shape[1]):
            out[p, j] = np.exp(exponent * log_likelihood[p, j] - top[p])


@_inner
def _told(
    given: FloatArray, likelihood: FloatArray, top: FloatArray, robot: FloatArray, told: FloatArray
) -> None:
    """Log-likelihood ``told`` (n,) of each state from all robot samples (l,) together."""
    before, highest = np.zeros(told.shape[0]), -np.inf
    told.fill(0.0)
    for p in range(given.shape[0]):
        highest = max(highest, top[p])
    for p in range(given.shape[0]):
        scale = np.exp(top[p] - highest)
        for j in range(given.shape[1]):
            before[j] += robot[p] * given[p, j]
            told[j] += robot[p] * given[p, j] * likelihood[p, j] * scale
    for j in range(told.shape[0]):
        told[j] = highest + np.log((told[j] + TINY) / (before[j] + TINY))


@_compile
def take_in(
    given: FloatArray,
    values: FloatArray,
    scouts: int,
    log_likelihood: FloatArray,
    robot: FloatArray,
    ahead: float,
    most: float,
    enough: float,
    out: FloatArray,
    log_evidence: FloatArray,
) -> Any:
    """Bayes' rule in every row of ``given`` (l, n), into ``out`` (l, n), with the log evidence (l,).

    The likelihood has the largest exponent, up to ``most``, that leaves a share of ``enough`` of the
    samples effective; it is returned. Samples that a look ahead has chosen owe a part of it, ``ahead``.
    By ``values`` (n,), what scouts win or lose is the same in all rows, by what all robot samples (l,)
    together say: in the row of one that misses the object, anything would win.
    """
    size, count = given.shape[1], given.shape[1] - scouts
    top, told, log, won = np.empty(given.shape[0]), np.empty(size), np.empty(size), np.empty(size)
    _raise(log_likelihood, 1.0, top, out)
    _told(given, out, top, robot, told)
    squared, highest, of_samples, of_all = 0.0, -np.inf, TINY, TINY
    for j in range(size):
        log[j] = np.log(values[j])
        squared += values[j] * values[j]
        highest = max(highest, told[j])
    step = keeping(log, told, most - ahead, enough / squared)
    exponent = most if step == most - ahead else ahead + step
    for j in range(size):
        won[j] = values[j] * np.exp(step * (told[j] - highest))
        of_samples += won[j] if j < count else 0.0
        of_all += won[j]
    if exponent != 1.0:
        _raise(log_likelihood, exponent, top, out)
    for p in range(given.shape[0]):
        total = 0.0
        for j in range(count):
            out[p, j] *= given[p, j]
            total += out[p, j]
        log_evidence[p] = top[p] + np.log(max(total, TINY) * of_all / of_samples)
        if total < TINY:  # this row can't have read it: its pose is wrong, not its states
            for j in range(count):
                out[p, j] = given[p, j]
                total += given[p, j]
        for j in range(count):
            out[p, j] *= of_samples / (of_all * total)
        for j in range(count, size):
            out[p, j] = won[j] / of_all
    return exponent


# --- scouts -------------------------------------------------------------------------


@_inner
def _density(state: FloatArray, place: FloatArray, moves: Moves) -> Any:
    """The density of being moved to a state (3,) from a place (3,)."""
    home_x, home_y, home_yaw = _turned(state, moves.home[2], moves.order, moves.centre)
    x, y, yaw = _turned(state, place[2], moves.order, moves.centre)
    home_yaw, yaw = _wrapped(home_yaw - moves.home[2]), _wrapped(yaw - place[2])
    by_prior = _bell(home_x - moves.home[0], home_y - moves.home[1], home_yaw, moves.width)
    if not moves.is_gaussian:
        width = moves.width
        inside = abs(home_x - moves.home[0]) <= width[0] and abs(home_y - moves.home[1]) <= width[1]
        inside = inside and abs(home_yaw) <= width[2]
        by_prior = 0.125 / (width[0] * width[1] * width[2]) if inside else 0.0
    return 0.5 * (by_prior + _bell(x - place[0], y - place[1], yaw, moves.nudge))


@_inner
def _bell(x: float, y: float, yaw: float, std: FloatArray) -> Any:
    """The density of an offset under independent Gaussians with deviations (3,)."""
    squared = (x / std[0]) ** 2 + (y / std[1]) ** 2 + (yaw / std[2]) ** 2
    return np.exp(-0.5 * squared) / (ROOT_TAU**3 * std[0] * std[1] * std[2])


@_compile
def densities(states: FloatArray, place: FloatArray, moves: Moves, out: FloatArray) -> None:
    """The densities ``out`` (n,) of being moved to states (n, 3) from a place (3,)."""
    for j in range(states.shape[0]):
        out[j] = _density(states[j], place, moves)


@_compile
def pool(
    states: FloatArray,
    values: FloatArray,
    count: int,
    place: FloatArray,
    near: FloatArray,
    moves: Moves,
    followed: float,
    out: FloatArray,
) -> Any:
    """Weights ``out`` (n,) of the ``count`` samples and of the scouts that are among them.

    Scouts that aren't ``near`` (3,) a place (3,) are elsewhere and have none, unless together they
    have won more than ``followed``: the object may have been moved there. Returned are what they have
    won, the effective number of all others, and the scouts' share of these.
    """
    elsewhere, of_scouts, total, squared = 0.0, 0.0, 0.0, 0.0
    for j in range(values.shape[0]):
        out[j] = values[j]
        if j >= count:
            x, y, yaw = _turned(states[j], place[2], moves.order, moves.centre)
            is_near = abs(x - place[0]) <= near[0] and abs(y - place[1]) <= near[1]
            if not (is_near and abs(_wrapped(yaw - place[2])) <= near[2]):
                out[j] = 0.0
                elsewhere += values[j]
    if elsewhere > followed:
        elsewhere = 0.0
        for j in range(count, values.shape[0]):
            out[j] = values[j]
    for j in range(values.shape[0]):
        total += out[j]
        squared += out[j] * out[j]
        of_scouts += out[j] if j >= count else 0.0
    return elsewhere, total * total / squared, of_scouts / total


@_compile
def send_out(
    best: FloatArray,
    near: FloatArray,
    place: FloatArray,
    moves: Moves,
    blur: FloatArray,
    noise: FloatArray,
    unit: FloatArray,
    drawn: FloatArray,
    out: FloatArray,
) -> None:
    """Scouts ``out`` (k, 3): some carry on about the ``best`` (b, 3), others start afresh.

    Of those, some look near the samples ``near`` (m, 3), and the rest where the prior says; in this order.
    Drawn are ``noise`` (b + m, 3) of a Gaussian, ``unit`` (k - b - m, 3) of the prior, and ``drawn`` (b,)
    from 0 to 1. Every other scout looks closer by than the one before it.
    """
    carried, led = best.shape[0], best.shape[0] + near.shape[0]
    for k in range(out.shape[0]):
        finely = 1.0 if k % 2 == 0 else FINELY
        if k < carried:
            for axis in range(3):
                out[k, axis] = best[k, axis] + finely * blur[axis] * noise[k, axis]
            # Metropolis: evidence alone leads them on
            if _density(out[k], place, moves) < drawn[k] * _density(best[k], place, moves):
                for axis in range(3):
                    out[k, axis] = best[k, axis]
        elif k < led:
            for axis in range(3):
                out[k, axis] = near[k - carried, axis] + finely * moves.nudge[axis] * noise[k, axis]
        else:
            for axis in range(3):
                out[k, axis] = moves.home[axis] + moves.width[axis] * unit[k - led, axis]
        out[k, 2] = _wrapped(out[k, 2])


# --- resampling ---------------------------------------------------------------------


@_compile
def inherit(
    given: FloatArray,
    values: FloatArray,
    ancestors: IntArray,
    weights: FloatArray,
    out: FloatArray,
) -> None:
    """The rows ``out`` (l, m) of samples whose ``ancestors`` (a,) had the rows ``given`` (l, n).

    A sample weighs ``weights`` (m,), where its ancestor weighed ``values`` (n,); in each row as much more
    as that did. Scouts, behind the samples, weigh the same in all rows.
    """
    for p in range(given.shape[0]):
        total = 0.0
        for k in range(weights.shape[0]):
            weight = weights[k]
            if k < ancestors.shape[0]:
                weight *= given[p, ancestors[k]] / max(values[ancestors[k]], TINY)
            out[p, k] = weight
            total += weight
        for k in range(weights.shape[0]):
            out[p, k] /= total


@_inner
def _gather(off: FloatArray, cell: FloatArray, cells: IntArray, number: IntArray) -> Any:
    """How many ``cells`` (n, 3) of a size (3,) samples (n, 3) lie in, and which, by ``number`` (n,)."""
    count = 0
    for j in range(off.shape[0]):
        for axis in range(3):
            cells[count, axis] = int(np.round(off[j, axis] / cell[axis]))
        k = 0
        while (
            cells[k, 0] != cells[count, 0]
            or cells[k, 1] != cells[count, 1]
            or cells[k, 2] != cells[count, 2]
        ):
            k += 1
        number[j] = k
        count += k == count
    return count


@_compile
def occupied(off: FloatArray, weights: FloatArray, cell: FloatArray) -> Any:
    """Number of cells that samples (n, 3) of x, y, yaw about their mean fill, were all filled evenly."""
    size = off.shape[0]
    cells, number = np.empty((size + 1, 3), dtype=np.int64), np.empty(size, dtype=np.int64)
    count, total, entropy = _gather(off, cell, cells, number), 0.0, 0.0
    shares = np.zeros(count)
    for j in range(size):
        shares[number[j]] += weights[j]
        total += weights[j]
    for k in range(count):
        if shares[k] > 0.0:
            entropy -= shares[k] / total * np.log(shares[k] / total)
    return int(np.round(np.exp(entropy)))


@_inner
def _places(cells: IntArray, place: IntArray) -> Any:
    """How many places ``cells`` (c, 3) make, as those that touch are one, and which, by ``place`` (c,)."""
    count, found = place.shape[0], 0
    queue = np.empty(count, dtype=np.int64)
    place.fill(-1)
    for first in range(count):
        if place[first] >= 0:
            continue
        place[first], queue[0], reached, done = found, first, 1, 0
        while done < reached:
            c = queue[done]
            for k in range(count):
                apart = 0
                for axis in range(3):
                    apart = max(apart, abs(cells[k, axis] - cells[c, axis]))
                if place[k] < 0 and apart <= 1:
                    place[k], queue[reached] = found, k
                    reached += 1
            done += 1
        found += 1
    return found


@_inner
def _lower_root(covariance: FloatArray) -> None:
    """Make a covariance (3, 3) its lower Cholesky factor."""
    for i in range(3):
        for j in range(i + 1):
            rest = covariance[i, j]
            for k in range(j):
                rest -= covariance[i, k] * covariance[j, k]
            covariance[i, j] = np.sqrt(rest) if i == j else rest / covariance[j, j]


@_inner
def _distinct(ancestors: IntArray, chosen: IntArray, own: IntArray) -> Any:
    """How many of ascending ``ancestors`` (c,) differ, which, and whose copy each is of ``chosen`` (c,)."""
    count = 0
    for k in range(ancestors.shape[0]):
        if k == 0 or ancestors[k] != ancestors[k - 1]:
            chosen[count] = ancestors[k]
            count += 1
        own[k] = count - 1
    return count


@_inner
def _moments(
    off: FloatArray,
    weights: FloatArray,
    members: BoolArray,
    mean: FloatArray,
    covariance: FloatArray,
) -> Any:
    """Mean (3,) and covariance (3, 3) of those samples (n, 3) that are ``members`` (n,).

    Also one over their effective number.
    """
    total, alone = 0.0, 0.0
    mean.fill(0.0)
    covariance.fill(0.0)
    for j in range(members.shape[0]):
        if members[j]:
            total += weights[j]
            for axis in range(3):
                mean[axis] += weights[j] * off[j, axis]
    for axis in range(3):
        mean[axis] /= total
    for j in range(members.shape[0]):
        if members[j]:
            share = weights[j] / total
            alone += share * share
            for i in range(3):
                for axis in range(3):
                    aside = (off[j, i] - mean[i]) * (off[j, axis] - mean[axis])
                    covariance[i, axis] += share * aside
    return alone


@_inner
def _recentre(off: FloatArray, weights: FloatArray, out: FloatArray) -> None:
    """Give ``out`` (c, 3) the mean of samples (n, 3)."""
    for axis in range(3):
        total, before, after = 0.0, 0.0, 0.0
        for j in range(off.shape[0]):
            total += weights[j]
            before += weights[j] * off[j, axis]
        for k in range(out.shape[0]):
            after += out[k, axis]
        for k in range(out.shape[0]):
            out[k, axis] += before / total - after / out.shape[0]


@_compile
def copies(
    off: FloatArray,
    weights: FloatArray,
    ancestors: IntArray,
    cell: FloatArray,
    widest: FloatArray,
    noise: FloatArray,
    out: FloatArray,
) -> None:
    """Copies ``out`` (c, 3) of some of the samples (n, 3), spread by a kernel with ``noise`` (c, 3).

    ``ancestors`` (c,) ascend. The kernel keeps the mean and the variances of each place (Liu and West
    2001), and is no wider than the deviations ``widest`` (3,). ``cell`` (3,) is the size of cells
    that are one place where they touch.
    """
    size = ancestors.shape[0]
    chosen, own = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
    count = _distinct(ancestors, chosen, own)
    near, share = np.empty((count, 3)), np.empty(count)
    for j in range(count):
        share[j] = weights[chosen[j]]
        for axis in range(3):
            near[j, axis] = off[chosen[j], axis]
    cells, number = np.empty((count + 1, 3), dtype=np.int64), np.empty(count, dtype=np.int64)
    place = np.empty(_gather(near, cell, cells, number), dtype=np.int64)
    found, members = _places(cells, place), np.empty(count, dtype=np.bool_)
    mean, width, root = np.empty(3), np.empty(3), np.empty((3, 3))
    for each in range(found):
        for j in range(count):
            members[j] = place[number[j]] == each
        alone = _moments(near, share, members, mean, root)
        for axis in range(3):
            root[axis, axis] += (alone * widest[axis] / KERNEL) ** 2
            width[axis] = min(KERNEL, widest[axis] / np.sqrt(root[axis, axis]))
        _lower_root(root)
        for k in range(size):
            if members[own[k]]:
                for axis in range(3):
                    moved = 0.0
                    for i in range(axis + 1):
                        moved += root[axis, i] * noise[k, i]
                    kept = np.sqrt(1.0 - width[axis] ** 2) * (near[own[k], axis] - mean[axis])
                    out[k, axis] = mean[axis] + kept + width[axis] * moved
    if found == 1:  # or the mean would wander by chance, each time that samples are copied
        _recentre(off, weights, out)
