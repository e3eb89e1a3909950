"""The loops that runs need, compiled part by part: ``python -m objstate.cli.loops PART OF PARTS``.

The signatures that a run calls them with stand beside the loops, see ``called_with``.
"""

from __future__ import annotations

import gc
import os
import sys
import threading
from itertools import chain
from typing import Any

from objstate.compiling import types_of
from objstate.grid import rasters as grid
from objstate.habits import kernels as habits
from objstate.localization import pose_update as pose
from objstate.localization import samples as robot
from objstate.localization import tables as search
from objstate.objects import components, lattice
from objstate.objects import exchange_kernels as exchange
from objstate.objects import latch_kernels as latch
from objstate.objects import mixture_kernels as mixture
from objstate.objects import sampling as furniture
from objstate.particles import reweighting as particles
from objstate.sensing import circles as sight
from objstate.sensing import front_to_back, likelihood, pieces, projection
from objstate.sensing import sweeps as scans

Part = tuple[Any, ...]  # loops

# parts that every run needs; the others are of furniture, of wide beliefs, of grids and of habits
EVERY_RUN = 4

PARTS: tuple[Part, ...] = (  # of about equal work; every other one holds the projection
    (
        mixture.pooled,
        mixture.renew_robot,
        mixture.join,
        latch.latch,
        exchange.evidence_under,
        exchange.exchange,
        pose.wall_sums,
        pose.drive,
        pose.leave,
        pose.columns_of,
        pose.rows,
        pose.gather,
        pose.slipped,
        pose.surely_met,
        pose.agreement,
    ),
    (
        mixture.condition,
        exchange.read_off,
        pieces.meet,
        scans.take,
        scans.stand,
        scans.stand_about,
        scans.hinged,
        scans.short,
        scans.total_log_likelihoods,
        scans.ranges_to,
        scans.share_explained,
        particles.normalize,
        particles.largest_step,
        particles.systematic,
        lattice.moments,
        lattice.interval,
    ),
    (
        likelihood.pose_log_likelihood,
        front_to_back.wall_ranges,
        search.by_cell,
        search.look_round,
    ),
    (
        search.scores,
        robot.moments,
        robot.cells,
        robot.copies,
        sight.evenly_spread,
        sight.within,
        sight.near,
        sight.entries,
        sight.seen,
    ),
    (
        projection.cast,
        likelihood.object_log_likelihood,
        furniture.moments,
        likelihood.scan_log_likelihood,
        scans.lasting,
    ),
    (
        lattice.worth_casting,
        lattice.predict,
        lattice.condition,
        robot.moved,
        furniture.offsets,
        furniture.lie_on,
        components.arrive,
        components.densities,
        components.merge,
        components.meeting,
        scans.with_trigonometry,
        scans.ends,
    ),
    (
        grid.update_bayes,
        grid.update_log_odds,
        grid.update_counts,
        grid.update_averages,
        grid.read_counts,
        grid.read_beliefs,
        grid.entropies,
        grid.entropies_from_table,
        grid.entropies_by_series,
        grid.draw_obstacles,
        grid.draw_beams,
        grid.cover,
    ),
    (habits.forward,),
)


def compile_part(part: int, of: int, parts: int) -> None:
    """Compile every ``of``-th of the first ``parts``, except those compiled before."""
    for loop in chain(*PARTS[part:parts:of]):
        loop.compile(types_of(loop))


def main(part: int, of: int, parts: int) -> None:
    """The same in a process for that alone, which ends at once when its parent does."""
    gc.disable()  # not worth it in a process that ends soon
    threading.Thread(target=_end_with_parent, daemon=True).start()
    compile_part(part, of, parts)


def _end_with_parent() -> None:
    sys.stdin.read()
    os._exit(1)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
