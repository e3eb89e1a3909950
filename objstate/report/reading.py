"""How a page writes figures, moments and durations."""

from __future__ import annotations

from datetime import UTC, datetime, tzinfo

from objstate.evaluation.units import UNITS


def figure(coordinate: str, value: float | None) -> str:
    """A state as people read it, with its unit."""
    if value is None:
        return "–"
    unit, factor, decimals = UNITS[coordinate]
    return f"{factor * value:z.{decimals}f}{'°' if unit == 'deg' else ' m'}"


def moment(stamp_ns: int, zone: tzinfo = UTC) -> str:
    """A stamp as a date and time by the clock of a zone."""
    return f"{datetime.fromtimestamp(stamp_ns / 1e9, zone):%Y-%m-%d %H:%M:%S %Z}"


def span(seconds: float) -> str:
    """A duration."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
