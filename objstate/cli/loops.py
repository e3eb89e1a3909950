"""The loops that runs need, compiled part by part: ``python -m objstate.cli.loops PART OF PARTS``.

Signatures are those that a run calls them with: b, i and f for truth values, integers and
floats, with the number of axes where they are arrays, and m for ``Moves``.
"""

from __future__ import annotations

import gc
import os
import sys
import threading
from itertools import chain
from typing import Any

from objstate.estimator import kernels as sight
from objstate.localization import kernels as robot
from objstate.localization import search_kernels as search
from objstate.objects import kernels as lattice
from objstate.objects import sampling as furniture
from objstate.particles import kernels as particles
from objstate.sensing import front_to_back, likelihood, projection
from objstate.sensing import kernels as scans

Part = tuple[tuple[Any, str], ...]  # loops and their signatures

EVERY_RUN = 4  # parts that every run needs; the others are furniture's

PARTS: tuple[Part, ...] = (  # of about equal work; every other one holds the projection
    (
        (likelihood.object_log_likelihood, "f2 f2 f2 b1 i1 f2 i f2 i1 f2 f1 i1 f1 f1 f f f2 b1"),
        (front_to_back.cast, "f2 f2 i1 f2 f1 i1 f1 f1 b1 i1 f2 i1 f1 f1 f1 f2"),
    ),
    (
        (scans.take, "b1 i1 f2 i1 f1 f1"),
        (scans.stand, "f2 f2"),
        (scans.hinged, "f f f f f2 f2"),
        (scans.short, "f1 f f f1"),
        (scans.lasting, "f1 f f f1"),
        (scans.fit, "f b1 f1 f1 f1"),
        (scans.share_explained, "b1 i1 f2 f1 f1 f1 f2 f2 f f"),
        (particles.normalize, "f1 f1 f1"),
        (particles.largest_step, "f1 f1 f f"),
        (particles.systematic, "f1 i f"),
        (particles.evenly_after, "f1 f1 i"),
        (lattice.worth_casting, "f1 f i i"),
        (lattice.predict, "f2 f1 f1 f i1 f f b f f f f1 f1 f2 f1 f1"),
        (lattice.condition, "f2 i1 b1 f2 f1 f f b f2 f1 f1"),
        (lattice.settle, "f2 f1 f f b f f f1"),
        (lattice.widen, "f1 f i f f f b f f1"),
        (lattice.moments, "f1 f f b"),
        (lattice.handed_on, "f2 f1 f i1"),
    ),
    (
        (projection.cast, "f2 f2 f2 i b1 i1 f2 i1 f1 f1 f1 f3"),
        (likelihood.pose_log_likelihood, "f2 f2 f2 i1 i1 f2 i1 f1 b1 i1 f2 i1 f1 f1 f1 f1 f1"),
        (likelihood.scan_log_likelihood, "f2 f1 f1 f1 f1 f1"),
        (search.by_cell, "f2 f i i"),
        (search.look_round, "f2 f2 f2 i1 i2 i2 f f f"),
    ),
    (
        (search.scores, "f2 i2 f1 f f2 f2 f2 i1 f2 f1 f f1 f"),
        (search.scores_all_round, "f2 f1 i2 f1 f f2 f2 f2 i1 f2 f1 f f1 f"),
        (robot.moments, "f2 f1 f1 f2"),
        (robot.moved, "f2 f f f f f f2 f2"),
        (robot.cells, "f2 f1"),
        (robot.copies, "f2 i1 f2 f2 f f1"),
        (sight.evenly_spread, "b1 i"),
        (sight.within, "f2 f f f"),
        (sight.near, "f2 f f f f2 b1"),
        (sight.entries, "f2 f1 f f f2 f2 f1"),
        (sight.reached, "f2 b1 f1 f"),
        (sight.share_through_walls, "f1 f1 f"),
    ),
    (
        (furniture.copies, "f2 f1 i1 f1 f1 f2 f2"),
        (furniture.moments, "f2 f1 f i f1 f1 f1"),
        (furniture.occupied, "f2 f1 f1"),
        (furniture.inherit, "f2 f1 i1 f1 f2"),
    ),
    (
        (furniture.take_in, "f2 f1 i f2 f1 f f f f2 f1"),
        (furniture.offsets, "f2 f1 i f1 f2"),
        (furniture.lie_on, "f2 f2 f2 f b2"),
        (furniture.densities, "f2 f1 m f1"),
        (furniture.pool, "f2 f1 i f1 f1 m f f1"),
        (furniture.send_out, "f2 f2 f1 m f1 f2 f2 f1 f2"),
        (lattice.apportion, "f2 f1 f2 f1 f1 f1 f1 f1"),
        (scans.with_trigonometry, "f2 f f2"),
        (scans.ends, "i1 f2 f1 f f1"),
    ),
)


def compile_part(part: int, of: int, parts: int) -> None:
    """Of the first ``parts``, compile every ``of``-th from one on, but for loops that were compiled before."""
    for loop, signature in chain(*PARTS[part:parts:of]):
        loop.compile(_types(signature))


def main(part: int, of: int, parts: int) -> None:
    """The same in a process for that alone, which ends at once when its parent does."""
    gc.disable()  # what numba leaves isn't worth looking for in a process that ends soon
    threading.Thread(target=_end_with_parent, daemon=True).start()
    compile_part(part, of, parts)


def _types(signature: str) -> tuple[Any, ...]:
    from numba import types

    place, flag, count = types.Array(types.float64, 1, "C"), types.boolean, types.int64
    fields = (place, place, flag, place, count, place)
    moves = types.NamedTuple(fields, furniture.Moves)  # type: ignore[no-untyped-call]
    plain = {"b": flag, "i": count, "f": types.float64, "m": moves}
    return tuple(
        types.Array(plain[each[0]], int(each[1:]), "C") if each[1:] else plain[each]
        for each in signature.split()
    )


def _end_with_parent() -> None:
    sys.stdin.read()
    os._exit(1)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
