"""The table of doors that goes with a map: where each hinge is and how its leaf turns."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from objstate.errors import BuildingError
from objstate.geometry import WHOLE_TURN, FloatArray
from objstate.kinds import DOORS, instead, other_separator
from objstate.spelling import nearest

COLUMNS = (
    "door",
    "hinge_x",
    "hinge_y",
    "closed_bearing_deg",
    "opens",
    "width_m",
    "upper_limit_deg",
)
PROBABILITY = "probability"  # that a candidate is a door
PROBABLE = 0.5  # from which on a candidate is a door
SIDE = "side_probability"  # that a candidate is hinged at this end and opens this way
HINGE_STD, BEARING_STD, WIDTH_STD = "hinge_std_m", "bearing_std_deg", "width_std_m"
TYPE, TRAVEL = "type", "upper_limit_m"
IN_MAP = "in_map_deg"  # how far open the map shows a leaf that turns; 0 where it shows none open
TOLD = (SIDE, HINGE_STD, BEARING_STD, WIDTH_STD)  # what drives told of a door besides
OPTIONAL = (PROBABILITY, *TOLD, TYPE, TRAVEL, IN_MAP)
SLIDES = 0  # the sense of a leaf that doesn't turn
SENSE = {"ccw": 1, "cw": -1, "slides": SLIDES}  # of opening, seen from above
FULL_TURN = 360.0  # degrees
WIDEST_LEAF = 5.0  # m; wider doors slide, fold or roll
LARGEST = 1e8  # m, degrees; also of coordinates of a country


@dataclass(frozen=True, eq=False)
class Door:
    """One leaf as the table has it.

    The hinge of a leaf that slides is its end past which it slides open.
    """

    name: str
    hinge: FloatArray = field(repr=False)  # (2,) m in the map's frame
    closed_bearing: float  # rad, from the hinge to the free edge when closed
    sense: int  # 1 opens counter-clockwise seen from above, -1 clockwise, SLIDES neither
    width: float  # m, from the hinge to the free edge
    upper: float  # rad, the widest opening; m if it slides
    probability: float | None = None  # of a candidate
    in_map: float | None = None  # rad, by which the map shows it open; None: anywhere in its swing
    told: Mapping[str, str] = field(
        default_factory=dict
    )  # by columns of TOLD, where they are filled

    @property
    def is_probable(self) -> bool:
        """Whether it is no candidate, or one that probably is a door."""
        return self.probability is None or self.probability >= PROBABLE

    @property
    def slides(self) -> bool:
        """Whether it slides, instead of turning about its hinge."""
        return self.sense == SLIDES

    @property
    def middle(self) -> FloatArray:
        """(2,) m, of the closed leaf."""
        way = np.array([np.cos(self.closed_bearing), np.sin(self.closed_bearing)])
        return np.asarray(self.hinge + self.width / 2 * way)

    @property
    def type(self) -> str:
        """As the table has it."""
        return "sliding" if self.slides else "hinged"

    @property
    def opens(self) -> str:
        """As the table has it."""
        return next(name for name, sense in SENSE.items() if sense == self.sense)


def closing_distance(
    middle: FloatArray, width: float, middles: FloatArray, widths: FloatArray | float
) -> FloatArray:
    """(n,) how far leaves are from closing the same way as one; below 1 they do.

    Their middles when closed (..., 2) m then lie within a quarter of the sum of both widths, m.
    """
    return np.asarray(np.linalg.norm(middles - middle, axis=-1) / ((width + widths) / 4))


def read_doors(path: Path) -> list[Door]:
    """The doors of a table. Raises BuildingError with the line for anything wrong in it."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no UTF-8 text"
        raise BuildingError(f"The door table {path} can't be read ({reason}); check it.") from error
    rows = csv.DictReader(lines, skipinitialspace=True)
    rows.fieldnames = [name.strip() for name in rows.fieldnames or ()]
    _check_columns(path, rows.fieldnames, lines[0] if lines else "")
    doors: dict[str, Door] = {}
    for row in rows:
        door = _read_door(row, f"{path}, line {rows.line_num}")
        if door.name in doors:
            raise BuildingError(
                f"Door '{door.name}' stands in {path} a second time, in line {rows.line_num}; "
                "give each leaf a name of its own."
            )
        doors[door.name] = door
    return list(doors.values())


def door_rows(
    doors: Sequence[Door], beside: Mapping[str, Mapping[str, object]] | None = None
) -> str:
    """A table of doors as text, to be read again.

    ``beside`` has values of further columns, of ``OPTIONAL``, by the names of doors.
    """
    rows = [_described(door) | dict((beside or {}).get(door.name, {})) for door in doors]
    further = [name for name in OPTIONAL if any(row.get(name, "") != "" for row in rows)]
    text = io.StringIO()
    table = csv.DictWriter(text, [*COLUMNS, *further], extrasaction="ignore", lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()


def _described(door: Door) -> dict[str, object]:
    """What ``COLUMNS`` say of a door, how far it slides, and where the map shows it."""
    x, y = (round(float(value), 4) for value in door.hinge)
    bearing = round(math.degrees(door.closed_bearing), 3)
    turn = "" if door.slides else round(math.degrees(door.upper), 3)
    values = (door.name, x, y, bearing, door.opens, round(door.width, 4), turn)
    described: dict[str, object] = dict(zip(COLUMNS, values, strict=True))
    if door.in_map is not None:
        described[IN_MAP] = round(math.degrees(door.in_map), 1)
    return described | ({TRAVEL: round(door.upper, 4)} if door.slides else {})


def _check_columns(path: Path, found: Sequence[str], header: str) -> None:
    missing = [name for name in COLUMNS if name not in found]
    unknown = [name for name in found if name not in COLUMNS + OPTIONAL]
    if twice := [name for name in COLUMNS + OPTIONAL if found.count(name) > 1]:
        raise BuildingError(
            f"The door table {path} has the column '{twice[0]}' {found.count(twice[0])} times; "
            "remove all but one."
        )
    if not missing and not unknown:
        return
    if separator := other_separator(header, COLUMNS):
        raise BuildingError(
            f"The columns of the door table {path} are separated by {separator}; save it with "
            "commas, and with decimal points."
        )
    if told := instead(path, DOORS):
        raise BuildingError(told)
    faults = []
    if missing:
        names = ", ".join(f"'{name}'" for name in missing)
        faults.append(f"lacks the column{'s' * (len(missing) > 1)} {names}")
    for name in unknown:
        near = nearest(str(name), missing or COLUMNS)
        faults.append(f"has the unknown column '{name}'" + (f" (for '{near}'?)" if near else ""))
    raise BuildingError(
        f"The door table {path} {' and '.join(faults)}; its first line must be {','.join(COLUMNS)}."
    )


def _read_door(row: dict[str, str | None], where: str) -> Door:
    if None in row or None in row.values():
        names = [name for name in row if name is not None]
        raise BuildingError(f"{where} must hold {len(names)} values: {','.join(names)}.")
    name = (row["door"] or "").strip()
    opens = (row["opens"] or "").strip().lower()
    if not name:
        raise BuildingError(f"{where} names no door; fill the column 'door'.")
    if opens not in SENSE:
        raise BuildingError(
            f"{where}: door '{name}' opens '{opens}'; it must be ccw or cw, seen from above, or "
            "slides."
        )
    width = _number(row, "width_m", where)
    if width <= 0:
        raise BuildingError(f"{where}: door '{name}' is {width:g} m wide; give a width above 0.")
    if width > WIDEST_LEAF:
        raise BuildingError(
            f"{where}: door '{name}' is {width:g} m wide; no leaf is wider than {WIDEST_LEAF:g} m, "
            f"so give it in metres ({width / (1000 if width >= 200 else 100):g}?)."
        )
    door = Door(
        name=name,
        hinge=np.array([_number(row, "hinge_x", where), _number(row, "hinge_y", where)]),
        closed_bearing=math.radians(_number(row, "closed_bearing_deg", where)),
        sense=SENSE[opens],
        width=width,
        upper=_travel(row, width, where) if SENSE[opens] == SLIDES else _widest(row, where),
        probability=_probability(row, where),
        in_map=_in_map(row, SENSE[opens], where),
        told={name: value for name in TOLD if (value := (row.get(name) or "").strip())},
    )
    told = (row.get(TYPE) or door.type).strip()
    if told != door.type:
        raise BuildingError(
            f"{where}: door '{name}' is {told}, but opens '{opens}'; sliding doors open 'slides', "
            "hinged ones ccw or cw."
        )
    return door


def _widest(row: dict[str, str | None], where: str) -> float:
    """How far a door turns, rad."""
    name, upper = row["door"], _number(row, "upper_limit_deg", where)
    if travel := (row.get(TRAVEL) or "").strip():
        raise BuildingError(
            f"{where}: door '{name}' turns, but slides by {travel} m; leave {TRAVEL} empty, or let "
            "it open 'slides'."
        )
    if not 0 < upper < FULL_TURN:
        raise BuildingError(
            f"{where}: door '{name}' opens up to {upper:g} degrees; "
            "give an angle above 0 and below 360."
        )
    if upper <= WHOLE_TURN:
        raise BuildingError(
            f"{where}: door '{name}' opens up to {upper:g} degrees; no door opens so little, so "
            f"give degrees instead of radians ({math.degrees(upper):.0f}?)."
        )
    return math.radians(upper)


def _travel(row: dict[str, str | None], width: float, where: str) -> float:
    """How far a door slides, m; by its width, if that isn't said."""
    name, turn = row["door"], (row["upper_limit_deg"] or "").strip()
    if turn:
        raise BuildingError(
            f"{where}: door '{name}' slides, but opens up to {turn} degrees; leave "
            f"upper_limit_deg empty, and give {TRAVEL} if it slides by another length than its "
            "width."
        )
    if not (row.get(TRAVEL) or "").strip():
        return width
    travel = _number(row, TRAVEL, where)
    if not 0 < travel <= 2.0 * WIDEST_LEAF:
        raise BuildingError(
            f"{where}: door '{name}' slides by {travel:g} m; give a length above 0 and up to "
            f"{2.0 * WIDEST_LEAF:g} m."
        )
    return travel


def _in_map(row: dict[str, str | None], sense: int, where: str) -> float | None:
    """How far open the map shows a leaf, rad; None where that isn't said."""
    if not (row.get(IN_MAP) or "").strip():
        return None
    value = _number(row, IN_MAP, where)
    if sense == SLIDES or not 0 <= value < FULL_TURN:
        raise BuildingError(
            f"{where}: door '{row['door']}' has {value:g} as {IN_MAP}; give an angle from 0 to 360 "
            "to a door that turns, or leave it empty."
        )
    return math.radians(value)


def _probability(row: dict[str, str | None], where: str) -> float | None:
    if not (row.get(PROBABILITY) or "").strip():
        return None
    value = _number(row, PROBABILITY, where)
    if not 0 <= value <= 1:
        raise BuildingError(f"{where}: the probability {value:g} isn't between 0 and 1.")
    return value


def _number(row: dict[str, str | None], column: str, where: str) -> float:
    try:
        value = float(row[column] or "")
    except ValueError:
        value = math.nan
    if not abs(value) <= LARGEST:
        point = ", with a point before its fraction" if "," in (row[column] or "") else ""
        raise BuildingError(
            f"{where}: '{row[column]}' in column '{column}' is no number, or no length or angle in "
            f"a building; give one in metres or degrees{point}."
        )
    return value
