"""How well an object's states explain a scan, for many robot poses abreast, compiled.

Robot samples lie close together, so an object's outline covers about the same beams
from all of them. Poses therefore run along the last axis of every array here, and the
loops over them are short and without branches: the processor takes several poses at
a time. Beams, poses, placements and outlines are as in ``kernels``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import njit
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.sensing.kernels import (
    CENTRE_X,
    CENTRE_Y,
    COS,
    DIRECTION_X,
    DIRECTION_Y,
    GAUSSIAN,
    GRAZING,
    HIT,
    LEAST_DENSITY,
    MEASURED,
    MISSING,
    NEAR_SIGMAS,
    ORIGIN_X,
    ORIGIN_Y,
    PEAK,
    PER_SIGMA,
    RANDOM,
    RANGE_MAX,
    SHORT,
    SIN,
    SLACK,
    SMALL,
    SPREAD,
    X,
    Y,
    bell,
    first_at_or_after,
    pseudo_angle,
)

DECADES = 150.0  # by which a product may grow or shrink before its logarithm is taken

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_compile_finite = njit(nogil=True, error_model="numpy", fastmath={"contract", "nnan", "nsz"})


@_compile
def _hit(
    ax: FloatArray,
    ay: FloatArray,
    ex: FloatArray,
    ey: FloatArray,
    beam: FloatArray,
    slack: float,
    least: float,
    nearest: FloatArray,
) -> None:
    """Let one beam (7,) keep the nearer of what it has and a segment from a along e, from each pose."""
    dx, dy, ox, oy = beam[DIRECTION_X], beam[DIRECTION_Y], beam[ORIGIN_X], beam[ORIGIN_Y]
    for p in range(nearest.shape[0]):
        fx, fy = ax[p] - ox, ay[p] - oy
        turn = dx * ey[p] - dy * ex[p]
        squared = turn * turn
        along = (fx * dy - fy * dx) * turn
        distance = (fx * ey[p] - fy * ex[p]) / turn
        hits = (along >= -slack * squared) & (along <= (1.0 + slack) * squared) & (squared > least)
        closer = hits & (distance >= 0.0) & (distance < nearest[p])
        nearest[p] = distance if closer else nearest[p]


@_compile
def _hit_densities(
    expected: FloatArray, measured: float, model: FloatArray, out: FloatArray
) -> None:
    """The density of a hit of what is expected (p,), without the floor that all readings have."""
    peak, per_sigma = model[PEAK], model[PER_SIGMA]
    if model[GAUSSIAN] > 0.0:
        for p in range(out.shape[0]):
            off = (measured - min(expected[p], model[RANGE_MAX])) * per_sigma
            out[p] = peak * np.exp(-0.5 * off * off)
        return
    for p in range(out.shape[0]):
        off = (measured - expected[p]) * per_sigma
        out[p] = peak * bell(0.5 * off * off)


@_compile
def _densities(
    hit: FloatArray,
    expected: FloatArray,
    measured: float,
    floor: float,
    short: float,
    out: FloatArray,
) -> None:
    """Densities ``out`` (p,): of hits, of random readings, and of those that were stopped short."""
    for p in range(out.shape[0]):
        out[p] = hit[p] + floor + (short if measured < expected[p] else 0.0)


@_compile
def _multiply(
    dense: FloatArray,
    per_density: FloatArray,
    nearest: FloatArray,
    without: FloatArray,
    product: FloatArray,
) -> None:
    """Take one beam into the products (p,), where it touches the object."""
    for p in range(product.shape[0]):
        ratio = dense[p] * per_density[p]
        product[p] *= ratio if nearest[p] < without[p] else 1.0


@_compile
def _flush(product: FloatArray, change: FloatArray) -> None:
    """Move the products (p,) into their logarithms."""
    for p in range(product.shape[0]):
        change[p] += np.log(product[p])
        product[p] = 1.0


@_compile
def _per_shift(
    nx: FloatArray,
    ny: FloatArray,
    beam: FloatArray,
    nearest: FloatArray,
    without: FloatArray,
    out: FloatArray,
) -> None:
    """m by which a range grows for each m of a surface's shift along its normal; 0 if it doesn't tell."""
    dx, dy = beam[DIRECTION_X], beam[DIRECTION_Y]
    for p in range(out.shape[0]):
        cosine = dx * nx[p] + dy * ny[p]
        tells = (abs(cosine) > GRAZING) & (nearest[p] < without[p])
        grows = 1.0 / cosine
        out[p] = grows if tells else 0.0


@_compile
def _pull(
    hit: FloatArray,
    dense: FloatArray,
    per_shift: FloatArray,
    nearest: FloatArray,
    measured: float,
    gradient: FloatArray,
) -> None:
    """Add what one beam says of a shift, by its share of a hit, to the log-density's gradient (p,).

    ``hit`` (p,) becomes the derivative of the expected error.
    """
    for p in range(hit.shape[0]):
        hit[p] *= per_shift[p] / dense[p]
    for p in range(hit.shape[0]):
        off = measured - nearest[p]
        gradient[p] += hit[p] * off if per_shift[p] != 0.0 else 0.0


@_compile
def _hold(hit: FloatArray, per_shift: FloatArray, curvature: FloatArray) -> None:
    """The same for the curvature (p,)."""
    for p in range(hit.shape[0]):
        curvature[p] += hit[p] * per_shift[p]


@_compile
def _touches(nearest: FloatArray, without: FloatArray, most: float) -> Any:
    """Whether a beam touches the object from some pose, nearer than ``most`` m."""
    found = 0
    for p in range(nearest.shape[0]):
        found |= (nearest[p] < without[p]) & (nearest[p] < most)
    return found != 0


@_compile
def _floor(measured: float, model: FloatArray) -> Any:
    """The density that a reading has whatever is expected; that of a missing return is a probability."""
    if model[GAUSSIAN] > 0.0:
        return LEAST_DENSITY
    return model[MISSING] if measured == np.inf else model[RANDOM]


@_compile
def _look_behind(
    background: FloatArray,
    chosen: IntArray,
    beam: int,
    measured: float,
    short: float,
    model: FloatArray,
    without: FloatArray,
    per_density: FloatArray,
) -> None:
    """What a beam reads ``without`` (p,) the object, up to the range, and one over its density then."""
    for p in range(chosen.shape[0]):
        without[p] = background[chosen[p], beam]
    floor = _floor(measured, model)
    if measured == np.inf:
        for p in range(chosen.shape[0]):
            clear = model[HIT] if without[p] >= model[RANGE_MAX] else 0.0
            per_density[p] = 1.0 / (floor + clear)
    else:
        _hit_densities(without, measured, model, per_density)
        _densities(per_density, without, measured, floor, short, per_density)
        for p in range(chosen.shape[0]):
            per_density[p] = 1.0 / per_density[p]
    for p in range(chosen.shape[0]):
        without[p] = min(without[p], model[RANGE_MAX])


@_compile
def _middle(lasers: FloatArray, middle: FloatArray) -> Any:
    """The mean of lasers' poses (4, p), and how far positions stray from it, m."""
    for row in range(4):
        total = 0.0
        for p in range(lasers.shape[1]):
            total += lasers[row, p]
        middle[row] = total / lasers.shape[1]
    length = max(np.hypot(middle[COS], middle[SIN]), SMALL)
    middle[COS] /= length
    middle[SIN] /= length
    strayed = 0.0
    for p in range(lasers.shape[1]):
        off = (lasers[X, p] - middle[X]) ** 2 + (lasers[Y, p] - middle[Y]) ** 2
        strayed = max(strayed, off)
    return np.sqrt(strayed)


@_compile_finite
def _turns(x: FloatArray, y: FloatArray, to_x: float, to_y: float) -> Any:
    """Least and largest tangent of the turn from one direction to those of (x, y) (p,).

    Both are infinite where some are turned by 90 degrees or more.
    """
    least, largest, ahead = np.inf, -np.inf, np.inf
    for p in range(x.shape[0]):
        along, across = to_x * x[p] + to_y * y[p], to_x * y[p] - to_y * x[p]
        tangent = across / along
        least, largest, ahead = min(least, tangent), max(largest, tangent), min(ahead, along)
    return (least, largest) if ahead > 0.0 else (-np.inf, np.inf)


@_compile
def _bearing(x: float, y: float, tangent: float, about: float) -> Any:
    """The pseudo-angle of (x, y) turned on by a tangent, unwrapped to be near another."""
    found = pseudo_angle(x - tangent * y, y + tangent * x)
    if found - about > 2.0:
        return found - 4.0
    return found + 4.0 if found - about < -2.0 else found


@_compile
def _covered(
    segment: FloatArray,
    starts: Any,
    ends: Any,
    strayed: float,
    spread: float,
    beams: FloatArray,
    index: IntArray,
) -> Any:
    """The first beam that a segment (4,) may touch from any pose, and how many.

    It is seen from the poses' middle, from which they stray so far; ``starts`` and ``ends`` are how
    its ends' bearings turn from there to the poses. ``spread`` is how far beams' origins are apart.
    """
    count = beams.shape[1]
    ax, ay, bx, by = segment[0], segment[1], segment[2], segment[3]
    ex, ey = bx - ax, by - ay
    squared, along = ex * ex + ey * ey, 0.0
    if squared > 0.0:
        along = min(max(-(ax * ex + ay * ey) / squared, 0.0), 1.0)
    gap = np.sqrt((ax + along * ex) ** 2 + (ay + along * ey) ** 2) - strayed
    if gap <= spread + SLACK or starts[0] == -np.inf or ends[0] == -np.inf:
        return 0, count
    margin = SLACK + np.arcsin(spread / gap)  # pseudo-angles grow no faster than angles
    about = pseudo_angle(ax, ay)
    of_end = _bearing(bx, by, 0.0, about)
    low = min(_bearing(ax, ay, starts[0], about), _bearing(bx, by, ends[0], of_end)) - margin
    high = max(_bearing(ax, ay, starts[1], about), _bearing(bx, by, ends[1], of_end)) + margin
    if high - low >= 4.0:
        return 0, count
    if low < -2.0:
        low, high = low + 4.0, high + 4.0
    if low >= 2.0:
        low, high = low - 4.0, high - 4.0
    first = first_at_or_after(low, beams, index)
    if high > 2.0:
        return first, count - first + first_at_or_after(high - 4.0, beams, index)
    return first, first_at_or_after(high, beams, index) - first


@_compile
def _is_behind(ax: float, ay: float, bx: float, by: float, strayed: float) -> Any:
    """Whether all poses are on the inner side of a clockwise outline's segment: 1, on the outer: -1."""
    ex, ey = bx - ax, by - ay
    across, margin = ax * ey - ay * ex, strayed * np.sqrt(ex * ex + ey * ey)
    if across <= -margin:
        return 1
    return -1 if across > margin else 0


@_compile
def _at_once(short: FloatArray, model: FloatArray) -> Any:
    """How many beams' densities can be multiplied before their product leaves the floats."""
    highest = model[PEAK] + model[HIT] + model[RANDOM] + model[MISSING]
    for i in range(short.shape[0]):
        highest = max(highest, model[PEAK] + model[RANDOM] + short[i])
    lowest = max(min(_floor(0.0, model), _floor(np.inf, model)), SMALL)
    return max(1, int(DECADES / max(np.log10(highest / lowest), 1.0)))


@_compile
def _turned(lasers: FloatArray, normal: FloatArray, nx: FloatArray, ny: FloatArray) -> None:
    """A direction (2,) in the building, as seen from each laser's pose (4, p)."""
    for p in range(nx.shape[0]):
        nx[p] = lasers[COS, p] * normal[0] + lasers[SIN, p] * normal[1]
        ny[p] = lasers[COS, p] * normal[1] - lasers[SIN, p] * normal[0]


@_compile
def _lasers(poses: FloatArray, chosen: IntArray, sweep: FloatArray) -> Any:
    """Where the sweep's centre is (4, p) when the robot stands at the chosen poses."""
    lasers = np.empty((4, chosen.shape[0]))
    for p in range(chosen.shape[0]):
        cos, sin = poses[chosen[p], COS], poses[chosen[p], SIN]
        lasers[X, p] = poses[chosen[p], X] + cos * sweep[CENTRE_X] - sin * sweep[CENTRE_Y]
        lasers[Y, p] = poses[chosen[p], Y] + sin * sweep[CENTRE_X] + cos * sweep[CENTRE_Y]
        lasers[COS, p], lasers[SIN, p] = cos, sin
    return lasers


@_compile
def _seen_from(
    middle: FloatArray, place: FloatArray, outline: FloatArray, seen: FloatArray
) -> None:
    """The ends ``seen`` (k, 4) of an outline that stands at a place (4,), from a laser's pose (4,)."""
    dx, dy = place[X] - middle[X], place[Y] - middle[Y]
    x, y = middle[COS] * dx + middle[SIN] * dy, middle[COS] * dy - middle[SIN] * dx
    cos = place[COS] * middle[COS] + place[SIN] * middle[SIN]
    sin = place[SIN] * middle[COS] - place[COS] * middle[SIN]
    for j in range(outline.shape[0]):
        for end in range(0, 4, 2):
            seen[j, end] = x + cos * outline[j, end] - sin * outline[j, end + 1]
            seen[j, end + 1] = y + sin * outline[j, end] + cos * outline[j, end + 1]


@_compile
def _project(
    lasers: FloatArray,
    middle: FloatArray,
    strayed: float,
    place: FloatArray,
    outline: FloatArray,
    convex: bool,
    beams: FloatArray,
    index: IntArray,
    spread: float,
    nearest: FloatArray,
    is_touched: BoolArray,
) -> None:
    """Let each beam keep the nearer of ``nearest`` (n, p) and an outline (k, 4) at a place (4,).

    ``is_touched`` (n,) is set for the beams that may meet the outline from some of the lasers'
    poses (4, p), which stray so far from their middle (4,).
    """
    size, count = lasers.shape[1], beams.shape[1]
    x, y, cos, sin = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    ax, ay, bx, by = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    ex, ey = np.empty(size), np.empty(size)
    for p in range(size):
        dx, dy = place[X] - lasers[X, p], place[Y] - lasers[Y, p]
        x[p] = lasers[COS, p] * dx + lasers[SIN, p] * dy
        y[p] = lasers[COS, p] * dy - lasers[SIN, p] * dx
    for p in range(size):
        cos[p] = place[COS] * lasers[COS, p] + place[SIN] * lasers[SIN, p]
        sin[p] = place[SIN] * lasers[COS, p] - place[COS] * lasers[SIN, p]
    seen = np.empty((outline.shape[0], 4))
    _seen_from(middle, place, outline, seen)
    sides = np.zeros(outline.shape[0], dtype=np.int64)
    if convex:
        for j in range(outline.shape[0]):
            sides[j] = _is_behind(seen[j, 0], seen[j, 1], seen[j, 2], seen[j, 3], strayed + spread)
    is_outside = False
    for j in range(outline.shape[0]):
        is_outside |= sides[j] < 0
    for j in range(outline.shape[0]):
        if is_outside and sides[j] > 0:  # from outside, only the near sides are seen
            continue
        along_x, along_y = outline[j, 2] - outline[j, 0], outline[j, 3] - outline[j, 1]
        for p in range(size):
            ax[p] = x[p] + cos[p] * outline[j, 0] - sin[p] * outline[j, 1]
            ay[p] = y[p] + sin[p] * outline[j, 0] + cos[p] * outline[j, 1]
        for p in range(size):
            ex[p] = cos[p] * along_x - sin[p] * along_y
            ey[p] = sin[p] * along_x + cos[p] * along_y
        for p in range(size):
            bx[p], by[p] = ax[p] + ex[p], ay[p] + ey[p]
        first, touched = _covered(
            seen[j],
            _turns(ax, ay, seen[j, 0], seen[j, 1]),
            _turns(bx, by, seen[j, 2], seen[j, 3]),
            strayed,
            spread,
            beams,
            index,
        )
        length = abs(along_x) + abs(along_y)
        slack, least = SLACK / length, (SLACK * length) ** 2
        for step in range(touched):
            i = first + step
            i -= count if i >= count else 0
            _hit(ax, ay, ex, ey, beams[:, i], slack, least, nearest[i])
            is_touched[i] = True


@_compile
def cast(
    poses: FloatArray,
    place: FloatArray,
    outline: FloatArray,
    convex: bool,
    beams: FloatArray,
    index: IntArray,
    sweep: FloatArray,
    order: IntArray,
    out: FloatArray,
) -> None:
    """Ranges ``out`` (p, n) from poses (p, 4) close together to an outline (k, 4) at a place (4,).

    ``out`` is in the scan's own order, of which sorted beam i is ``order[i]``.
    """
    everyone = np.empty(poses.shape[0], dtype=np.int64)
    for p in range(poses.shape[0]):
        everyone[p] = p
    lasers = _lasers(poses, everyone, sweep)
    middle, count = np.empty(4), beams.shape[1]
    strayed = _middle(lasers, middle)
    nearest = np.empty((count, poses.shape[0]))
    nearest.fill(np.inf)
    is_touched = np.zeros(count, dtype=np.bool_)
    _project(
        lasers,
        middle,
        strayed,
        place,
        outline,
        convex,
        beams,
        index,
        sweep[SPREAD],
        nearest,
        is_touched,
    )
    for i in range(count):
        for p in range(poses.shape[0]):
            out[p, order[i]] = nearest[i, p]


@_compile
def object_log_likelihood(
    chosen: IntArray,
    states: IntArray,
    poses: FloatArray,
    placements: FloatArray,
    normals: FloatArray,
    outline: FloatArray,
    convex: bool,
    background: FloatArray,
    order: IntArray,
    beams: FloatArray,
    index: IntArray,
    sweep: FloatArray,
    model: FloatArray,
    shift_std: float,
    tempering: float,
    out: FloatArray,
    bears: BoolArray,
) -> None:
    """Change in log p(o | s, l) that an object makes, over the background alone: ``out`` (s, p).

    Its ``states`` (s,) are rows of ``placements`` and ``normals``, its poses ``chosen`` (p,) rows of
    ``poses`` and ``background``: what the beams (p, n) read without the object, in the scan's own
    order, of which sorted beam i is ``order[i]``. Beams that the object doesn't touch contribute
    the same to every state (section 3 of Schulz and Burgard 2001) and are left out. ``bears`` (n,)
    is set where a beam touches the object in some state and isn't stopped before reaching it.

    The likelihood has the exponent ``tempering``. The object may stand ``shift_std`` m
    aside of its placement, along the unit normal ``normals[s]`` of its long side: an
    error that all its beams share. A range grows with the shift by 1 over the cosine
    of its incidence, so the readings speak of the shift as a Gaussian, and the average
    has a closed form.
    """
    size, count = chosen.shape[0], beams.shape[1]
    lasers, middle = _lasers(poses, chosen, sweep), np.empty(4)
    strayed = _middle(lasers, middle)
    nearest = np.empty((count, size))
    nearest.fill(np.inf)
    without, per_density = np.empty((count, size)), np.empty((count, size))
    is_known, is_touched = np.zeros(count, dtype=np.bool_), np.zeros(count, dtype=np.bool_)
    nx, ny, per_shift = np.empty(size), np.empty(size), np.empty(size)
    hit, dense, product, change = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    gradient, curvature = np.empty(size), np.empty(size)
    near, variance = NEAR_SIGMAS / model[PER_SIGMA], shift_std * shift_std
    at_once = _at_once(beams[SHORT], model)
    for k in range(states.shape[0]):
        _project(
            lasers,
            middle,
            strayed,
            placements[states[k]],
            outline,
            convex,
            beams,
            index,
            sweep[SPREAD],
            nearest,
            is_touched,
        )
        _turned(lasers, normals[states[k]], nx, ny)
        product.fill(1.0)
        change.fill(0.0)
        gradient.fill(0.0)
        curvature.fill(0.0)
        taken = 0
        for i in range(count):
            if not is_touched[i]:
                continue
            is_touched[i] = False
            measured, short = beams[MEASURED, i], beams[SHORT, i]
            if model[GAUSSIAN] > 0.0:
                measured = min(measured, model[RANGE_MAX])
            if not is_known[i]:
                _look_behind(
                    background,
                    chosen,
                    order[i],
                    measured,
                    short,
                    model,
                    without[i],
                    per_density[i],
                )
                is_known[i] = True
            if not _touches(nearest[i], without[i], np.inf):
                nearest[i].fill(np.inf)
                continue
            if not bears[i]:
                bears[i] = _touches(nearest[i], without[i], beams[MEASURED, i] + near)
            _hit_densities(nearest[i], measured, model, hit)
            _densities(hit, nearest[i], measured, _floor(measured, model), short, dense)
            _multiply(dense, per_density[i], nearest[i], without[i], product)
            taken += 1
            if taken % at_once == 0:
                _flush(product, change)
            if variance > 0.0 and beams[MEASURED, i] < np.inf:
                _per_shift(nx, ny, beams[:, i], nearest[i], without[i], per_shift)
                _pull(hit, dense, per_shift, nearest[i], measured, gradient)
                _hold(hit, per_shift, curvature)
            nearest[i].fill(np.inf)
        _flush(product, change)
        precision = tempering * model[PER_SIGMA] * model[PER_SIGMA]
        for p in range(size):
            surely = 1.0 + precision * curvature[p] * variance
            pulled = precision * gradient[p]
            out[k, p] = tempering * change[p] + 0.5 * (
                pulled * pulled * variance / surely - np.log(surely)
            )
