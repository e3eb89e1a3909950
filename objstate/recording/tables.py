"""Tables of results: estimates as Parquet, true states as CSV."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import fields
from decimal import Decimal, InvalidOperation
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from objstate.errors import TruthError
from objstate.geometry import checked_angle
from objstate.kinds import TRUTH, instead, other_separator
from objstate.order import natural_key
from objstate.recording.parquet import read_parquet
from objstate.recording.spool import Spool
from objstate.recording.stamps import PER_SECOND, mistaken_unit, unit_of_number
from objstate.records import Estimate, TrueState
from objstate.spelling import nearest

if TYPE_CHECKING:
    import polars as pl

ESTIMATES = "estimates.parquet"
SMOOTHED = "smoothed.parquet"  # the same rows, given the whole log
ROWS_IN_MEMORY = 20_000  # about 7 MB
COLUMNS = (
    "stamp",
    "object",
    "coordinate",
    "mean",
    "std",
    "lower",
    "upper",
    "observed",
    "fit",
    "presence",
    "lost",
    "p_closed",
    "p_localized",
    "median",
)
P_CLOSED = "p_closed"
ADDED = (P_CLOSED, "p_localized", "median")  # columns that results of earlier versions don't have

TRUTH_COLUMNS = ("stamp", "object", "coordinate", "value")
KNOWN_COORDINATES = ("angle", "offset", "x", "y", "yaw")
ANGLES = ("angle", "yaw")
LONGEST_OFFSET = 50.0  # m; no leaf in a building slides farther
INTEGER = re.compile(r"-?\d{1,18}|-?[1-8]\d{18}")  # nanoseconds that fit into 64 bits


def estimate_schema() -> pl.Schema:
    """Names and types of the columns of ``estimates.parquet``."""
    import polars as pl

    numbers = dict.fromkeys(("mean", "std", "lower", "upper"), pl.Float64())
    return pl.Schema(
        {"stamp": pl.Int64(), "object": pl.String(), "coordinate": pl.String()}
        | numbers
        | {"observed": pl.Boolean(), "fit": pl.Float64(), "presence": pl.Float64()}
        | {"lost": pl.Boolean(), "p_closed": pl.Float64()}
        | {"p_localized": pl.Float64(), "median": pl.Float64()}
    )


class EstimateWriter(Spool[Estimate]):
    """Writes ``estimates.parquet`` into a result folder, one row for each estimate."""

    def __init__(self, folder: str | Path, rows_in_memory: int = ROWS_IN_MEMORY) -> None:
        super().__init__(Path(folder) / ESTIMATES, estimate_schema(), _columns, rows_in_memory)
        # (from, before) ns in which the robot was lost, which is found out later
        self.lost: Sequence[tuple[int, int]] = ()

    def _finished(self, rows: pl.LazyFrame) -> pl.LazyFrame:
        import polars as pl

        stamp = pl.col("stamp")
        within = [(stamp >= since) & (stamp < found) for since, found in self.lost]
        return rows.with_columns(pl.any_horizontal("lost", *within).alias("lost"))


def _columns(estimates: Sequence[Estimate]) -> dict[str, list[Any]]:
    names = [field.name for field in fields(Estimate)]
    return {
        column: [getattr(estimate, name) for estimate in estimates]
        for column, name in zip(COLUMNS, names, strict=True)
    }


def read_estimates(folder: str | Path) -> pl.DataFrame:
    """The estimates of a result folder. Raises ResultError where there are none.

    Results of earlier versions don't say how probably a door is closed, nor how probably the robot
    is localized: ``p_closed`` and ``p_localized`` are null there. Their ``median`` is the mean.
    """
    return _read_table(Path(folder) / ESTIMATES)


def read_states(folder: str | Path, *, filtered: bool = False) -> pl.DataFrame:
    """The smoothed states of a result, or with ``filtered`` those that could be known at the time.

    The smoothed states are those of ``smoothed.parquet``. Where there is none, or with
    ``filtered``, they are the estimates. Raises ResultError where there are none either.
    """
    smoothed = Path(folder) / SMOOTHED
    return read_estimates(folder) if filtered or not smoothed.exists() else _read_table(smoothed)


def _read_table(path: Path) -> pl.DataFrame:
    import polars as pl

    cure = "make it with `objstate estimate`"
    table = read_parquet(path, estimate_schema(), cure, optional=ADDED)
    return table.with_columns(pl.coalesce("median", "mean").alias("median"))


def write_truth(path: str | Path, rows: Iterable[TrueState]) -> None:
    """Write true states as CSV ``stamp,object,coordinate,value``, stamps in nanoseconds."""
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(TRUTH_COLUMNS)
        for row in rows:
            writer.writerow((row.stamp_ns, row.object, row.coordinate, float(row.value)))


def read_truth(path: str | Path) -> list[TrueState]:
    """The true states of a CSV, in the order of their stamps; each holds from its stamp on.

    Raises TruthError, which names the line, for anything but
    ``stamp,object,coordinate,value`` with whole nanoseconds and finite values.
    """
    try:
        with Path(path).open(encoding="utf-8-sig", newline="") as file:
            rows = list(_truth_rows(csv.reader(file, strict=True), path))
    except OSError as error:
        raise TruthError(
            instead(path, TRUTH) or f"Can't read the truth {path}: {error.strerror}."
        ) from error
    except (UnicodeDecodeError, csv.Error) as error:
        if told := instead(path, TRUTH):
            raise TruthError(told) from error
        raise TruthError(f"{path} is not a CSV file in UTF-8: {error}.") from error
    _refuse_contradictions(rows, path)
    return sorted(rows, key=lambda row: row.stamp_ns)


def check_truth_times(
    truth: Iterable[TrueState], begin_ns: int, end_ns: int, source: str | Path = "The truth"
) -> None:
    """Raise TruthError for stamps that aren't nanoseconds, or all later than the log's end."""
    stamps = {row.stamp_ns for row in truth}
    unit = mistaken_unit(stamps, begin_ns, end_ns)
    if unit is not None:
        example = max(stamps)
        told = example * 10**9 // PER_SECOND[unit]
        raise TruthError(
            f"{source}: the stamp {example} is given in {unit}, but truth has nanoseconds since "
            f"1970; write {told}, and so for every stamp."
        )
    if stamps and min(stamps) > end_ns:
        late_s = (min(stamps) - end_ns) / 1e9
        raise TruthError(
            f"{source} begins {late_s:,.0f} s after the log's end; is it that of another drive?"
        )


def unknown_names(truth: Iterable[TrueState], objects: Collection[str]) -> list[str]:
    """A warning of objects of the truth that a building lacks, and which may be meant."""
    named = {row.object for row in truth}
    unknown = sorted(named.difference(objects), key=natural_key)
    if not unknown:
        return []
    missing = sorted(set(objects) - named)
    told = ", ".join(
        f"'{name}' (did you mean '{near}'?)" if (near := nearest(name, missing)) else f"'{name}'"
        for name in unknown
    )
    return [
        f"The building doesn't have {len(unknown)} of the truth's {len(named)} objects: {told}. They "
        "aren't compared; the truth takes the names of joints."
    ]


def _truth_rows(lines: Iterator[list[str]], path: str | Path) -> Iterator[TrueState]:
    expected = ",".join(TRUTH_COLUMNS)
    header = [name.strip() for name in next(lines, [])]
    if header != list(TRUTH_COLUMNS):
        if separator := other_separator(",".join(header), TRUTH_COLUMNS):
            raise TruthError(
                f"The columns of {path} are separated by {separator}; save it with commas, and "
                "with decimal points."
            )
        if told := instead(path, TRUTH):
            raise TruthError(told)
        raise TruthError(f"{path}, line 1 reads '{','.join(header)}'; it must be '{expected}'.")
    for number, fields_ in enumerate(lines, start=2):
        if fields_:
            yield _truth_row(fields_, f"{path}, line {number}")


def _truth_row(row: list[str], where: str) -> TrueState:
    if len(row) != len(TRUTH_COLUMNS):
        raise TruthError(f"{where} has {len(row)} fields; give {','.join(TRUTH_COLUMNS)}.")
    stamp, name, coordinate, value = (field.strip() for field in row)
    if not INTEGER.fullmatch(stamp):
        raise TruthError(f"{where}: the stamp '{stamp}' must be whole nanoseconds{_as_ns(stamp)}.")
    if not name:
        raise TruthError(f"{where} names no object; give its joint's name.")
    if coordinate not in KNOWN_COORDINATES:
        raise TruthError(
            f"{where}: the coordinate '{coordinate}' must be one of {', '.join(KNOWN_COORDINATES)}."
        )
    number = _finite(value, where)
    if coordinate in ANGLES:
        _check_angle(number, f"{where}: the {coordinate} of '{name}'")
    elif coordinate == "offset" and abs(number) > LONGEST_OFFSET:
        raise TruthError(
            f"{where}: no sliding door opens by {number:g} m; if millimetres are meant, write "
            f"{number / 1000:g}."
        )
    return TrueState(int(stamp), name, coordinate, number)


def _as_ns(stamp: str) -> str:
    """How to write a stamp with a fraction of a second in nanoseconds."""
    try:
        value = Decimal(stamp)
    except InvalidOperation:
        return ""
    if not value.is_finite() or unit_of_number(Fraction(value))[0] != "seconds":
        return ""
    return f"; if seconds are meant, write {round(value * 10**9)}"


def _check_angle(value: float, what: str) -> None:
    try:
        checked_angle(value)
    except ValueError as error:
        raise TruthError(f"{what}: {error}.") from error


def _finite(value: str, where: str) -> float:
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise TruthError(f"{where}: the value '{value}' must be a finite number (rad or m).")
    return number


def _refuse_contradictions(rows: Iterable[TrueState], path: str | Path) -> None:
    """Two values of one coordinate from the same stamp on can't both be true."""
    values: dict[tuple[int, str, str], float] = {}
    for row in rows:
        key = (row.stamp_ns, row.object, row.coordinate)
        if values.setdefault(key, row.value) != row.value:
            raise TruthError(
                f"{path} gives '{row.object}' two values of {row.coordinate} from "
                f"{row.stamp_ns} on: {values[key]} and {row.value}; keep one."
            )
