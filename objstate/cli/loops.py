"""The loops that runs need, compiled in groups: ``python -m objstate.cli.loops PARENT``.

The signatures that a run calls them with stand beside the loops, see ``called_with``.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Any

from objstate.calibration import survey_kernels as survey
from objstate.compiling import types_of
from objstate.discovery import kernels as doors
from objstate.discovery import surfaces
from objstate.gaze import kernels as gaze
from objstate.gaze.field import kernels as head
from objstate.grid import rasters as grid
from objstate.habits import kernels as habits
from objstate.localization import pose_update as pose
from objstate.localization import samples as robot
from objstate.localization import tables as search
from objstate.maintenance import check_kernels as checks
from objstate.objects import components, lattice, repeats
from objstate.objects import exchange_kernels as exchange
from objstate.objects import latch_kernels as latch
from objstate.objects import mixture_kernels as mixture
from objstate.objects import sampling as furniture
from objstate.objects import step_kernels as step
from objstate.objects import update_kernels as update
from objstate.particles import reweighting as particles
from objstate.sensing import circles as sight
from objstate.sensing import front_to_back, likelihood, pieces, projection, segments
from objstate.sensing import sweeps as scans

Group = tuple[Any, ...]  # loops that share much of what they call, so that one process has them

# groups that every run needs; the others are of furniture, of wide beliefs, of grids and of habits,
# of learning buildings, and of choosing where to look
EVERY_RUN = 12

GROUPS: tuple[Group, ...] = (  # those that take longest come first
    (likelihood.pose_log_likelihood, front_to_back.wall_ranges),
    (mixture.condition,),
    (pose.slipped, pose.gather, pose.surely_met, pose.agreement),
    (exchange.read_off, exchange.exchange, exchange.evidence_under, latch.limit),
    (sight.evenly_spread, sight.within, sight.near, sight.crossings, sight.seen),
    (
        *(pose.drive, pose.leave, pose.rows, pose.wall_sums),
        *(pose.meet_objects, pose.expect_objects, pose.expect_each),
    ),
    (search.by_cell, search.look_round),
    (
        *(mixture.pooled, mixture.renew_robot, repeats.trace, repeats.share, repeats.beside),
        *(update.arrive, update.begin, update.choose, update.reweigh, step.store, step.are_alike),
    ),
    (search.scores, lattice.moments, lattice.interval),
    (scans.total_log_likelihoods, scans.take, scans.stand, scans.stand_about, scans.hinged),
    (scans.ranges_to, scans.share_explained, scans.short, pieces.meet),
    (
        *(robot.moments, robot.cells, robot.copies),
        *(particles.normalize, particles.largest_step, particles.systematic),
    ),
    (likelihood.object_log_likelihood, projection.cast),
    (habits.whole_days, habits.forward, habits.sampled),
    (components.arrive, components.densities, components.merge, components.meeting),
    (components.possible,),
    (lattice.predict, lattice.condition, lattice.worth_casting),
    (furniture.moments, furniture.offsets, furniture.lie_on, robot.moved),
    (
        *(grid.update_bayes, grid.update_log_odds, grid.update_counts, grid.update_averages),
        *(grid.read_counts, grid.read_beliefs),
        *(grid.entropies, grid.entropies_from_table, grid.entropies_by_series),
        *(grid.draw_obstacles, grid.draw_beams, grid.cover),
    ),
    (
        *(doors.leaf_gain, doors.background_log_likelihood, doors.enter_unknown, doors.chain),
        *(doors.nearest_line, doors.crossed, doors.through, doors.off_drawn, doors.shown_along),
        *(doors.stretches, doors.free_way),
    ),
    (surfaces.cast, surfaces.offsets, surfaces.displace, survey.sums),
    (segments.cast, scans.log_likelihoods),
    (checks.sector, checks.ranges_of, checks.check, gaze.gains_along, gaze.in_sight),
    (head.along_rays, head.mark_looked, head.mean_views, head.follow_maxima, head.panorama),
    (likelihood.scan_log_likelihood, scans.lasting, scans.with_trigonometry, scans.ends),
)


def compile_groups(groups: Iterable[Group]) -> None:
    """Compile the loops of some groups, or load those that were compiled before."""
    for loop in chain.from_iterable(groups):
        loop.compile(types_of(loop))


def handed_out(queue: int, parent: int | None = None) -> Iterator[Group]:
    """Groups whose numbers are read from a pipe, a byte each, as long as the ``parent`` runs.

    Processes that read from the same pipe share its groups out among them.
    """
    while parent in (None, os.getppid()) and (number := os.read(queue, 1)):
        yield GROUPS[number[0]]


def main(parent: int) -> None:
    """Compile the groups that standard input hands out, in a process for that alone."""
    gc.disable()  # not worth it in a process that ends soon
    compile_groups(handed_out(sys.stdin.fileno(), parent))


if __name__ == "__main__":
    main(int(sys.argv[1]))
