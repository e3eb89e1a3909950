"""Casting rays: each caster of objstate against embreex as it comes, on the same rays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import cycle

import numpy as np

from benchmarks.speed.places import RANGE_MAX, about, hall, laser, office, scan_from, segments
from benchmarks.speed.raw import RawScene, prepared
from benchmarks.speed.table import Table, milliseconds, number, times
from benchmarks.speed.timing import Effort, in_turns
from objstate.building.model import Building
from objstate.config import BeamModelSettings
from objstate.geometry import FloatArray
from objstate.sensing import BeamModel, ExpectedRanges, Sensing

SAMPLES, BEAMS = 100, 360
ROOMS = 20  # on each side of a corridor, which makes about 1,000 segments
POSE = np.array([10.0, 0.2, 0.3])
AWAY = np.array([6.0, 0.0, 0.0])
EDGE = 1e-3  # m; beams that are off by more pass an edge on the other side


@dataclass(frozen=True, eq=False)
class Casters:
    """Everything that casts the same rays, from samples of a robot belief."""

    building: Building
    calls: dict[str, Callable[[], FloatArray]]

    @property
    def rays(self) -> int:
        return SAMPLES * BEAMS


def casters(building: Building, pose: FloatArray) -> Casters:
    """The casters of a building, and raw embreex, about a pose (3,)."""
    poses, rays = about(pose, SAMPLES), laser(BEAMS, 2.0 * np.pi)
    scan = scan_from(building, {}, pose, rays, np.random.default_rng(0))
    view = Sensing(building, BeamModel(BeamModelSettings())).view(scan)
    expected, raw, ready = ExpectedRanges(building), RawScene(building.walls), prepared(poses, rays)
    return Casters(
        building,
        {
            "embreex": lambda: raw.run(ready),
            "ExpectedRanges": lambda: expected.walls(poses, rays),
            "outlines": lambda: view.walls(poses),
        },
    )


def elsewhere(building: Building) -> Callable[[], FloatArray]:
    """Outlines from a place far off the last one, so that the walls in sight are found anew."""
    rays, places = laser(BEAMS, 2.0 * np.pi), cycle([POSE, POSE + AWAY])
    scan = scan_from(building, {}, POSE, rays, np.random.default_rng(0))
    view = Sensing(building, BeamModel(BeamModelSettings())).view(scan)
    return lambda: view.walls(about(next(places), SAMPLES))


def rays_per_second(effort: Effort) -> list[Table]:
    """Rays per second on small and large meshes."""
    rows = []
    for triangles in (500, 50_000):
        each = casters(Building("hall", hall(triangles), {}), np.zeros(3))
        taken = in_turns(each.calls, effort)
        rows += [
            (
                f"{len(each.building.walls.faces):,}",
                name,
                f"{number(each.rays / taken[name] / 1e6)} million",
                times(taken["embreex"] / taken[name]),
            )
            for name in each.calls
        ]
    return [
        Table(
            "Rays per second",
            ("triangles", "caster", "rays per second", "of raw embreex"),
            rows,
            (
                f"{SAMPLES} robot samples with deviations of 3 cm and 1.5°, {BEAMS} level beams over 360°, in a "
                "hall full of boxes. *embreex* is given arrays that are ready. `ExpectedRanges` serves lasers of "
                "any mounting, *outlines* level ones.",
            ),
        )
    ]


def whole_scans(effort: Effort) -> list[Table]:
    """Whole scans of expected ranges in an office."""
    building = office(1, ROOMS)
    each = casters(building, POSE)
    taken = in_turns(each.calls | {"outlines, from elsewhere": elsewhere(building)}, effort)
    exact, found = (each.calls[name]().ravel() for name in ("embreex", "outlines"))
    off = np.abs(exact.astype(float).clip(max=RANGE_MAX) - found.clip(max=RANGE_MAX))
    same = off[off <= EDGE]
    rows = [
        (name, milliseconds(taken[name] / SAMPLES), times(taken["embreex"] / taken[name]))
        for name in taken
    ]
    return [
        Table(
            "Whole scans of expected ranges in an office",
            ("caster", "one scan", "of raw embreex"),
            rows,
            (
                f"{segments(building.walls):,} wall segments, {len(building.walls.faces):,} triangles, "
                f"{BEAMS} beams over 360°, range 8 m; mean over {SAMPLES} robot samples. Outlines and embreex "
                f"agree within {1e3 * same.max():.2g} mm, but for {len(off) - len(same)} of {each.rays:,} beams "
                "that pass an edge on its other side.",
                "The walls in sight are found once for every half metre that the robot drives. *From elsewhere* "
                "includes this: the samples stand 6 m from the previous ones.",
            ),
        )
    ]
