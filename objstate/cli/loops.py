"""The loops that runs need, compiled part by part: ``python -m objstate.cli.loops PART OF PARTS``.

Signatures are those that a run calls them with: b, i and f for truth values, integers and floats, j
and g for those of 32 bits, with the number of axes where they are arrays, and the names of records.
"""

from __future__ import annotations

import gc
import os
import sys
import threading
from functools import cache
from itertools import chain
from typing import Any

import numpy as np

from objstate.grid import kernels as grid
from objstate.habits import kernels as habits
from objstate.localization import kernels as robot
from objstate.localization import pose_kernels as pose
from objstate.localization import search_kernels as search
from objstate.objects import exchange_kernels as exchange
from objstate.objects import furniture_kernels as components
from objstate.objects import kernels as lattice
from objstate.objects import mixture_kernels as mixture
from objstate.objects import sampling as furniture
from objstate.particles import kernels as particles
from objstate.sensing import circles as sight
from objstate.sensing import front_to_back, likelihood, projection, surface_kernels
from objstate.sensing import kernels as scans

Part = tuple[tuple[Any, str], ...]  # loops and their signatures

# parts that every run needs; the others are of furniture, of wide beliefs, of grids and of habits
EVERY_RUN = 4

PARTS: tuple[Part, ...] = (  # of about equal work; every other one holds the projection
    (
        (mixture.pooled, "f1 f2 f3"),
        (mixture.renew_robot, "f2 f3 f2 f2"),
        (mixture.join, "f1 f1 f2 f1 f2 f3"),
        (exchange.evidence_under, "f1 f2 f3 b f f1 f"),
        (exchange.exchange, "f1 f1 f2 f3 f1 f1 f2 f3 f2 f2"),
    ),
    (
        (mixture.condition, "beams shape noise f2 f1 f1 f2 f3 f1"),
        (exchange.read_off, "f2 f2 f2 f2 i f f b f f2 f2"),
        (surface_kernels.meet, "f2 f2 i1 f2 f2 f1 i1"),
        (scans.take, "b1 i1 f2 i1 f1 f1"),
        (scans.stand, "f2 f2"),
        (scans.stand_about, "f3 f3 f2"),
        (scans.hinged, "f f f f f2 f2"),
        (scans.short, "f1 f f f1"),
        (scans.total_log_likelihoods, "f2 f2 f2 f1 f2"),
        (scans.ranges_to, "i1 f2 f1 f1 f2 f2 f2"),
        (scans.share_explained, "b1 i1 f2 f1 f1 f1 f2 f2 f f"),
        (particles.normalize, "f1 f1 f1"),
        (particles.largest_step, "f1 f1 f f"),
        (particles.systematic, "f1 i f"),
        (lattice.moments, "f1 f f b"),
        (lattice.interval, "f1 f f f"),
    ),
    (
        (likelihood.pose_log_likelihood, "f3 f2 walls near f3 scenery f2 b1 laser f1 f1 f2"),
        (search.by_cell, "f2 f i i"),
        (search.look_round, "f2 f2 f2 i1 i2 i2 f f f"),
    ),
    (
        (search.scores, "f2 i2 f1 f f2 f2 f2 i1 f2 f1 f f1 f"),
        (search.scores_all_round, "f2 f1 i2 f1 f f2 f2 f2 i1 f2 f1 f f1 f"),
        (pose.wall_sums, "f1 f2 i1 f f"),
        (pose.drive, "f1 f2 f2 f1 f f f f f f i1 f f f"),
        (pose.leave, "f2 f2 f1 f1 i f2 f2 f1 f1 f1"),
        (pose.columns_of, "i1 i1 f1 i i2 f1"),
        (pose.rows, "f2 i1 f1 f2 f2 f1 f1 f1 f2"),
        (pose.gather, "b1 f1 f1 f1 f2 i2 f1 f1 f2 f f f f f f f f f2 f1 f1 f1"),
        (pose.slipped, "b1 i f1 f1 f1 f2 i2 f1 f2 f f f f f f f f f1 f"),
        (pose.surely_met, "b1 f1 f1 i1 f2 f1 f f"),
        (pose.agreement, "f1 f1 f1"),
        (robot.moments, "f2 f1 f1 f2"),
        (robot.cells, "f2 f1"),
        (robot.copies, "f2 i1 f2 f2 f f1"),
        (sight.evenly_spread, "b1 i"),
        (sight.within, "f2 f f f"),
        (sight.near, "f2 f f f f2 b1"),
        (sight.entries, "f2 f1 f f f2 f2 f1"),
        (sight.seen, "f2 f1 f f f f2 f2 f1 b1 f1"),
    ),
    (
        (projection.cast, "f2 f2 f2 i b1 i1 f2 i1 f1 f1 f1 f3"),
        (likelihood.object_log_likelihood, "f2 f2 f2 f2 i f2 i1 f2 f1 i1 f1 f1 f f f2 b1"),
        (furniture.moments, "f2 f1 f i f1 f1 f1"),
        (likelihood.scan_log_likelihood, "f2 f1 f1 f1 f1 f1"),
        (scans.lasting, "f1 f f f1"),
    ),
    (
        (lattice.worth_casting, "f1 f i i"),
        (lattice.predict, "f1 f1 f f b f f f f1 f1 f1 f1"),
        (lattice.condition, "f1 i1 f2 f1 f f b f1 f1"),
        (robot.moved, "f2 f f f f f f2 f2"),
        (furniture.offsets, "f2 f1 i f1 f2"),
        (furniture.lie_on, "f2 f2 f2 f b2"),
        (components.arrive, "f f2 f2 f2 f1 f2 f2 f3"),
        (components.densities, "f2 f1 f2 f3 f1 i f1 f1"),
        (components.merge, "f1 f2 f2 f3 i f1 f"),
        (components.meeting, "f2 f2 f2 f1 b1"),
        (scans.with_trigonometry, "f2 f f2"),
        (scans.ends, "i1 f2 f1 f f1"),
    ),
    (
        (grid.update_bayes, "g1 g1 j1 g1 f f f f"),
        (grid.update_log_odds, "g1 g1 j1 g1 f f f f"),
        (grid.update_counts, "g1 g1 g1 j1 g1 f f f"),
        (grid.update_averages, "g1 g1 g1 j1 g1 f f f"),
        (grid.read_counts, "g1 g1 g1 f f g1"),
        (grid.read_beliefs, "g1 g1 f f g1"),
        (grid.entropies, "g1 g1"),
        (grid.entropies_from_table, "g1 g1 g1 g1"),
        (grid.entropies_by_series, "g1 g1 g1"),
        (grid.draw_obstacles, "j1 i i i f2 f2 b1 f1 f2 f f f j1 g1"),
        (grid.draw_beams, "j1 i i i f2 f2 i f f j1 g1"),
        (grid.cover, "j1 f2 f2 j1 f1"),
    ),
    ((habits.forward, "f1 f2 i1 f1 i1 f2 f2 f3 f3 f4 i2 i2 f2 f1 f2"),),
)


def compile_part(part: int, of: int, parts: int) -> None:
    """Compile every ``of``-th of the first ``parts``, except those compiled before."""
    for loop, signature in chain(*PARTS[part:parts:of]):
        loop.compile(_types(signature))


def main(part: int, of: int, parts: int) -> None:
    """The same in a process for that alone, which ends at once when its parent does."""
    gc.disable()  # not worth it in a process that ends soon
    threading.Thread(target=_end_with_parent, daemon=True).start()
    compile_part(part, of, parts)


def _types(signature: str) -> tuple[Any, ...]:
    from numba import types

    plain = {
        "b": types.boolean,
        "i": types.int64,
        "f": types.float64,
        "j": types.int32,
        "g": types.float32,
    }
    records = _records()
    return tuple(
        records.get(each)
        or (types.Array(plain[each[0]], int(each[1:]), "C") if each[1:] else plain[each])
        for each in signature.split()
    )


@cache
def _records() -> dict[str, Any]:
    """The types of records of parameters, as examples of them have them."""
    from numba import typeof

    line, rows, whole = np.empty(1), np.empty((1, 2)), np.empty(1, dtype=np.int64)
    examples = {
        "beams": mixture.Beams(line, rows, rows, line, line, line),
        "shape": mixture.Shape(rows, rows, rows, np.empty((1, 2), dtype=np.int64), 1.0, line),
        "walls": front_to_back.WallGroups(rows, whole, rows, line),
        "near": front_to_back.NearGroups(rows, whole, whole, line),
        "scenery": scans.Scenery(rows, whole, whole, rows, whole, line),
        "laser": scans.Beams(whole, rows, whole, line, line),
        "noise": mixture.Noise(*(1.0,) * len(mixture.Noise._fields)),
    }
    return {name: typeof(each) for name, each in examples.items()}  # type: ignore[no-untyped-call]


def _end_with_parent() -> None:
    sys.stdin.read()
    os._exit(1)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
