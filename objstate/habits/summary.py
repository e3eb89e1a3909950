"""Habits in figures: where a door is by the hour of a working and of a free day, and how often it is moved."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import date, datetime, timedelta

import numpy as np

from objstate.geometry import FloatArray
from objstate.habits.calendar import CELL_S, FREE, NANOSECONDS, WARM, WORKING, Calendar
from objstate.habits.forecast import Forecast
from objstate.habits.moves import Moves

LEVEL = 0.9  # of intervals
KIND_NAMES = {WORKING: "working", FREE: "free"}
COLD_NAME, WARM_NAME = "cold", "warm"
HOUR_NS = 3600 * NANOSECONDS
PER_HOUR = 3600 // CELL_S


@dataclass(frozen=True)
class Figure:
    """A median and the central 90 %."""

    value: float
    lower: float
    upper: float

    @staticmethod
    def of(draws: FloatArray) -> Figure:
        """Of draws (d,)."""
        tail = (1.0 - LEVEL) / 2.0
        lower, value, upper = np.quantile(draws, [tail, 0.5, 1.0 - tail])
        return Figure(float(value), float(lower), float(upper))


@dataclass(frozen=True)
class HourHabit:
    """What a door does in an hour of a kind of day."""

    kind: str  # working or free
    hour: int  # by the building's clock
    shares: tuple[Figure, ...]  # of the time in each region
    moves_per_hour: Figure  # from region to region


@dataclass(frozen=True)
class WeekHabit:
    """What a door does in a week without holidays, of one season."""

    shares: tuple[Figure, ...]  # of the time in each region
    moves_per_day: Figure
    hours: tuple[HourHabit, ...]
    season: str | None = None  # cold or warm; None: there are no seasons

    def moved_as(self, other: WeekHabit) -> WeekHabit:
        """The week with the moves of another one."""
        hours = (
            replace(own, moves_per_hour=each.moves_per_hour)
            for own, each in zip(self.hours, other.hours, strict=True)
        )
        return replace(self, moves_per_day=other.moves_per_day, hours=tuple(hours))


def season_of(calendar: Calendar, day: date) -> str | None:
    """The season of a date; None where there are none."""
    return (WARM_NAME if calendar.is_warm(day) else COLD_NAME) if calendar.seasons else None


def week_habit(forecast: Forecast, since: date) -> WeekHabit:
    """A usual week of the season of a date, hour by hour, whatever is known of the door's state."""
    season = season_of(forecast.calendar, since)
    forecast = replace(forecast, calendar=forecast.calendar.usual(since))
    monday = since - timedelta(days=since.weekday())
    by_kind: dict[tuple[int, int], list[tuple[FloatArray, FloatArray]]] = {}
    for day in range(7):
        local = datetime.combine(monday + timedelta(days=day), datetime.min.time())
        begin = int(local.replace(tzinfo=forecast.calendar.zone).timestamp()) * NANOSECONDS
        kind = FREE if day >= 5 else WORKING
        for hour in range(24):
            found = [_at(forecast, begin + hour * HOUR_NS + k * HOUR_NS // 4) for k in (1, 3)]
            mean = tuple(np.mean([each[k] for each in found], axis=0) for k in (0, 1))
            by_kind.setdefault((kind, hour), []).append((mean[0], mean[1]))
    every = [each for some in by_kind.values() for each in some]
    hours = []
    for (kind, hour), some in sorted(by_kind.items()):
        shares, moves = (np.mean([each[k] for each in some], axis=0) for k in (0, 1))
        hours.append(HourHabit(KIND_NAMES[kind], hour, _figures(shares), Figure.of(moves)))
    shares, moves = (np.mean([each[k] for each in every], axis=0) for k in (0, 1))
    return WeekHabit(_figures(shares), Figure.of(24.0 * moves), tuple(hours), season)


def week_moves(moves: Moves, since: date) -> WeekHabit:
    """A usual week of the season of a date, of something that is moved and has no regions."""
    rates, warm = moves.rates, WARM if moves.calendar.is_warm(since) else 0
    by_hour = rates.reshape(len(rates), -1, 24, PER_HOUR).mean(axis=3) * 3600.0  # (d, kinds, 24)
    days = (5 * by_hour[:, WORKING + warm] + 2 * by_hour[:, FREE + warm]) / 7.0
    hours = [
        HourHabit(KIND_NAMES[kind], hour, (), Figure.of(by_hour[:, kind + warm, hour]))
        for kind in (WORKING, FREE)
        for hour in range(24)
    ]
    season = season_of(moves.calendar, since)
    return WeekHabit((), Figure.of(days.sum(axis=1)), tuple(hours), season)


def _at(forecast: Forecast, stamp_ns: int) -> tuple[FloatArray, FloatArray]:
    """(d, r) shares of the regions at a moment, and (d,) moves an hour."""
    state = forecast.marginal(stamp_ns)
    key = forecast.calendar.key_at(stamp_ns)
    moves = (state * forecast.leaving[:, key]).sum(axis=1) * 3600.0
    return state[:, 0::2] + state[:, 1::2], moves


def _figures(shares: FloatArray) -> tuple[Figure, ...]:
    return tuple(Figure.of(each) for each in shares.T)
