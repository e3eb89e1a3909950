"""Which beams may reach which objects, how the walls explain what they read, and how far those are off; compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import inner, njit
from objstate.geometry import BoolArray, FloatArray

SPREAD_SIGMAS = 3.0  # how far samples of a belief stray from its mean
BENT = 0.02  # rad, by which three places in a row on a flat wall may seem to bend
ASIDE = 0.27  # of a cell, by which the grid of places is shifted: walls stand at round numbers
SIDES = 8  # directions that the walls of one place are told apart by
CELLS = 2**26  # more than a building has along a side
TINY = np.finfo(np.float64).tiny

_compile = njit(nogil=True, error_model="numpy")
_inner = inner(nogil=True, error_model="numpy")


@_inner
def _comes_within(circle: FloatArray, x: float, y: float, distance: float) -> Any:
    """Whether a circle (3,) comes within a distance of a place."""
    east, north, reach = circle[0] - x, circle[1] - y, circle[2] + distance
    return east * east + north * north <= reach * reach


@_compile
def within(circles: FloatArray, x: float, y: float, distance: float) -> Any:
    """Which of the circles (m, 3), x, y and radius, come within a distance of a place: their numbers, and they themselves."""
    found, count = np.empty(circles.shape[0], dtype=np.int64), 0
    for k in range(circles.shape[0]):
        found[count] = k
        count += _comes_within(circles[k], x, y, distance)
    near = np.empty((count, 3))
    for k in range(count):
        for part in range(3):
            near[k, part] = circles[found[k], part]
    return found[:count], near


@_compile
def entries(
    circles: FloatArray,
    pose: FloatArray,
    position_std: float,
    yaw_std: float,
    origins: FloatArray,
    directions: FloatArray,
    level: FloatArray,
) -> Any:
    """Range (m, n) at which each beam enters each circle (m, 3); inf where it passes by.

    Beams have ``origins`` (n, 3) in the frame of the robot at a ``pose`` (3,), ``directions`` (n, 2) seen from
    above, and a share ``level`` (n,) of their ranges. The circles are widened by what the robot may be off.
    """
    out = np.empty((circles.shape[0], origins.shape[0]))
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for k in range(circles.shape[0]):
        east, north = circles[k, 0] - pose[0], circles[k, 1] - pose[1]
        x, y = cos * east + sin * north, cos * north - sin * east
        strayed = SPREAD_SIGMAS * (position_std + yaw_std * np.hypot(x, y))
        radius = circles[k, 2] + strayed
        for i in range(origins.shape[0]):
            to_x, to_y = x - origins[i, 0], y - origins[i, 1]
            along = to_x * directions[i, 0] + to_y * directions[i, 1]
            aside = to_x * directions[i, 1] - to_y * directions[i, 0]
            squared = radius * radius - aside * aside
            half = np.sqrt(max(squared, 0.0))
            enters = (squared >= 0.0) & (along + half > 0.0)
            out[k, i] = max(along - half, 0.0) / level[i] if enters else np.inf
    return out


@_compile
def near(
    circles: FloatArray,
    x: float,
    y: float,
    distance: float,
    entered: FloatArray,
    beams: BoolArray,
) -> Any:
    """Which of the circles (m, 3) come within a distance of a place, which of these are entered, and by which beams.

    The first two are numbers; of the beams (n,), those count that are chosen and enter one of the circles, at ranges (m, n).
    """
    found, count = np.empty((2, circles.shape[0]), dtype=np.int64), 0
    enters, some = np.zeros(beams.shape[0], dtype=np.bool_), 0
    for k in range(circles.shape[0]):
        if not _comes_within(circles[k], x, y, distance):
            continue
        found[0, count] = found[1, some] = k
        is_entered = False
        for i in range(beams.shape[0]):
            meets = beams[i] & (entered[k, i] < np.inf)
            enters[i] |= meets
            is_entered |= meets
        count += 1
        some += is_entered
    return found[0, :count], found[1, :some], enters


@_compile
def reached(entered: FloatArray, beams: BoolArray, walls: FloatArray, margin: float) -> Any:
    """Which objects, by number, some of the beams (n,) enter before they are a margin, m, past the walls (n,).

    They are entered at ranges (m, n) m.
    """
    found, count = np.empty(entered.shape[0], dtype=np.int64), 0
    for k in range(entered.shape[0]):
        is_reached = False
        for i in range(beams.shape[0]):
            is_reached |= beams[i] & (entered[k, i] < walls[i] + margin)
        found[count] = k
        count += is_reached
    return found[:count]


@_compile
def evenly_spread(beams: BoolArray, most: int) -> Any:
    """At most ``most`` of the chosen beams (n,), evenly spread among them."""
    last, kept = -1, np.empty(beams.shape[0], dtype=np.bool_)
    for i in range(beams.shape[0]):
        kept[i] = False
        last += beams[i]
    if last < most:
        return beams
    rank, step = 0, 0  # of the chosen beams, and of those that are kept
    for i in range(beams.shape[0]):
        if beams[i]:
            next_rank = (2 * step * last + most - 1) // (2 * max(most - 1, 1))
            if step < most and rank == next_rank:
                kept[i] = True
                step += 1
            rank += 1
    return kept


@_compile
def share_through_walls(measured: FloatArray, walls: FloatArray, margin: float) -> Any:
    """Share of returning beams (n,) that measured more than a margin, m, beyond the walls (n,).

    Beams stand in the order of their bearings. The farthest wall of a beam and its
    two neighbours counts, since beside a corner, or along a wall, a small turn of
    the robot moves the expected range far.
    """
    returns, through, last = 0, 0, measured.shape[0] - 1
    for i in range(measured.shape[0]):
        farthest = max(walls[max(i - 1, 0)], walls[i], walls[min(i + 1, last)])
        returns += np.isfinite(measured[i])
        through += np.isfinite(measured[i]) & (measured[i] > farthest + margin)
    return through / returns if returns else 0.0


@_inner
def _wall_beams(
    places: FloatArray, directions: FloatArray, longer: FloatArray, cell_m: float
) -> Any:
    """Beams (k,) that end between two neighbours on a flat wall: their cells and sides as one number, how they lie off.

    That is m along the wall's normal (k,), and the squared cosine (k,) at which they meet it.
    """
    count, cells = 0, np.empty(places.shape[0], dtype=np.int64)
    offs, squares = np.empty(places.shape[0]), np.empty(places.shape[0])
    last_x, last_y = 0.0, 0.0  # direction of the way to a place from that before
    for i in range(places.shape[0] - 1):
        x, y = places[i + 1, 0] - places[i, 0], places[i + 1, 1] - places[i, 1]
        length = max(np.hypot(x, y), TINY)
        x, y = x / length, y / length
        is_flat = abs(last_x * y - last_y * x) < BENT and last_x * x + last_y * y > 0.0
        last_x, last_y = x, y
        if i == 0 or not is_flat:
            continue
        cosine = directions[i, 1] * x - directions[i, 0] * y
        facing = np.arctan2(np.sign(cosine) * x, -np.sign(cosine) * y)
        side = np.int64(np.rint(facing * SIDES / (2.0 * np.pi))) % SIDES
        column = np.int64(np.floor(places[i, 0] / cell_m + ASIDE))
        row = np.int64(np.floor(places[i, 1] / cell_m + ASIDE))
        cells[count] = ((column + CELLS // 2) * CELLS + row + CELLS // 2) * SIDES + side
        offs[count], squares[count] = longer[i] * abs(cosine), cosine * cosine
        count += 1
    return cells[:count], offs[:count], squares[:count]


@_inner
def _ascending(values: Any) -> Any:
    """Indices (n,) of values (n,) in ascending order, for few of them."""
    order = np.empty(values.shape[0], dtype=np.int64)
    for i in range(values.shape[0]):
        place = i
        while place > 0 and values[order[place - 1]] > values[i]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = i
    return order


@_compile
def wall_looks(
    places: FloatArray,
    directions: FloatArray,
    longer: FloatArray,
    cell_m: float,
    most_m: float,
    least_beams: int,
    in_full: float,
    variance: float,
) -> Any:
    """How places on walls seem to lie off: column and row of a cell, side, m along the normal, and its variance (k, 5).

    Beams in their order should end at places (n, 2), go in ``directions`` (n, 2), unit vectors seen from above, and
    read ``longer`` (n,) m than they should, with such a ``variance``. Beams that are off by ``most_m`` or more were
    stopped by something, or went through a gap; a place counts if the others are enough, and a share ``in_full`` of all.
    """
    cells, offs, squares = _wall_beams(places, directions, longer, cell_m)
    order, believable = _ascending(cells), np.empty(cells.shape[0])
    out, found, first = np.empty((cells.shape[0], 5)), 0, 0
    while first < order.shape[0]:
        cell, last, count, told = cells[order[first]], first, 0, 0.0
        while last < order.shape[0] and cells[order[last]] == cell:
            beam = order[last]
            if abs(offs[beam]) < most_m:
                believable[count] = offs[beam]
                told += squares[beam]
                count += 1
            last += 1
        if count >= max(float(least_beams), in_full * (last - first)):
            out[found, 0] = cell // (CELLS * SIDES) - CELLS // 2
            out[found, 1] = cell // SIDES % CELLS - CELLS // 2
            out[found, 2] = cell % SIDES
            ranks = _ascending(believable[:count])
            middle = believable[ranks[(count - 1) // 2]] + believable[ranks[count // 2]]
            out[found, 3] = middle / 2.0
            out[found, 4] = variance * told / count**2
            found += 1
        first = last
    return out[:found]
