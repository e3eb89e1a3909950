"""``python -m benchmarks.independent.furniture``: where furniture is found in an office."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np
import polars as pl

from benchmarks.independent import log
from benchmarks.independent.drive import OdometryErrors, odometry
from benchmarks.independent.lasers import rig, scans
from benchmarks.independent.model import ModelErrors, moved_wall
from benchmarks.independent.office import (
    OfficeOptions,
    Stay,
    Thing,
    modelled,
    office,
    office_drive,
    urdf,
)
from benchmarks.independent.options import add_options, tasks_of
from benchmarks.independent.runner import Task, estimated, measure_all
from benchmarks.independent.scenarios import DEGREE, usual
from benchmarks.independent.shapes import Floats
from benchmarks.independent.simulator import made_once

GENERATOR = 1  # raise it whenever the same seed gives other files
SETTLED = 1.0  # s that a thing stands before its place counts
IN_VIEW = 5  # beams that end on a thing that is in view
SURE = 0.9  # probability from which something is believed
OFF, TURNED = 0.1, 10 * DEGREE  # m, rad; farther off is wrong
WIDEST_OFF, WIDEST_TURN = 0.2, 20 * DEGREE  # widest intervals of who is sure
HOLDS = 1.0  # s for which an estimate counts, if no other follows


@dataclass(frozen=True)
class Plan:
    """What an office drive is made of, besides its seed."""

    options: OfficeOptions = field(default_factory=OfficeOptions)
    errors: ModelErrors = field(default_factory=ModelErrors)


SCENARIOS = {
    "nothing": Plan(),
    "walls-2cm": Plan(errors=ModelErrors(wall=0.02, wall_turn=0.3 * DEGREE)),
    "sizes-2cm": Plan(OfficeOptions(wrong_size=0.02)),
    "crooked-1cm": Plan(OfficeOptions(crooked=0.01)),
    "lasers": Plan(errors=ModelErrors(laser_yaw=0.7 * DEGREE)),
    "far": Plan(OfficeOptions(off=0.3, turned=25 * DEGREE)),
    "gone": Plan(OfficeOptions(gone=5)),
    "moved": Plan(OfficeOptions(moves=4)),
    "clutter": Plan(OfficeOptions(clutter=8, walkers=2)),
    "all": Plan(
        OfficeOptions(
            gone=2, moves=3, clutter=6, walkers=2, wrong_size=0.01, crooked=0.005, off=0.15
        ),
        ModelErrors(wall=0.015, wall_turn=0.2 * DEGREE, laser_yaw=0.3 * DEGREE),
    ),
}


@dataclass(frozen=True)
class Final:
    """The last estimate of a thing where it stands."""

    name: str
    off: float  # m
    turned: float  # rad, modulo its symmetry
    inside: tuple[bool, bool, bool]  # x, y, yaw in 90 %
    presence: float


@dataclass(frozen=True)
class Times:
    """Seconds by what was believed of things in view."""

    wrong_place: float = 0.0  # sure of a wrong place, or of what isn't there
    denied: float = 0.0  # sure that what stands there doesn't
    all: float = 0.0


@dataclass(frozen=True)
class Outcome:
    """How a drive came out."""

    scenario: str
    seed: int
    finals: list[Final]
    gone: list[float]  # last presence of what was taken away
    times: Times


def simulated(scenario: str, seed: int, cache: Path) -> Path:
    """The folder of a drive, made if the cache doesn't hold it."""
    folder = cache / f"furniture-v{GENERATOR}" / scenario / str(seed)
    return made_once(folder, lambda into: _simulate(SCENARIOS[scenario], seed, into))


def _simulate(plan: Plan, seed: int, folder: Path) -> None:
    drive = office_drive(seed)
    true = office(seed, plan.options, drive.duration)
    rng = np.random.default_rng([seed, 61])
    lasers = rig(usual(seed))
    mounts = [np.array([laser.x, laser.y, laser.yaw]) for laser in lasers]
    lasers = [
        replace(laser, yaw=laser.yaw + plan.errors.laser_yaw * rng.standard_normal())
        for laser in lasers
    ]
    readings = scans(seed, true, drive, lasers)
    wheels = odometry(seed, drive, OdometryErrors())
    log.write_log(folder / "log.mcap", seed, drive, wheels, lasers, mounts, readings)
    log.write_path(folder / "path.tum", drive)
    log.write_seen(folder / "seen.npz", readings)
    errors = np.random.default_rng([seed, 11])
    walls = [moved_wall(each, errors.standard_normal(3), plan.errors) for each in true.walls]
    drawn = modelled(seed, true.things, plan.options.wrong_size)
    (folder / "building.urdf").write_text(urdf(walls, drawn), encoding="utf-8")
    facts = {
        "end": drive.duration,
        "things": [
            {"name": t.name, "order": t.order, "stays": [[s.begin, s.pose] for s in t.stays]}
            for t in true.things
        ],
    }
    (folder / "facts.json").write_text(json.dumps(facts, indent=1), encoding="utf-8")


def measured(scenario: str, seed: int, drive: Path, table: Path) -> Outcome:
    """A table of estimates against the truth of its drive."""
    facts = json.loads((drive / "facts.json").read_text(encoding="utf-8"))
    seen = np.load(drive / "seen.npz")
    rows = pl.read_parquet(table)
    finals: list[Final] = []
    gone: list[float] = []
    times = np.zeros(3)
    for number, fact in enumerate(facts["things"]):
        thing = Thing(
            fact["name"],
            (),
            fact["order"],
            (0.0, 0.0, 0.0),
            tuple(
                Stay(begin, None if pose is None else tuple(pose)) for begin, pose in fact["stays"]
            ),
        )
        views = (seen["stamps"][seen["beams"][:, number] >= IN_VIEW] - log.START_NS) / 1e9
        of_thing = _Rows.of(rows, thing.name)
        if of_thing is None:
            continue
        ends = [stay.begin for stay in thing.stays[1:]] + [facts["end"] + 1.0]
        for stay, end in zip(thing.stays, ends, strict=True):
            counted = np.flatnonzero(
                (of_thing.times >= stay.begin + SETTLED) & (of_thing.times < end)
            )
            if len(counted) == 0:
                continue
            if stay.pose is None:
                if end - stay.begin > 10.0:
                    gone.append(float(of_thing.presence[counted[-1]]))
            elif ((views >= stay.begin + SETTLED) & (views < end)).any():
                off, turned, inside = of_thing.compared(counted[-1:], stay.pose, thing.order)
                finals.append(
                    Final(
                        thing.name,
                        float(off[0]),
                        float(turned[0]),
                        tuple(inside[0].tolist()),
                        float(of_thing.presence[counted[-1]]),
                    )
                )
            times += _times(of_thing, counted, stay, thing.order, views)
    return Outcome(scenario, seed, finals, gone, Times(*times.tolist()))


@dataclass(frozen=True)
class _Rows:
    """The rows of a thing that scans bore on."""

    times: Floats  # (n,) s
    states: Floats  # (n, 3)
    lower: Floats
    upper: Floats
    presence: Floats  # (n,)

    @staticmethod
    def of(rows: pl.DataFrame, name: str) -> _Rows | None:
        own = rows.filter(pl.col("object") == name)
        if "observed" in own.columns:
            own = own.filter("observed")
        parts = [own.filter(pl.col("coordinate") == c).sort("stamp") for c in ("x", "y", "yaw")]
        if len(parts[0]) == 0:
            return None
        of = {
            column: np.column_stack([part[column].to_numpy() for part in parts])
            for column in ("median", "lower", "upper")
        }
        times = (parts[0]["stamp"].to_numpy() - log.START_NS) / 1e9
        presence = parts[0]["presence"].to_numpy()
        return _Rows(times, of["median"], of["lower"], of["upper"], presence)

    def compared(
        self, chosen: np.ndarray, pose: Sequence[float], order: int
    ) -> tuple[Floats, Floats, np.ndarray]:
        """How far off and turned some rows are, and which coordinates are in 90 % (n, 3)."""
        off = self.states[chosen] - np.asarray(pose)
        part = 2 * np.pi / order
        fold = part * np.round(off[:, 2] / part)
        low, high = self.lower[chosen] - np.asarray(pose), self.upper[chosen] - np.asarray(pose)
        for each in (low, high):
            each[:, 2] -= fold
        return (
            np.hypot(off[:, 0], off[:, 1]),
            np.abs(off[:, 2] - fold),
            (low <= 0.0) & (high >= 0.0),
        )


def _times(rows: _Rows, counted: np.ndarray, stay: Stay, order: int, views: Floats) -> Floats:
    """Seconds of a stay that were sure of a wrong place, sure of absence, and all."""
    holding = np.minimum(np.diff(rows.times[counted], append=rows.times[counted[-1]]), HOLDS)
    present = rows.presence[counted]
    if stay.pose is None:
        wrong = present > SURE
        return np.array([holding[wrong].sum(), 0.0, holding.sum()])
    off, turned, inside = rows.compared(counted, stay.pose, order)
    width = (rows.upper - rows.lower)[counted]
    misplaced = (off > OFF) & ~inside[:, :2].all(1) & (width[:, :2] < WIDEST_OFF).all(1)
    misturned = (turned > TURNED) & ~inside[:, 2] & (width[:, 2] < WIDEST_TURN)
    wrong = (present > SURE) & (misplaced | misturned)
    at = rows.times[counted]
    near = np.array([bool((np.abs(views - time) < 0.5).any()) for time in at])
    denied = (present < 1 - SURE) & near
    return np.array([holding[wrong].sum(), holding[denied].sum(), holding.sum()])


def run(task: Task) -> list[Outcome]:
    """Simulate a drive unless the cache holds it, estimate it, and measure the result."""
    scenario, seed = task.scenario, task.seed
    drive = simulated(scenario, seed, task.cache)
    tables = (scenario, "estimates.parquet"), (f"{scenario}, smoothed", "smoothed.parquet")
    return estimated(
        task,
        drive,
        lambda out, _: [measured(name, seed, drive, out / table) for name, table in tables],
    )


COLUMNS = (
    "scenario",
    "finals",
    "off (cm): median, 95 %, largest",
    "turned (deg): median, 95 %, largest",
    "x, y, yaw in 90 %",
    "within 3 cm, 3 deg",
    "presence: mean of those there, of those gone",
    "sure and wrong; denied",
)


def row(name: str, outcomes: Sequence[Outcome]) -> str:
    """One row of the table."""
    finals = [final for each in outcomes for final in each.finals]
    gone = [presence for each in outcomes for presence in each.gone]
    off = 100 * np.array([final.off for final in finals])
    turned = np.degrees([final.turned for final in finals])
    inside = 100 * np.array([final.inside for final in finals]).mean(0)
    wrong = sum(each.times.wrong_place for each in outcomes)
    denied = sum(each.times.denied for each in outcomes)
    whole = sum(each.times.all for each in outcomes)
    there = np.mean([final.presence for final in finals])
    cells = [
        name,
        str(len(finals)),
        f"{np.median(off):.1f}, {np.quantile(off, 0.95):.1f}, {off.max():.1f}",
        f"{np.median(turned):.1f}, {np.quantile(turned, 0.95):.1f}, {turned.max():.1f}",
        ", ".join(f"{each:.0f}" for each in inside) + " %",
        f"{100 * np.mean((off <= 3.0) & (turned <= 3.0)):.0f} %",
        f"{there:.2f}, {np.mean(gone):.2f}" if gone else f"{there:.2f}, –",
        f"{100 * wrong / whole:.1f}; {100 * denied / whole:.1f} %",
    ]
    return "| " + " | ".join(cells) + " |"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; 1 if a drive failed."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.independent.furniture",
        description="Where furniture is found, on drives of an independent simulator.",
    )
    add_options(parser, SCENARIOS)
    given = parser.parse_args(arguments)
    outcomes, failures = measure_all(run, tasks_of(given), given.jobs)
    if given.json:
        given.json.parent.mkdir(parents=True, exist_ok=True)
        given.json.write_text(json.dumps([asdict(each) for each in outcomes]), encoding="utf-8")
    print("| " + " | ".join(COLUMNS) + " |\n" + "|" + " --- |" * len(COLUMNS))
    for name in dict.fromkeys(each.scenario for each in outcomes):
        print(row(name, [each for each in outcomes if each.scenario == name]))
    for failure in failures:
        print(f"failed: {failure}", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
