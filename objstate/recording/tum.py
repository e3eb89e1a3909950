"""Robot paths in the TUM format: ``stamp tx ty tz qx qy qz qw`` a line, stamps in seconds."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np

from objstate.errors import ResultError, TruthError
from objstate.geometry import pose_from_transform, rotation_from_quaternion, transform
from objstate.kinds import PATH, instead
from objstate.recording.stamps import unit_of_number
from objstate.records import Path as RobotPath

TRAJECTORY = "trajectory.tum"  # in a result folder: the estimated path
LONGEST_STAMP = 30  # digits: more are no time in any unit
FIELDS = "stamp tx ty tz qx qy qz qw"


def write_tum(path: str | Path, robot: RobotPath) -> None:
    """Write plane poses, to the nanosecond and a tenth of a micrometre."""
    with Path(path).open("w", encoding="ascii", newline="\n") as file:
        file.write(f"# {FIELDS}\n")
        for stamp, (x, y, yaw) in zip(robot.stamps_ns.tolist(), robot.poses, strict=True):
            qz, qw = np.sin(yaw / 2), np.cos(yaw / 2)
            file.write(f"{seconds(stamp)} {x:.7f} {y:.7f} 0 0 0 {qz:.9f} {qw:.9f}\n")


def read_tum(path: str | Path) -> RobotPath:
    """Read a path; stamps are exact to the nanosecond, height, roll and pitch are left out.

    Raises TruthError for a file that can't be read, a line that isn't eight
    numbers, or stamps that go back.
    """
    if told := instead(path, PATH):
        raise TruthError(told)
    lines = _lines(Path(path))
    rows = [
        _row(text, f"{path}, line {number}")
        for number, text in enumerate(lines, start=1)
        if text.strip() and not text.lstrip().startswith("#")
    ]
    if not rows:
        raise TruthError(f"{path} holds no poses; a line of it reads '{FIELDS}'.")
    stamps = np.array([stamp for stamp, _ in rows], dtype=np.int64)
    back = np.flatnonzero(np.diff(stamps) < 0)
    if len(back):
        stamp = seconds(int(stamps[back[0] + 1]))
        raise TruthError(f"{path}: the stamps go back at {stamp}; sort the file by its stamps.")
    return RobotPath(stamps, np.array([pose for _, pose in rows]))


def read_path(folder: str | Path) -> RobotPath:
    """The estimated path of a result folder. Raises ResultError where there is none."""
    path = Path(folder) / TRAJECTORY
    if not path.is_file():
        raise ResultError(f"{folder} holds no {TRAJECTORY}; make it with `objstate estimate`.")
    return read_tum(path)


def seconds(stamp_ns: int) -> str:
    """A stamp in seconds with nine decimals, exactly."""
    whole, rest = divmod(abs(stamp_ns), 10**9)
    return f"{'-' if stamp_ns < 0 else ''}{whole}.{rest:09d}"


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise TruthError(f"Can't read the path {path}: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise TruthError(f"{path} is not text; a path is a TUM file: '{FIELDS}'.") from error


def _nanoseconds(stamp: Decimal) -> int:
    """Raises ValueError for what is none in 64 bits; rounding a larger number could take for ever."""
    if not stamp.is_finite() or stamp.adjusted() >= LONGEST_STAMP:
        raise ValueError(f"{stamp} is no time")
    return round(stamp * 10**9)


def _row(text: str, where: str) -> tuple[int, np.ndarray]:
    """Stamp in nanoseconds and pose (3,) of one line."""
    fields = text.split()
    if len(fields) != 8:
        hint = ", separated by blanks" if len(text.split(",")) == 8 else ""
        raise TruthError(f"{where} has {len(fields)} fields; give eight{hint}: '{FIELDS}'.")
    try:
        stamp = _nanoseconds(Decimal(fields[0]))
        x, y, z, *quaternion = (float(field) for field in fields[1:])
        matrix = transform(rotation_from_quaternion(*quaternion), [x, y, z])
    except (ArithmeticError, ValueError) as error:
        raise TruthError(f"{where}: '{text}' is not a pose; give '{FIELDS}'.") from error
    if np.isfinite(matrix).all() and abs(stamp) >= 2**63:
        unit, per_second = unit_of_number(Fraction(fields[0]))
        raise TruthError(
            f"{where}: the stamp {fields[0]} can't be seconds; if {unit} are meant, write "
            f"{Decimal(fields[0]) / per_second:f}, and so in every line."
        )
    if not np.isfinite(matrix).all():
        raise TruthError(f"{where}: '{text}' is not finite; give '{FIELDS}'.")
    return stamp, pose_from_transform(matrix)
