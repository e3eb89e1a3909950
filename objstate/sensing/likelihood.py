"""The likelihood of a scan for many robot poses side by side, compiled.

As in ``projection``, poses run along the last axis of every array here, and the loops over them
hold one statement each, so that the processor handles several poses at a time. Beams, poses,
placements and outlines are as in ``sweeps``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.sensing.circles import SPREAD_SIGMAS, comes_within, crossing, seen_from
from objstate.sensing.projection import SPARE, project, stands, untouched
from objstate.sensing.runs import (
    densities_of,
    fared,
    half_precision,
    hit,
    hit_density,
    look_past,
    step,
)
from objstate.sensing.sweeps import (
    CENTRE_X,
    CENTRE_Y,
    COS,
    DECADES,
    DIRECTION_X,
    DIRECTION_Y,
    GAUSSIAN,
    GRAZING,
    HIT,
    LARGE,
    MEASURED,
    ORIGIN_X,
    ORIGIN_Y,
    PEAK,
    PER_SIGMA,
    RANGE_MAX,
    SHORT,
    SIN,
    SMALL,
    SPREAD,
    UNEXPECTED,
    Beams,
    Scenery,
    X,
    Y,
    at_once,
    floor_of,
    taken,
)

SCALE, LOG_SCALE = 10.0**DECADES, DECADES * np.log(10.0)
# a range that is shorter than expected by more sigmas was stopped by something else
NEAR_SIGMAS = 4.0
LEAST_SHARE = 1e-12  # largest rounding error when all shares are subtracted from one

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_maker = inner(makes_arrays=True, nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def _read(measured: float, model: FloatArray) -> Any:
    """The reading of a beam; for the pure Gaussian, a missing return is the largest range."""
    return min(measured, model[RANGE_MAX]) if model[GAUSSIAN] > 0.0 else measured


@_inner
def _look(
    expected: FloatArray,
    measured: float,
    short: float,
    model: FloatArray,
    out: FloatArray,
) -> None:
    """The density ``out`` (p,) of one beam's reading, given the expected ranges (p,)."""
    floor = floor_of(measured, model)
    if measured == np.inf:
        for p in range(out.shape[0]):
            out[p] = floor + (model[HIT] if expected[p] >= model[RANGE_MAX] else 0.0)
        return
    peak, half, range_max = model[PEAK], half_precision(model), model[RANGE_MAX]
    is_gaussian = model[GAUSSIAN] > 0.0
    for p in range(out.shape[0]):
        reads = min(expected[p], range_max) if is_gaussian else expected[p]
        hit = hit_density(measured - reads, half, peak, is_gaussian)
        out[p] = hit + floor + (short if measured < expected[p] else 0.0)


@_inner
def _flush(product: FloatArray, change: FloatArray) -> None:
    """Move the products (p,) into their logarithms."""
    for p in range(product.shape[0]):
        change[p] += np.log(product[p])
        product[p] = 1.0


@_inner
def _rescale(free: FloatArray, stopped: FloatArray, change: FloatArray) -> None:
    """Rescale two products (p,) and add the factor to the logarithm of their sum."""
    for p in range(free.shape[0]):
        both = free[p] + stopped[p]
        steps = 1.0 if both > SCALE else (-1.0 if both < 1.0 / SCALE else 0.0)
        scale = 1.0 / SCALE if steps > 0.0 else (SCALE if steps < 0.0 else 1.0)
        change[p] += steps * LOG_SCALE
        free[p] *= scale
        stopped[p] *= scale


@_inner
def _per_shift(
    normals: FloatArray, state: int, middle: FloatArray, beams: FloatArray, i: int
) -> Any:
    """m by which a range grows for each m of a surface's shift along its normal.

    From the middle (4,) of the lasers' poses; 0 where beam ``i`` has no information.
    """
    nx = middle[COS] * normals[state, 0] + middle[SIN] * normals[state, 1]
    ny = middle[COS] * normals[state, 1] - middle[SIN] * normals[state, 0]
    cosine = beams[DIRECTION_X, i] * nx + beams[DIRECTION_Y, i] * ny
    tells = abs(cosine) > GRAZING and beams[MEASURED, i] < np.inf
    return 1.0 / cosine if tells else 0.0


@_inner
def _touches(nearest: FloatArray, without: FloatArray, most: float) -> Any:
    """Whether a beam touches the object at ``nearest`` (p,), below ``most`` m, from some pose."""
    found = 0
    for p in range(nearest.shape[0]):
        found |= (nearest[p] < without[p]) & (nearest[p] < most)
    return found != 0


@_inner
def _span(
    is_touched: BoolArray,
    nearest: FloatArray,
    without: FloatArray,
    order: IntArray,
    beams: FloatArray,
    model: FloatArray,
    bears: BoolArray,
) -> Any:
    """The first of the scan's beams that the object touches, and one past the last; resets both.

    For touched beams of the sorted scan, ``nearest`` (n, p) becomes infinite again. ``bears`` (n,)
    is set where an object isn't farther than the reading.
    """
    first, past, near = order.shape[0], 0, NEAR_SIGMAS / model[PER_SIGMA]
    for i in range(order.shape[0]):
        if not is_touched[i]:
            continue
        is_touched[i] = False
        j = order[i]
        if not _touches(nearest[i], without[j], np.inf):
            for p in range(nearest.shape[1]):
                nearest[i, p] = np.inf
            continue
        first, past = min(first, j), max(past, j + 1)
        if not bears[j]:
            most = min(beams[MEASURED, i] + near, model[RANGE_MAX])
            bears[j] = _touches(nearest[i], without[j], most)
    return first, past


@_inner
def _pass(
    nearest: FloatArray,
    without: FloatArray,
    per_density: FloatArray,
    beam: Any,
    per_shift: float,
    model: FloatArray,
    free: FloatArray,
    stopped: FloatArray,
    gradient: FloatArray,
    curvature: FloatArray,
) -> None:
    """``runs.step`` for a beam that may meet an object at ``nearest`` (p,), which is reset to inf.

    ``free`` and ``stopped`` (p,) are relative to the density that the previous readings give
    ``without`` (p,) the object; ``per_density`` (p,) is one over that density. The derivatives with
    respect to a shift of the object are added to ``gradient`` and ``curvature`` (p,), in sigmas.
    """
    rows, sums = (nearest, without, per_density), (gradient, curvature)
    if model[GAUSSIAN] > 0.0:  # a loop of its own: the other one handles several poses at a time
        _pass_each(*rows, beam, True, per_shift, free, stopped, *sums)
    else:
        _pass_each(*rows, beam, False, per_shift, free, stopped, *sums)


@_inner
def _pass_each(
    nearest: FloatArray,
    without: FloatArray,
    per_density: FloatArray,
    beam: Any,
    is_gaussian: bool,
    per_shift: float,
    free: FloatArray,
    stopped: FloatArray,
    gradient: FloatArray,
    curvature: FloatArray,
) -> None:
    """``_pass``, pose by pose."""
    for p in range(free.shape[0]):
        touches = nearest[p] < without[p]
        expected = nearest[p] if touches else without[p]
        hits = hit(expected, beam, is_gaussian)
        now_free, now_stopped, hits = fared(free[p], stopped[p], hits, expected, beam)
        tells = touches & (per_shift != 0.0)
        pulled = per_shift * hits / (now_free + now_stopped) if tells else 0.0
        gradient[p] += pulled * (beam[0] - expected) if tells else 0.0
        curvature[p] += pulled * per_shift
        free[p], stopped[p] = now_free * per_density[p], now_stopped * per_density[p]
        nearest[p] = np.inf


@_inner
def _end(
    free: FloatArray,
    stopped: FloatArray,
    later_free: FloatArray,
    later_stopped: FloatArray,
    change: FloatArray,
) -> None:
    """Multiply by the likelihood of the readings behind (p,); ``free`` is overwritten."""
    for p in range(free.shape[0]):
        free[p] = free[p] * later_free[p] + stopped[p] * later_stopped[p]
        change[p] += np.log(free[p])


@_inner
def _average(
    change: FloatArray,
    gradient: FloatArray,
    curvature: FloatArray,
    tempering: float,
    per_sigma: float,
    variance: float,
) -> None:
    """Temper log-likelihoods ``change`` (p,), and average them over shifts with a variance, m^2."""
    precision = tempering * per_sigma * per_sigma
    for p in range(change.shape[0]):
        change[p] *= tempering
    if variance > 0.0:
        for p in range(change.shape[0]):
            surely = 1.0 + precision * curvature[p] * variance
            pulled = precision * gradient[p]
            change[p] += 0.5 * (pulled * pulled * variance / surely - np.log(surely))


@called_with("f2 f1 f1 f1 f1 f1")
@_compile
def scan_log_likelihood(
    expected: FloatArray,
    measured: FloatArray,
    short: FloatArray,
    lasting: FloatArray,
    model: FloatArray,
    out: FloatArray,
) -> None:
    """Log p(o | d-hat) ``out`` (p,) of beams (n,) in the scan's order, ``expected`` (n, p)."""
    count, size = expected.shape
    free, stopped = np.empty(size), np.empty(size)
    for p in range(size):
        free[p], stopped[p], out[p] = 1.0 - model[UNEXPECTED], model[UNEXPECTED], 0.0
    most = min(at_once(short, model), at_once(lasting, model))
    for j in range(count):
        beam = densities_of(_read(measured[j], model), short[j], lasting[j], model)
        step(expected[j], beam, model, free, stopped)
        if (j + 1) % most == 0:
            _rescale(free, stopped, out)
    for p in range(size):
        free[p] += stopped[p]
    _flush(free, out)


@called_with("f2 f2 f2 f2 i f2 i1 f2 f1 i1 f1 f1 f f f2 b1")
@_compile
def object_log_likelihood(
    poses: FloatArray,
    placements: FloatArray,
    normals: FloatArray,
    outline: FloatArray,
    rim: int,
    background: FloatArray,
    order: IntArray,
    beams: FloatArray,
    lasting: FloatArray,
    index: IntArray,
    sweep: FloatArray,
    model: FloatArray,
    shift_std: float,
    tempering: float,
    out: FloatArray,
    bears: BoolArray,
) -> None:
    """Log p(o | s, l) of an object, minus that of the background alone: ``out`` (p, s).

    States have ``placements`` (s, 4) and ``normals`` (s, 2), poses are (p, 4). ``background`` (n,
    p) are the ranges without the object in the scan's order, as are ``lasting`` (n,), see ``runs``,
    and ``bears`` (n,); sorted beam i is ``order[i]``. Beams that the object doesn't touch
    contribute the same to every state (section 3 of Schulz and Burgard 2001), except for runs that
    reach over its edges. ``bears`` is set where a beam touches the object in some state and isn't
    stopped before it.

    The likelihood has the exponent ``tempering``. The object may stand ``shift_std`` m off its
    placement, along the unit normal ``normals[s]`` of its long side: an error that all its beams
    share. A range grows with the shift by 1 over the cosine of its incidence, so that the readings
    determine the shift as a Gaussian, and the average over it has a closed form.
    """
    count, variance = beams.shape[1], shift_std * shift_std
    measured, short, place = np.empty(count), np.empty(count), np.empty(count, dtype=np.int64)
    for i in range(count):
        j = order[i]
        place[j], measured[j], short[j] = i, _read(beams[MEASURED, i], model), beams[SHORT, i]
    most = min(at_once(short, model), at_once(lasting, model))
    before, per_density, later_free, later_stopped = look_past(
        background, measured, short, lasting, model
    )
    is_touched = np.empty(count, dtype=np.bool_)
    size, at = poses.shape[0], stands(poses, sweep)
    nearest, spare = np.empty((count, size)), np.empty((SPARE, size))
    untouched(nearest, is_touched)
    free, stopped, change = np.empty(size), np.empty(size), np.empty(size)
    gradient, curvature = np.empty(size), np.empty(size)
    for k in range(placements.shape[0]):
        project(
            at,
            placements[k],
            outline,
            rim,
            beams,
            index,
            sweep[SPREAD],
            nearest,
            is_touched,
            spare,
        )
        first, past = _span(is_touched, nearest, background, order, beams, model, bears)
        for p in range(size):
            change[p], gradient[p], curvature[p] = 0.0, 0.0, 0.0
        for j in range(first, past):
            i = place[j]
            if j == first:
                for p in range(size):
                    free[p], stopped[p] = 1.0 - before[j, p], before[j, p]
            beam = densities_of(measured[j], short[j], lasting[j], model)
            shift = _per_shift(normals, k, at.middle, beams, i) if variance > 0.0 else 0.0
            rows = nearest[i], background[j], per_density[j]
            _pass(*rows, beam, shift, model, free, stopped, gradient, curvature)
            if (j - first + 1) % most == 0:
                _rescale(free, stopped, change)
        if past > first:
            _end(free, stopped, later_free[past - 1], later_stopped[past - 1], change)
        _average(change, gradient, curvature, tempering, model[PER_SIGMA], variance)
        for p in range(size):
            out[p, k] = change[p]


@_inner
def _mix(
    alone: FloatArray,
    expected: FloatArray,
    dense: FloatArray,
    share: float,
    mixed: FloatArray,
    kept: FloatArray,
) -> None:
    """Add the case, with its share, of a place (p,) at which an object is nearer than all else."""
    for p in range(mixed.shape[0]):
        mixed[p] += share * dense[p] if alone[p] < expected[p] else 0.0
    for p in range(kept.shape[0]):
        kept[p] -= share if alone[p] < expected[p] else 0.0


@_inner
def _replace(likelihood: FloatArray, mixed: FloatArray, kept: FloatArray) -> None:
    """Replace each likelihood (p,) by the mixture, as far as its share isn't kept."""
    for p in range(likelihood.shape[0]):
        rest = kept[p] if kept[p] > LEAST_SHARE else 0.0
        likelihood[p] = rest * likelihood[p] + mixed[p]
        mixed[p] = 0.0
        kept[p] = 1.0


@_maker
def _log_products(likelihood: FloatArray, out: FloatArray) -> None:
    """Logarithms ``out`` (p,) of the products over beams of likelihoods (n, p)."""
    product = np.empty(out.shape[0])
    for p in range(out.shape[0]):
        product[p], out[p] = 1.0, 0.0
    for i in range(likelihood.shape[0]):
        row, leaves = likelihood[i], 0
        for p in range(out.shape[0]):
            product[p] *= row[p]
            leaves |= (product[p] < SMALL) | (product[p] > LARGE)
        if leaves:
            _flush(product, out)
    _flush(product, out)


@_inner
def _is_chosen(
    circles: FloatArray,
    k: int,
    pose: FloatArray,
    std: FloatArray,
    beams: FloatArray,
    sweep: FloatArray,
    reach: float,
    walls: FloatArray,
) -> Any:
    """Whether some beam may enter a circle (j, 3) before the walls, at ranges (m, p).

    From a ``pose`` (4,), the first of the p, with deviations ``std`` (2,) of position and yaw.
    """
    if not comes_within(circles[k], pose[X], pose[Y], reach):
        return False
    x, y, radius = seen_from(circles[k], pose[X], pose[Y], pose[COS], pose[SIN], std[0], std[1])
    x, y = x - sweep[CENTRE_X], y - sweep[CENTRE_Y]
    for i in range(walls.shape[0]):
        dx, dy = beams[DIRECTION_X, i], beams[DIRECTION_Y, i]
        entered, _ = crossing(x - beams[ORIGIN_X, i], y - beams[ORIGIN_Y, i], radius, dx, dy)
        if entered < walls[i, 0] + SPREAD_SIGMAS * std[0]:
            return True
    return False


@_inner
def _add_place(
    alone: FloatArray,
    without: FloatArray,
    beams: FloatArray,
    model: FloatArray,
    share: float,
    is_touched: BoolArray,
    is_mixed: BoolArray,
    dense: FloatArray,
    mixes: Any,
) -> None:
    """Add an object's ranges ``alone`` (m, p) in one place, with its share; they are reset."""
    mixed, kept = mixes
    for i in range(alone.shape[0]):
        if not is_touched[i]:
            continue
        is_touched[i] = False
        if _touches(alone[i], without[i], np.inf):
            is_mixed[i] = True
            _look(alone[i], _read(beams[MEASURED, i], model), beams[SHORT, i], model, dense)
            _mix(alone[i], without[i], dense, share, mixed[i], kept[i])
        for p in range(alone.shape[1]):
            alone[i, p] = np.inf


@called_with("f3 f2 f3 scenery f2 b1 laser f1 f1 f2")
@_compile
def pose_log_likelihood(
    poses: FloatArray,
    stds: FloatArray,
    walls: FloatArray,
    scenery: Scenery,
    circles: FloatArray,
    chosen: BoolArray,
    laser: Beams,
    sweep: FloatArray,
    model: FloatArray,
    out: FloatArray,
) -> None:
    """Log p(o | l) ``out`` (h, p) from poses (h, p, 4), in h groups that lie close together.

    The ``walls`` stand at ranges (h, m, p). Each beam is averaged over where the objects of a
    ``scenery`` may be: where an object is nearer than all else, the beam should read it; otherwise
    the beam keeps its likelihood. Where each object has a circle (j, 3), a group has those that its
    beams may enter; the first of its poses is then its mean, with deviations ``stds`` (h, 2) of
    position and yaw. The beams are the ``chosen`` (n,) ones of a scan, see ``taken``.
    """
    order, beams, index = taken(chosen, laser)
    size, count = poses.shape[1], beams.shape[1]
    without, likelihood = np.empty((count, size)), np.empty((count, size))
    alone, mixed, kept = np.empty((count, size)), np.empty((count, size)), np.empty((count, size))
    dense, spare, mixes = np.empty(size), np.empty((SPARE, size)), (mixed, kept)
    is_touched, is_mixed = np.empty(count, dtype=np.bool_), np.empty(count, dtype=np.bool_)
    for h in range(poses.shape[0]):
        at = stands(poses[h], sweep)
        untouched(alone, is_touched)
        for i in range(count):
            is_mixed[i] = False
            for p in range(size):
                without[i, p] = walls[h, order[i], p]
                mixed[i, p], kept[i, p] = 0.0, 1.0
            measured = _read(beams[MEASURED, i], model)
            _look(without[i], measured, beams[SHORT, i], model, likelihood[i])
        outline_start, placement_start = 0, 0
        for j in range(scenery.rims.shape[0]):
            outline = scenery.outlines[outline_start : scenery.outline_ends[j]]
            first, last = placement_start, scenery.placement_ends[j]
            outline_start, placement_start = scenery.outline_ends[j], last
            if circles.shape[0] > 0 and not _is_chosen(
                circles, j, poses[h, 0], stds[h], beams, sweep, model[RANGE_MAX], without
            ):
                continue
            for s in range(first, last):
                project(
                    at,
                    scenery.placements[s],
                    outline,
                    scenery.rims[j],
                    beams,
                    index,
                    sweep[SPREAD],
                    alone,
                    is_touched,
                    spare,
                )
                share = scenery.shares[s]
                _add_place(alone, without, beams, model, share, is_touched, is_mixed, dense, mixes)
            for i in range(count):
                if is_mixed[i]:
                    is_mixed[i] = False
                    _replace(likelihood[i], mixed[i], kept[i])
        _log_products(likelihood, out[h])
