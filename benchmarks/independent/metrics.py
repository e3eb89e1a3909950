"""How good a drive's estimates are: one record a drive, which pools with others.

All angles in records are degrees, and all times seconds.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

SECOND = 10**9  # ns
TOUCHES = 1e-4  # rad; an interval this near the truth holds it
SURE = 10.0  # deg, an interval narrower than this
WRONG = 5.0  # deg
HELD = 1.0  # s that an estimate counts for at most, where no other follows
AFTER_END = 3.0  # s after the end of a movement, when its value is asked for
MOVING = 0.1  # s; the truth of a door that moves has a row each 0.05 s
BEAMS_IN_VIEW = 5  # that end on a leaf
VIEW_LASTS = 0.5  # s around a scan that sees the leaf
AJAR = 6.0  # deg; a door open by no more than this is ajar
SETTLED = 5.0  # s after the start, from when on the robot's path counts
LOCALIZED = 0.5  # m off at most


@dataclass(frozen=True)
class Door:
    """The truth about one door."""

    stamps: Ints  # (k,) ns
    angles: Floats  # (k,) rad; each holds from its stamp on
    limits: tuple[float, float]  # rad
    view_stamps: Ints  # (s,) ns, sorted; scans in which at least BEAMS_IN_VIEW end on its leaf

    def at(self, stamps: Ints) -> Floats:
        """True angles at stamps."""
        index = np.searchsorted(self.stamps, stamps, side="right") - 1
        return self.angles[np.maximum(index, 0)]

    def moving(self, stamps: Ints) -> Bools:
        """Whether the true angle changes within MOVING of each stamp."""
        changes = self.stamps[1:]
        near = round(MOVING * SECOND)
        return np.searchsorted(changes, stamps - near) < np.searchsorted(changes, stamps + near)

    def at_limit(self, angles: Floats) -> Bools:
        """Whether true angles are exactly a limit, to within the files' decimals."""
        low, high = self.limits
        return (np.abs(angles - low) < 1e-6) | (np.abs(angles - high) < 1e-6)

    def closed(self, angles: Floats) -> Bools:
        """Whether true angles are exactly the lower limit."""
        return np.abs(angles - self.limits[0]) < 1e-6

    def in_view(self, stamps: Ints) -> Bools:
        """Whether a scan near each stamp sees the leaf."""
        if len(self.view_stamps) == 0:
            return np.zeros(len(stamps), np.bool_)
        after = np.searchsorted(self.view_stamps, stamps)
        gaps = [
            np.abs(self.view_stamps[np.clip(after - side, 0, len(self.view_stamps) - 1)] - stamps)
            for side in (0, 1)
        ]
        return np.minimum(*gaps) <= VIEW_LASTS * SECOND


@dataclass(frozen=True)
class Estimates:
    """What was estimated of one door: rows that scans bore on, by time."""

    stamps: Ints  # (n,) ns
    values: Floats  # (n,) rad
    lower: Floats
    upper: Floats
    p_closed: Floats | None = None  # (n,)

    def before(self, stamp: int) -> int | None:
        """The last row at or before a stamp."""
        index = int(np.searchsorted(self.stamps, stamp, side="right")) - 1
        return index if index >= 0 else None


@dataclass(frozen=True)
class Value:
    """One estimate beside its truth."""

    door: str
    stamp: int  # ns
    truth: float  # deg
    error: float  # deg, without its sign
    width: float  # deg, of the 90 % interval
    inside: bool
    at_limit: bool


@dataclass(frozen=True)
class Durations:
    """A share of time that pools: so much of so much."""

    part: float = 0.0  # s
    whole: float = 0.0  # s

    def __add__(self, other: Durations) -> Durations:
        """Both together."""
        return Durations(self.part + other.part, self.whole + other.whole)

    @property
    def share(self) -> float:
        """Part of the whole; NaN of nothing."""
        return self.part / self.whole if self.whole > 0.0 else float("nan")


@dataclass(frozen=True)
class Robot:
    """How far off the robot's own path is."""

    error: float  # m, mean while localized; NaN if it never is
    localized: Durations


def final_values(truth: Mapping[str, Door], estimates: Mapping[str, Estimates]) -> list[Value]:
    """The last estimate of every door that was ever observed, beside the truth at its time.

    A door that was moving then has no final angle.
    """
    return [
        _value(name, truth[name], rows, len(rows.stamps) - 1, int(rows.stamps[-1]))
        for name, rows in sorted(estimates.items())
        if len(rows.stamps) and not truth[name].moving(rows.stamps[-1:])[0]
    ]


def values_after_ends(
    truth: Mapping[str, Door],
    estimates: Mapping[str, Estimates],
    ends: Iterable[tuple[str, int]],
) -> list[Value]:
    """The values 3 s after each end of a movement, of doors that are in view then.

    A door that moves again within these seconds, or was never estimated, is left out.
    """
    values = []
    for name, end in ends:
        door, asked = truth[name], end + round(AFTER_END * SECOND)
        rested = door.at(np.array([end, asked]))
        moved = bool(((door.stamps > end) & (door.stamps <= asked)).any())
        if name not in estimates or moved or rested[0] != rested[1]:
            continue
        index = estimates[name].before(asked)
        if index is not None and door.in_view(np.array([asked]))[0]:
            values.append(_value(name, door, estimates[name], index, asked))
    return values


def _value(name: str, door: Door, rows: Estimates, index: int, asked: int) -> Value:
    """A row beside the truth at the stamp that is asked for."""
    at = slice(index, index + 1)
    truth = door.at(np.array([asked]))
    return Value(
        door=name,
        stamp=asked,
        truth=float(np.degrees(truth[0])),
        error=float(np.degrees(np.abs(rows.values[at] - truth)[0])),
        width=float(np.degrees((rows.upper[at] - rows.lower[at])[0])),
        inside=bool(_inside(rows.lower[at], truth, rows.upper[at])[0]),
        at_limit=bool(door.at_limit(truth)[0]),
    )


def _inside(lower: Floats, truth: Floats, upper: Floats) -> Bools:
    return (lower <= truth + TOUCHES) & (truth <= upper + TOUCHES)


def holding_times(stamps: Ints, end: int) -> Floats:
    """How long each row is the latest (n,) s: up to the next or the end, at most HELD."""
    until = np.append(stamps[1:], max(end, int(stamps[-1]))) if len(stamps) else stamps
    return np.minimum((until - stamps) / SECOND, HELD)


def sure_and_wrong(
    truth: Mapping[str, Door], estimates: Mapping[str, Estimates], end: int
) -> Durations:
    """Time in which estimates are over 5 deg off, outside an interval narrower than 10 deg."""
    total = Durations()
    for name, rows in estimates.items():
        true = truth[name].at(rows.stamps)
        wrong = np.abs(rows.values - true) > np.radians(WRONG)
        wrong &= rows.upper - rows.lower < np.radians(SURE)
        wrong &= ~_inside(rows.lower, true, rows.upper)
        times = holding_times(rows.stamps, end)
        total += Durations(float(times[wrong].sum()), float(times.sum()))
    return total


def misclassified(
    truth: Mapping[str, Door],
    estimates: Mapping[str, Estimates],
    end: int,
    largest: float = float("inf"),
) -> Durations | None:
    """Time in which p_closed > 0.5 and the truth disagree, of doors in view; None without p_closed.

    Only while the true angle is at most ``largest``, in degrees.
    """
    if not any(rows.p_closed is not None for rows in estimates.values()):
        return None
    total = Durations()
    for name, rows in estimates.items():
        if rows.p_closed is None:
            continue
        door, true = truth[name], truth[name].at(rows.stamps)
        asked = door.in_view(rows.stamps) & (true <= np.radians(largest))
        wrong = (rows.p_closed > 0.5) != door.closed(true)
        times = holding_times(rows.stamps, end)
        total += Durations(float(times[asked & wrong].sum()), float(times[asked].sum()))
    return total


def robot(
    stamps: Ints,
    positions: Floats,
    true_stamps: Ints,
    true_positions: Floats,
    lost: Sequence[tuple[int, int]] = (),
) -> Robot:
    """Estimated positions (n, 2) against the true path, from SETTLED after its start on.

    Localized is who is within LOCALIZED and isn't said to be lost.
    """
    counted = stamps >= true_stamps[0] + SETTLED * SECOND
    stamps, positions = stamps[counted], positions[counted]
    at = (stamps - true_stamps[0]) / SECOND
    along = (true_stamps - true_stamps[0]) / SECOND
    true = np.column_stack([np.interp(at, along, column) for column in true_positions.T])
    off = np.hypot(*(positions - true).T)
    localized = off <= LOCALIZED
    for begin, until in lost:
        localized &= ~((stamps >= begin) & (stamps <= until))
    times = holding_times(stamps, int(true_stamps[-1]))
    error = float(off[localized].mean()) if localized.any() else float("nan")
    return Robot(error, Durations(float(times[localized].sum()), float(times.sum())))
