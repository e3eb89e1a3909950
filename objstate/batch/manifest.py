"""A manifest: a table with a log per row, and what is special about it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from objstate.batch.addresses import absolute, refuse_many
from objstate.config import load_settings
from objstate.errors import SettingsError
from objstate.geometry import FloatArray, pose_from_text
from objstate.kinds import other_separator
from objstate.recording.batches import BatchLog
from objstate.run import RunOptions
from objstate.spelling import nearest
from objstate.storage import here, is_remote, parent

if TYPE_CHECKING:
    import polars as pl

COLUMNS = (
    "log", "name", "building", "truth", "path", "settings", "initial_pose", "global", "seed", "robot",
)  # fmt: skip
ENDINGS = (".csv", ".parquet")
POSE = "x,y,yaw in metres and radians, or yaw in degrees as in '3.2,-1,90deg'"
NAME = re.compile(r"[\w-][\w.-]*")
LONGEST_SEED = 30  # digits; a generator takes no more than 128 bits in
YES, NO = ("true", "yes", "1"), ("false", "no", "0")


def is_manifest(source: str) -> bool:
    """Whether a source is a manifest rather than logs: by its name."""
    return source.lower().endswith(ENDINGS)


def read_manifest(
    source: str, building: str | None, options: RunOptions
) -> list[tuple[BatchLog, RunOptions]]:
    """The logs of a manifest with their options; paths in it are relative to its folder.

    ``building`` and ``options`` serve where a row says nothing. Raises SettingsError,
    which names the row.
    """
    copy = str(here(source))
    table = _read(copy)
    _check_columns(copy, table.columns)
    rows = []
    for number, row in enumerate(table.iter_rows(named=True), start=1):
        cells = {key: str(value).strip() for key, value in row.items() if value is not None}
        filled = {key: value for key, value in cells.items() if value}
        rows.append(
            _row(filled, f"{source}, row {number}", parent(absolute(source)), building, options)
        )
    return rows


def _read(source: str) -> pl.DataFrame:
    import polars as pl

    try:
        if source.lower().endswith(".parquet"):
            return pl.read_parquet(source)
        return pl.read_csv(source, infer_schema=False)
    except OSError as error:
        raise SettingsError(f"Can't read the manifest {source}: {error}.") from error
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException) as error:
        if separator := _separator(source):
            raise SettingsError(_parted(source, separator)) from error
        told = " ".join(str(error).split())
        raise SettingsError(
            f"The manifest {source} is no table that can be read ({told}); write it anew as CSV "
            "in UTF-8, or as Parquet."
        ) from error


def _separator(source: str) -> str | None:
    """What parts the columns of a manifest instead of commas."""
    try:
        with Path(source).open(encoding="utf-8", errors="replace") as file:
            return other_separator(file.readline(), COLUMNS)
    except OSError:
        return None


def _parted(source: str, separator: str) -> str:
    return (
        f"The columns of the manifest {source} are separated by {separator}; save it with commas."
    )


def _check_columns(source: str, columns: list[str]) -> None:
    if not set(columns) & set(COLUMNS) and (separator := _separator(source)):
        raise SettingsError(_parted(source, separator))
    for column in columns:
        if column not in COLUMNS:
            near = nearest(column, COLUMNS)
            cure = f"did you mean '{near}'?" if near else f"known are {', '.join(COLUMNS)}."
            raise SettingsError(f"{source} has an unknown column '{column}'; {cure}")
    if "log" not in columns:
        raise SettingsError(f"{source} has no column 'log'; give one, with a path or URL per row.")


def _row(
    row: Mapping[str, str], where: str, base: str, building: str | None, options: RunOptions
) -> tuple[BatchLog, RunOptions]:
    if "log" not in row:
        raise SettingsError(f"{where} names no log; fill the column 'log' with a path or URL.")
    if any("\0" in cell for cell in row.values()):
        raise SettingsError(f"{where} holds a zero byte; write the manifest anew, as text.")
    addresses = {
        key: absolute(row[key], base)
        for key in ("building", "truth", "path", "settings")
        if key in row
    }
    address = absolute(row["log"], base)
    if not is_remote(address):
        refuse_many(f"{where}: {address}", Path(address))
    if "building" not in addresses and building is None:
        raise SettingsError(f"{where} names no building; give one there, or --building URDF.")
    log = BatchLog(
        name=_name(row.get("name", ""), where),
        log=address,
        building=addresses.get("building") or absolute(building or ""),
        truth=addresses.get("truth"),
        path=addresses.get("path"),
        robot=row.get("robot"),
    )
    special = _special(row, addresses.get("settings"), where)
    return log, replace(options, **special) if special else options


def _name(text: str, where: str) -> str:
    """A name that can be that of a folder. Raises SettingsError."""
    if text and not NAME.fullmatch(text):
        raise SettingsError(
            f"{where}: the name '{text}' must be letters, digits, '_', '-' and '.', and not begin "
            "with a dot."
        )
    return text


def _special(row: Mapping[str, str], settings: str | None, where: str) -> dict[str, Any]:
    """The options that a row sets."""
    own: dict[str, Any] = {}
    if settings is not None:
        try:
            own["settings"] = load_settings(here(settings))
        except SettingsError as error:
            raise SettingsError(f"{where}: {error}") from error
    if "initial_pose" in row:
        own["initial_pose"] = _pose(row["initial_pose"], where)
        own["global_start"] = False
    if "global" in row:
        own["global_start"] = _yes_or_no(row["global"], where)
    if "seed" in row:
        own["seed"] = _seed(row["seed"], where)
    return own


def _pose(text: str, where: str) -> FloatArray:
    try:
        return pose_from_text(text)
    except ValueError as error:
        raise SettingsError(f"{where}: '{text}' is not a pose: {error}; give {POSE}.") from error


def _yes_or_no(text: str, where: str) -> bool:
    if text.lower() not in YES + NO:
        raise SettingsError(f"{where}: global '{text}' must be yes or no.")
    return text.lower() in YES


def _seed(text: str, where: str) -> int:
    if not text.isdecimal() or len(text) > LONGEST_SEED:
        raise SettingsError(
            f"{where}: the seed '{text[:LONGEST_SEED]}' must be a whole number from 0 on, of at "
            f"most {LONGEST_SEED} digits."
        )
    return int(text)
