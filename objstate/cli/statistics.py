"""``objstate statistics``"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from objstate.cli.console import print_table, print_text
from objstate.cli.json_values import JSON_HELP, write_json
from objstate.cli.parsing import parse_zone
from objstate.cli.tables import new_table, percent, significant
from objstate.errors import SettingsError

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.statistics import DoorStatistics, Interval, Share

DAYS = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")
SPANS = ((86400.0, "d"), (3600.0, "h"), (60.0, "min"), (0.0, "s"))

EXAMPLES = """\b
Examples:
  objstate statistics out/year --timezone Europe/Berlin
  objstate statistics out/year --open-above 5deg --json out/year.doors.json
"""

LEGEND = (
    "Medians, with 90 % intervals; the fewer looks, and the closer together, the wider. Open is the share\n"
    "of all time, nights and free days too; when seen, that of the hours of working and of free days\n"
    "with a look. Spells are how long the door stays as it is. In the tables by hour and by day those\n"
    "without a look are left out."
)


def statistics(
    folder: Annotated[str, typer.Argument(metavar="DIR", help="A batch, or its URL.")],
    open_above: Annotated[
        str, typer.Option(metavar="ANGLE", help="A hinged door counts as open beyond it.")
    ] = "10deg",
    open_above_m: Annotated[
        float, typer.Option(metavar="M", min=0, help="And a sliding door beyond this.")
    ] = 0.1,
    timezone: Annotated[
        str, typer.Option(metavar="ZONE", help="Whose hours and days, e.g. Europe/Berlin.")
    ] = "UTC",
    filtered: Annotated[
        bool,
        typer.Option(
            "--filtered",
            help="Take what the robot would have known then, not what the whole log says.",
        ),
    ] = False,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help=JSON_HELP)
    ] = None,
) -> None:
    """How much of the time each door is open, for how long, and how often it is moved.

    Taken over all logs of a batch, also by the hour of the day and the day of the week.
    """
    from objstate.geometry import angle_from_text
    from objstate.recording.batches import REPORT
    from objstate.recording.mirror import mirrored
    from objstate.statistics import OpenAbove, door_statistics

    try:
        above = OpenAbove(angle_from_text(open_above), open_above_m)
    except ValueError as error:
        raise SettingsError(
            f"--open-above '{open_above}' is no angle: {error}; give radians, or degrees as in "
            "10deg."
        ) from error
    with mirrored(folder, only=(REPORT,)) as home:
        doors = door_statistics(home, above, parse_zone(timezone), filtered=filtered)
    if write_json(json_file, doors):
        return
    if not doors:
        print_text("No door was seen clearly open or closed.")
        return
    print_table(_doors_table(doors))
    print_table(_shares_table("Open by hour (%)", "hour", doors, hourly=True))
    print_table(_shares_table("Open by day of the week (%)", "day", doors, hourly=False))
    print_text(LEGEND)


def _doors_table(doors: tuple[DoorStatistics, ...]) -> Table:
    numbers = (
        "logs",
        "looks",
        "undecided",
        "open (%)",
        "when\nseen (%)",
        "open\nspell",
        "closed\nspell",
        "moves\na day",
    )
    table = new_table("Doors", ("door",), numbers)
    for door in doors:
        table.add_row(
            door.door,
            str(door.logs),
            str(door.looks),
            str(door.undecided),
            _share(door.share_open),
            _share(door.share_open_seen),
            _spell(door.open_spell),
            _spell(door.closed_spell),
            _moves(door.moves_per_day),
        )
    return table


def _shares_table(title: str, label: str, doors: tuple[DoorStatistics, ...], hourly: bool) -> Table:
    table = new_table(title, ("door", label), ("looks", "worth", "open (%)"))
    for door in doors:
        for share in door.by_hour if hourly else door.by_weekday:
            when = f"{share.key:02d}" if hourly else DAYS[share.key]
            table.add_row(door.door, when, *_share_cells(share))
    return table


def _share_cells(share: Share) -> tuple[str, str, str]:
    return str(share.looks), f"{share.independent:.1f}", _share(share.share)


def _share(interval: Interval) -> str:
    return f"{percent(interval.value)} ({percent(interval.lower)} to {percent(interval.upper)})"


def _moves(interval: Interval) -> str:
    value, lower, upper = (
        significant(number, 2) for number in (interval.value, interval.lower, interval.upper)
    )
    return f"{value} ({lower} to {upper})"


def _spell(interval: Interval) -> str:
    return f"{_span(interval.value)} ({_span(interval.lower)} to {_span(interval.upper)})"


def _span(seconds: float) -> str:
    if not math.isfinite(seconds) or seconds > 1e9:
        return "for ever"
    length, unit = next((length, unit) for length, unit in SPANS if seconds >= length)
    return f"{significant(seconds / (length or 1.0), 2)} {unit}"
