"""How the cost of a scan grows with samples, states, beams and objects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from benchmarks.altered import Altered
from benchmarks.speed.places import Drive, ajar, closets, laser, office
from benchmarks.speed.table import Table, milliseconds, number, times
from benchmarks.speed.timing import Effort, processor_time
from objstate.building.model import Building
from objstate.config import LocalizationSettings, Settings
from objstate.estimator import Estimator
from objstate.records import Record, Scan

WARM_UP = 5  # scans that aren't counted: loops are compiled, walls cut
ROUNDS = 3
USUAL = 0.9  # of all scans
BEAMS = 180


@dataclass(frozen=True, eq=False)
class Setting:
    """One point of a curve: a building, settings, and a drive."""

    building: Building
    records: Sequence[Record]
    settings: Settings


@dataclass(frozen=True)
class Cost:
    """Processor time, s."""

    first: float  # of the first scan, which cuts the walls
    dearest: float  # of a later one, in which the robot is looked for all over the building
    scan: float  # the mean of the cheaper nine tenths of the others


def growth(effort: Effort) -> list[Table]:
    """The tables of all curves."""
    corridor = office(1, 8)
    states = ajar(list(corridor.objects))
    records = Drive(corridor, states, (6.0, 0.0), laser(BEAMS)).records(effort.scans)
    curves = {
        "robot samples": {
            count: Setting(corridor, records, _robot_samples(count))
            for count in (50, 100, 200, 400, 800)
        },
        "states of each door": {
            count: Setting(
                corridor,
                records,
                Altered(changes={"resolution_deg": 90.0 / (count - 1)}),
            )
            for count in (10, 46, 91, 181, 361)
        },
        "beams": {
            count: Setting(
                corridor,
                Drive(corridor, states, (6.0, 0.0), laser(count)).records(effort.scans),
                Settings(),
            )
            for count in (90, 180, 360, 720)
        },
        "objects in view": {count: _in_view(count, effort) for count in (0, 1, 2, 4, 8)},
    }
    rows = []
    for name, curve in curves.items():
        costs = measured(curve)
        base = next(iter(costs.values())).scan
        rows += [
            (name, number(count), milliseconds(cost.scan), times(cost.scan / base))
            for count, cost in costs.items()
        ]
    return [
        Table(
            "Growth of the cost of a scan",
            ("with", "number", "one scan", "of the first row's"),
            rows,
            (
                f"A drive at 0.7 m/s along an office corridor with doors on both sides, three or four of them in "
                f"reach. {BEAMS} beams, 5 scans a second; by default 100 robot samples and 181 states of a door. "
                "Mean of the cheaper nine tenths of all scans, since in the dearest the whole building is "
                "searched; reading and writing excluded. Objects in view: a short corridor, 360° of beams.",
            ),
        ),
        objects_in_the_building(effort),
    ]


def objects_in_the_building(effort: Effort) -> Table:
    """The same drive, past the same doors, in ever larger buildings."""
    sizes = [size for size in (10, 100, 1_000, 10_000) if size <= effort.most_objects]
    buildings = {size: office(max(size // 100, 1), min(size // 2, 50)) for size in sizes}
    least = buildings[sizes[0]]
    drive = Drive(least, ajar(list(least.objects)), (6.0, 0.0), laser(BEAMS))
    records = drive.records(effort.scans)
    curve = {size: Setting(each, records, Settings()) for size, each in buildings.items()}
    costs = measured(curve)
    return Table(
        "Objects in the building",
        ("objects", "wall triangles", "first scan", "dearest", "one scan", "of the first row's"),
        [
            (
                f"{size:,}",
                f"{len(buildings[size].walls.faces):,}",
                milliseconds(cost.first),
                milliseconds(cost.dearest),
                milliseconds(cost.scan),
                times(cost.scan / costs[sizes[0]].scan),
            )
            for size, cost in costs.items()
        ],
        (
            "The same drive past the same doors, with more and more corridors elsewhere in the building. The "
            "first scan includes cutting the walls at the laser's height, the dearest a search of the whole "
            "building. One scan is the mean of the cheaper nine tenths of the rest.",
        ),
    )


def _robot_samples(count: int) -> Settings:
    return Settings(
        localization=LocalizationSettings(min_particles=count, max_particles=count),
    )


def _in_view(count: int, effort: Effort) -> Setting:
    building, everything = closets(count), closets(8)
    shut = {name: np.zeros(1) for name in everything.objects}
    rays = laser(BEAMS, 2.0 * np.pi)  # or those behind the robot wouldn't be in view
    drive = Drive(everything, shut | ajar(list(building.objects)), (-1.0, 0.0), rays)
    return Setting(building, drive.records(min(effort.scans, 15)), Settings())


def measured(curve: Mapping[int, Setting]) -> dict[int, Cost]:
    """What a scan costs at each point, the points taken in turns, the median of the rounds."""
    costs: dict[int, list[Cost]] = {count: [] for count in curve}
    for _ in range(ROUNDS):
        for count, setting in curve.items():
            costs[count].append(_driven(setting))
    return {
        count: Cost(
            median(each.first for each in all_),
            median(each.dearest for each in all_),
            median(each.scan for each in all_),
        )
        for count, all_ in costs.items()
    }


def _driven(setting: Setting) -> Cost:
    """Feed all records to a new estimator."""
    estimator = Estimator(setting.building, setting.settings, seed=1)
    taken, between = [], 0.0
    for record in setting.records:
        seconds = processor_time(lambda record=record: estimator.feed(record))
        between += seconds
        if isinstance(record, Scan):
            taken.append(between)
            between = 0.0
    later = np.sort(taken[WARM_UP:])
    return Cost(taken[0], float(later[-1]), float(later[: int(USUAL * len(later))].mean()))
