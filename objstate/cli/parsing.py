"""What people type as option values: poses, mountings, topics."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from fractions import Fraction
from typing import TYPE_CHECKING

from objstate.errors import SettingsError

if TYPE_CHECKING:
    from objstate.geometry import FloatArray

POSE = "X,Y,YAW (m, m, rad; or YAW in degrees as in 90deg)"
MOUNT = "FRAME=x,y,z,roll,pitch,yaw (m and rad; or angles in degrees as in 180deg)"
CLOCK_OFFSET = "FRAME=SECONDS (as in laser=0.03)"

END_OF_TIME_S = 2**33  # s; nanoseconds since then fit into 64 bits
TIME = "'now', a time as in 2026-11-21T12:00 (UTC, or with +01:00), or seconds since 1970"


def parse_pose(text: str, option: str = "--initial-pose") -> FloatArray:
    """The pose (3,) that an option gives. Raises SettingsError."""
    from objstate.geometry import pose_from_text

    try:
        return pose_from_text(text)
    except ValueError as error:
        raise SettingsError(f"{option} '{text}' is not a pose; give {POSE}.") from error


def parse_mounts(texts: Sequence[str]) -> dict[str, FloatArray]:
    """Transforms (4, 4), laser in ``base_link``, by frame, of all ``--mount``. Raises SettingsError."""
    return dict(_mount(text) for text in texts)


def parse_clock_offsets(texts: Sequence[str]) -> dict[str, float]:
    """Seconds by which lasers' clocks are ahead, by frame, of all ``--clock-offset``. Raises SettingsError."""
    return dict(_clock_offset(text) for text in texts)


def check_span(start: float | None, end: float | None) -> None:
    """Raises SettingsError unless ``--from`` and ``--to``, where given, leave something between them."""
    from objstate.logs.log import EPOCH_FROM

    for option, value in (("--from", start), ("--to", end)):
        if value is not None and not math.isfinite(value):
            raise SettingsError(f"{option} {value} must be a finite number.")
    if start is None or end is None:
        return
    on_one_clock = (start >= EPOCH_FROM) == (end >= EPOCH_FROM)
    if on_one_clock and start >= end:
        raise SettingsError(f"--from {start:.15g} must come before --to {end:.15g}.")


def check_height(height: float) -> None:
    """Raises SettingsError for a ``--height`` that is none."""
    if not math.isfinite(height):
        raise SettingsError(f"--height {height} must be a finite number of metres.")


def parse_time(text: str) -> int:
    """The nanoseconds since 1970 that a time means. Raises SettingsError."""
    if text == "now":
        return time.time_ns()
    try:
        if abs(float(text)) < END_OF_TIME_S:
            return round(Fraction(text) * 10**9)
    except ValueError:
        pass
    try:
        when = datetime.fromisoformat(text)
        told = when if when.tzinfo is not None else when.replace(tzinfo=UTC)
        return round(Fraction(told.timestamp()) * 10**9)
    except (ValueError, OverflowError) as error:
        raise SettingsError(f"'{text}' is not a time; give {TIME}.") from error


def split_topics(texts: Sequence[str]) -> list[str] | None:
    """The topics that ``--topics`` name, repeated or with commas; None where there are none."""
    topics = [topic.strip() for text in texts for topic in text.split(",") if topic.strip()]
    return topics or None


def _mount(text: str) -> tuple[str, FloatArray]:
    from objstate.geometry import angle_from_text, finite, rotation_from_rpy, transform

    frame, _, numbers = text.partition("=")
    try:
        x, y, z, roll, pitch, yaw = numbers.split(",")
        rotation = rotation_from_rpy(*map(angle_from_text, (roll, pitch, yaw)))
        mount = transform(rotation, [finite(x), finite(y), finite(z)])
    except ValueError as error:
        raise SettingsError(f"--mount '{text}' is not a mounting; give {MOUNT}.") from error
    if not frame.strip():
        raise SettingsError(f"--mount '{text}' names no frame; give {MOUNT}.")
    return frame.strip(), mount


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
