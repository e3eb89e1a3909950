"""``calibration.yaml``: corrected mountings and clocks, for people and for ``--calibration``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from objstate.calibration.calibration import Calibration, LaserCorrection
from objstate.config import Strict, load_yaml, parse_strict
from objstate.geometry import FloatArray, rotation_from_rpy, rpy_from_rotation, transform

DECIMALS = 6  # micrometres, microseconds, millionths of degrees

HEADER = """\
# Mountings and clocks of a robot's lasers, by objstate.
# mount: m and degrees in base_link; clock_offset: s by which stamps are ahead of the odometry's.
# Apply with: objstate estimate LOG --building URDF --out DIR --calibration THIS_FILE
# correction: difference to the log's own values; std: its standard deviation; corrections under
# not_told are not determined by the drive, and left out of mount and clock_offset.
"""


Finite = Annotated[float, Field(allow_inf_nan=False)]


class MountEntry(Strict):
    """Where a laser sits."""

    x: Finite  # m
    y: Finite
    z: Finite
    roll_deg: Finite
    pitch_deg: Finite
    yaw_deg: Finite


class Found(Strict):
    """Corrections, or their deviations."""

    x: Finite  # m
    y: Finite
    yaw_deg: Finite
    clock: Finite  # s


class LaserEntry(Strict):
    """One laser; only the first two are read."""

    mount: MountEntry
    clock_offset: Finite = 0.0  # s
    correction: Found | None = None
    std: Found | None = None
    not_told: tuple[str, ...] = ()


class CalibrationFile(Strict):
    """The whole file."""

    lasers: dict[str, LaserEntry]


def write_calibration(path: str | Path, calibration: Calibration) -> None:
    """Write the file; lasers by frame, in order."""
    Path(path).write_text(calibration_text(calibration.lasers), encoding="utf-8")


def calibration_text(lasers: Iterable[LaserCorrection]) -> str:
    """The file's content."""
    import yaml

    content = CalibrationFile(lasers={each.frame: _entry(each) for each in lasers})
    return HEADER + yaml.safe_dump(content.model_dump(mode="json"), sort_keys=False)


def read_calibration(path: str | Path) -> tuple[dict[str, FloatArray], dict[str, float]]:
    """Mountings (4, 4) and clock offsets (s) by frame, as ``RunOptions`` takes them.

    Raises SettingsError naming the place and the cure.
    """
    path = Path(path)
    found = parse_strict(CalibrationFile, load_yaml(path), str(path), "a calibration")
    mounts = {frame: _transform(entry.mount) for frame, entry in found.lasers.items()}
    return mounts, {frame: entry.clock_offset for frame, entry in found.lasers.items()}


def _entry(laser: LaserCorrection) -> LaserEntry:
    mount = laser.corrected_mount
    x, y, z = (round(float(value), DECIMALS) for value in mount[:3, 3])
    roll, pitch, yaw = (_degrees(angle) for angle in rpy_from_rotation(mount[:3, :3]))
    names = tuple(Found.model_fields)
    return LaserEntry(
        mount=MountEntry(x=x, y=y, z=z, roll_deg=roll, pitch_deg=pitch, yaw_deg=yaw),
        clock_offset=round(laser.corrected_clock_offset, DECIMALS),
        correction=_found(laser.correction),
        std=_found(laser.std),
        not_told=tuple(name for name, told in zip(names, laser.told, strict=True) if not told),
    )


def _found(values: FloatArray) -> Found:
    x, y, yaw, clock = (float(value) for value in values)
    return Found(
        x=round(x, DECIMALS),
        y=round(y, DECIMALS),
        yaw_deg=_degrees(yaw),
        clock=round(clock, DECIMALS),
    )


def _degrees(angle: float) -> float:
    return round(float(np.degrees(angle)), DECIMALS) + 0.0  # no minus zero


def _transform(mount: MountEntry) -> FloatArray:
    roll, pitch, yaw = np.radians([mount.roll_deg, mount.pitch_deg, mount.yaw_deg])
    rotation = rotation_from_rpy(float(roll), float(pitch), float(yaw))
    return transform(rotation, [mount.x, mount.y, mount.z])
