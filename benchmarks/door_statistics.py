"""How often the intervals of door statistics hold the truth: ``python -m benchmarks.door_statistics [SEED...]``

On simulated doors with constant rates, on those of simulated offices, and on the door that ../shared/data records minute by minute
(skipped where it is missing), of which some minutes are picked at random.
"""

from __future__ import annotations

import sys
from datetime import UTC
from pathlib import Path

import numpy as np

from benchmarks.simulated_habits import BEGIN, corridor_door, office, store
from benchmarks.simulated_habits import DAY as MINUTES
from objstate.statistics.shares import share_open, shares_by
from objstate.statistics.two_state import LONGEST_MEMORY, SHORTEST_MEMORY, Interval, Looks, memory
from objstate.statistics.use import use_of

DAY = 86400.0
DOORS, DAYS, VISITS, LOOKS = 200, 30, 60, 5  # doors of each seed; looks of each visit, 2 s apart
RECORDED = Path(__file__).parents[2] / "shared/data/door-history/training_data.txt"
PER_DAY, PICKS = (2, 4, 8, 24), 20  # looks a day at the recorded door, each picked so often


def simulated(seed: int) -> dict[str, float]:
    """The share of doors whose intervals hold the truth."""
    rng = np.random.default_rng(seed)
    held: dict[str, list[bool]] = {}
    for _ in range(DOORS):
        share = float(np.sin(rng.uniform(0, np.pi / 2)) ** 2)
        rate = float(np.exp(rng.uniform(-np.log(LONGEST_MEMORY), -np.log(SHORTEST_MEMORY))))
        visits = np.sort(rng.uniform(0, DAYS * DAY, VISITS))
        times = np.sort((visits[:, None] + np.arange(LOOKS) * 2.0).ravel())
        looks = Looks((times * 1e9).astype(np.int64), states(share, rate, times, rng))
        door = memory(looks.summed(), rng)
        for name, interval, true in (
            ("open spell", door.open_spell, 1 / (rate * (1 - share))),
            ("closed spell", door.closed_spell, 1 / (rate * share)),
            ("share of an hour", share_open(0, looks.summed(), door).share, share),
        ):
            held.setdefault(name, []).append(holds(interval, true))
    return {name: float(np.mean(each)) for name, each in held.items()}


def planned(seed: int, per_day: int) -> dict[str, float]:
    """The same of doors of a building whose days are planned, seen ``per_day`` times a day."""
    rng = np.random.default_rng(seed)
    doors = [kind(rng) for kind in (*(office,) * 8, *(store,) * 3, corridor_door)]
    held: dict[str, list[bool]] = {}
    for door in doors:
        days = len(door) // MINUTES
        picked = np.sort(rng.choice(len(door), per_day * days, replace=False))
        looks = Looks((BEGIN + 60 * picked) * 10**9, door[picked].astype(bool))
        use = use_of(looks.summed(), UTC)
        moves = float(np.count_nonzero(np.diff(door)) / days)
        held.setdefault("share of all time", []).append(holds(use.share_open, float(door.mean())))
        held.setdefault("moves a day", []).append(holds(use.moves_per_day, moves))
    return {name: float(np.mean(each)) for name, each in held.items()}


def states(share: float, rate: float, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Whether a door that opens and closes at constant rates is open at ``times``."""
    open_, before, seen = bool(rng.random() < share), times[0], []
    for time in times:
        kept = np.exp(-rate * (time - before))
        open_, before = bool(rng.random() < share + (open_ - share) * kept), time
        seen.append(open_)
    return np.array(seen)


def recorded(per_day: int, *, office: bool) -> dict[str, float]:
    """The same of the recorded door, seen ``per_day`` times a day, or on working days from 8 to 18 h."""
    stamps, values = np.loadtxt(RECORDED, dtype=np.int64).T
    open_, hour = values.astype(bool), (stamps // 3600) % 24
    days = len(stamps) * 60 / DAY
    seen = np.ones(len(stamps), dtype=bool)
    if office:
        seen = (hour >= 8) & (hour < 18) & ((stamps // 86400 + 3) % 7 < 5)
    moves = float(np.count_nonzero(np.diff(values)) / days)
    held: dict[str, list[bool]] = {}
    for seed in range(PICKS):
        rng = np.random.default_rng(seed)
        count = int(per_day * days * (5 / 7 if office else 1))
        picked = np.sort(rng.choice(np.flatnonzero(seen), count, replace=False))
        looks = Looks(stamps[picked] * 10**9, open_[picked])
        use, door = use_of(looks.summed(), UTC), memory(looks.summed(), np.random.default_rng(0))
        for name, interval, true in (
            ("share of all time", use.share_open, float(open_.mean())),
            ("share of hours seen", use.share_open_seen, float(open_[seen].mean())),
            ("moves a day", use.moves_per_day, moves),
        ):
            held.setdefault(name, []).append(holds(interval, true))
        for cell in shares_by(looks.summed(), door, lambda time: time.hour, UTC):
            true = float(open_[(hour == cell.key) & seen].mean())
            held.setdefault("share of an hour", []).append(holds(cell.share, true))
    return {name: float(np.mean(each)) for name, each in held.items()}


def holds(interval: Interval, true: float) -> bool:
    """Whether the truth lies inside."""
    return interval.lower <= true <= interval.upper


def told(label: str, shares: dict[str, float]) -> None:
    """Print a line."""
    print(f"{label}: " + ", ".join(f"{name} {100 * each:.0f} %" for name, each in shares.items()))


if __name__ == "__main__":
    for argument in sys.argv[1:] or ["1", "2"]:
        told(f"simulated, seed {argument}", simulated(int(argument)))
        told(f"offices, 4 looks a day, seed {argument}", planned(int(argument), 4))
    if RECORDED.exists():
        for looks_a_day in PER_DAY:
            for office, when in ((False, "at any hour"), (True, "on working days from 8 to 18 h")):
                label = f"recorded, {looks_a_day} looks a day {when}"
                told(label, recorded(looks_a_day, office=office))
    else:
        print(f"skipped: {RECORDED} is missing")
