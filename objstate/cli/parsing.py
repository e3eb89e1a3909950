"""What people type as option values: poses, mountings, topics."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from datetime import UTC, datetime, tzinfo
from fractions import Fraction
from typing import TYPE_CHECKING

from objstate.errors import SettingsError

if TYPE_CHECKING:
    from objstate.geometry import FloatArray

POSE = "X,Y,YAW (m, m, rad; or YAW in degrees as in 90deg)"
MOUNT = "FRAME=x,y,z,roll,pitch,yaw (m and rad; or angles in degrees as in 180deg)"
CLOCK_OFFSET = "FRAME=SECONDS (as in laser=0.03)"

TIME = (
    "'now', a time as in 2026-11-21T12:00 (by the clock of the settings' calendar, or with +01:00), "
    "or seconds since 1970"
)

FARTHEST_MOUNT = 10.0  # m from a robot's middle to its laser; no robot in a building is so large
LATEST_TIME = 1e11  # s since 1970, the year 5138; a larger number isn't in seconds


def parse_pose(text: str, option: str = "--initial-pose") -> FloatArray:
    """The pose (3,) that an option gives. Raises SettingsError."""
    from objstate.geometry import pose_from_text

    try:
        return pose_from_text(text)
    except ValueError as error:
        raise SettingsError(f"{option} '{text}' is not a pose: {error}; give {POSE}.") from error


def parse_way(text: str, option: str = "--way") -> FloatArray:
    """Points (n, 2) m, as in ``3,0;3,2``. Raises SettingsError."""
    import numpy as np

    from objstate.geometry import finite

    try:
        points = [[finite(each) for each in part.split(",")] for part in text.split(";")]
        way = np.array(points, dtype=float)
        if way.ndim != 2 or way.shape[1] != 2:
            raise ValueError("each point has two numbers")
    except ValueError as error:
        raise SettingsError(f"{option} '{text}' is no way: {error}; give X,Y;X,Y (m).") from error
    return way


def parse_mounts(texts: Sequence[str]) -> dict[str, FloatArray]:
    """Transforms (4, 4) of lasers in ``base_link`` by frame, of all ``--mount``.

    Raises SettingsError.
    """
    return dict(_mount(text) for text in texts)


def parse_clock_offsets(texts: Sequence[str]) -> dict[str, float]:
    """Seconds by which lasers' clocks are ahead, by frame, of all ``--clock-offset``.

    Raises SettingsError.
    """
    return dict(_clock_offset(text) for text in texts)


def parse_zone(name: str) -> tzinfo:
    """The clock that ``--timezone`` names. Raises SettingsError."""
    from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, OSError) as error:
        raise SettingsError(
            f"--timezone '{name}' is not known; give one such as Europe/Berlin, or UTC."
        ) from error


def check_span(start: float | None, end: float | None) -> None:
    """Raises SettingsError unless ``--from`` is before ``--to``, where both are given."""
    from objstate.logs.span import EPOCH_FROM

    for option, value in (("--from", start), ("--to", end)):
        if value is not None and not math.isfinite(value):
            raise SettingsError(f"{option} {value} must be a finite number.")
        if value is not None:
            _check_seconds(Fraction(value), option)
    if start is None or end is None:
        return
    on_one_clock = (start >= EPOCH_FROM) == (end >= EPOCH_FROM)
    if on_one_clock and start >= end:
        raise SettingsError(f"--from {start:.15g} must come before --to {end:.15g}.")


def check_height(height: float) -> None:
    """Raises SettingsError for a ``--height`` that is none."""
    if not math.isfinite(height):
        raise SettingsError(f"--height {height} must be a finite number of metres.")


def parse_time(text: str, zone: tzinfo = UTC) -> int:
    """The nanoseconds since 1970 that a time, by the clock of a zone, means. Raises SettingsError."""
    if text == "now":
        return time.time_ns()
    try:
        is_number = math.isfinite(float(text))
    except ValueError:
        is_number = False
    if is_number:
        seconds = Fraction(text)
        _check_seconds(seconds, "The time")
        return round(seconds * 10**9)
    try:
        when = datetime.fromisoformat(text)
        told = when if when.tzinfo is not None else when.replace(tzinfo=zone)
        return round(Fraction(told.timestamp()) * 10**9)
    except (ValueError, OverflowError) as error:
        raise SettingsError(f"'{text}' is not a time; give {TIME}.") from error


def _check_seconds(value: Fraction, what: str) -> None:
    """Raises SettingsError for so large a number that another unit must be meant."""
    from objstate.recording.stamps import unit_of_number

    if abs(value) < LATEST_TIME:
        return
    unit, per_second = unit_of_number(abs(value))
    raise SettingsError(
        f"{what} {float(value):.15g} can't be seconds since 1970; if {unit} are meant, write "
        f"{float(value / per_second):.15g}."
    )


def split_topics(texts: Sequence[str]) -> list[str] | None:
    """The topics that ``--topics`` name, repeated or with commas; None where there are none."""
    topics = [topic.strip() for text in texts for topic in text.split(",") if topic.strip()]
    return topics or None


def _mount(text: str) -> tuple[str, FloatArray]:
    from objstate.geometry import angle_from_text, rotation_from_rpy, transform

    frame, _, numbers = text.partition("=")
    try:
        parts = numbers.split(",")
        if len(parts) != 6:
            raise ValueError(f"it has {len(parts)} numbers, not 6")
        rotation = rotation_from_rpy(*map(angle_from_text, parts[3:]))
        mount = transform(rotation, [_mounted_at(part) for part in parts[:3]])
    except ValueError as error:
        raise SettingsError(
            f"--mount '{text}' is not a mounting: {error}; give {MOUNT}."
        ) from error
    if not frame.strip():
        raise SettingsError(f"--mount '{text}' names no frame; give {MOUNT}.")
    return frame.strip(), mount


def _mounted_at(text: str) -> float:
    """A coordinate of a laser on the robot, m. Raises ValueError."""
    from objstate.geometry import finite

    value = finite(text)
    if abs(value) > FARTHEST_MOUNT:
        raise ValueError(
            f"no laser is mounted {value:g} m from the robot's middle; if millimetres are meant, "
            f"write {value / 1000:g}"
        )
    return value


def _clock_offset(text: str) -> tuple[str, float]:
    from objstate.geometry import finite

    frame, _, seconds = text.partition("=")
    try:
        ahead = finite(seconds)
    except ValueError as error:
        raise SettingsError(
            f"--clock-offset '{text}' is not an offset; give {CLOCK_OFFSET}."
        ) from error
    if not frame.strip():
        raise SettingsError(f"--clock-offset '{text}' names no frame; give {CLOCK_OFFSET}.")
    return frame.strip(), ahead
