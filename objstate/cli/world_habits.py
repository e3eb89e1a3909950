"""``objstate world habits | when``"""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from objstate.cli.console import print_table, print_text
from objstate.cli.options import AsJson
from objstate.cli.parsing import TIME, parse_time
from objstate.cli.tables import new_table, percent
from objstate.errors import SettingsError, WorldError

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.world import World

HABITS = """\b
Examples:
  objstate world habits world.db
  objstate world habits world.db --object door_07
  objstate world habits world.db --json | jq '.doors[].moves_per_day'
"""
WHEN = """\b
Examples:
  objstate world when world.db door_07 --width 0.6
  objstate world when world.db door_07 --from 2026-11-23T08:00+01:00 --within 10
  objstate world when world.db door_07:20 door_08:45 --width 0.6
"""
LEGEND = (
    "Medians of the share of time and of the moves in a week{season} without holidays, with 90 % "
    "intervals.\n"
    "Working days are Monday to Friday but for holidays; hours are those of {zone}."
)
Place = Annotated[
    str, typer.Argument(metavar="WORLD", help="A file, or postgresql://USER@HOST/DATABASE.")
]


def habits(
    world: Place,
    name: Annotated[
        str | None,
        typer.Option(
            "--object", "--door", metavar="NAME", help="This door or piece alone, hour by hour."
        ),
    ] = None,
    fit: Annotated[
        bool,
        typer.Option("--fit", help="First learn them anew from all that was seen; takes seconds."),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """How doors are used and furniture is moved: how often, at which hours, and where to.

    Learnt from the looks of all drives, at whatever hours these were. By which clock, and which
    days are holidays, is in the settings of the drives (calendar).
    """
    from objstate.world.habit_words import habit_words, looked_at_once, piece_words, season_word
    from objstate.world.store import open_store

    store = open_store(world)
    if fit:
        store.fit_habits()
    known = store.load()
    chosen = None if name is None else [name]
    words, pieces = habit_words(known, chosen), piece_words(known, chosen)
    if name is not None and not (words or pieces):
        raise WorldError(f"Nothing is known of the habits of '{name}': {_unlearnt(known, name)}.")
    season, once = season_word(known), looked_at_once(known)
    if as_json:
        document: dict[str, object] = {
            "calendar": known.settings.calendar.model_dump(mode="json", by_alias=True)
        }
        document |= {} if season is None else {"season": season}
        document |= {"doors": words, "furniture": pieces, "looked_at_once": once}
        print_text(json.dumps(document, indent=2))
        return
    if once and name is None:
        print_text(f"Looked at once, of the two looks that are needed: {', '.join(once)}.")
    if not (words or pieces):
        if not once:
            print_text("No object has been looked at.")
        return
    if words:
        print_table(_table(words))
    if pieces:
        print_table(_pieces(pieces))
    if name in words:
        print_table(_hours(name, words[name]))
    elif name in pieces:
        print_table(_places(name, pieces[name]))
        print_table(_moves(name, pieces[name]))
    of_season = "" if season is None else f" of the {season} season, that of the last look"
    print_text(LEGEND.format(zone=known.settings.calendar.timezone, season=of_season))


def when(
    world: Place,
    doors: Annotated[
        list[str],
        typer.Argument(
            metavar="DOOR...",
            help="Doors on the way, each with the seconds at which it is reached, as in door_07:20.",
        ),
    ],
    width: Annotated[float, typer.Option(metavar="M", min=0, help="Of the robot.")] = 0.6,
    begin: Annotated[str, typer.Option("--from", metavar="TIME", help=f"One of: {TIME}.")] = "now",
    within: Annotated[
        float, typer.Option(metavar="HOURS", min=0, help="How far to look ahead, a week at most.")
    ] = 12.0,
    probability: Annotated[
        float, typer.Option(metavar="P", min=0, max=1, help="That a door may be passed.")
    ] = 0.5,
    as_json: AsJson = False,
) -> None:
    """When doors may be passed: most probable times, waiting before each, best departure.

    A door counts as passable where it leaves the robot's width. By habits, where they are known,
    else by the rates of the settings.
    """
    from objstate.world.store import open_store
    from objstate.world.when import best_departure, passable, spans, wait

    known = open_store(world).load()
    stamp_ns, seconds = parse_time(begin, known.settings.calendar.zone), 3600.0 * within
    route = [_reached(text) for text in doors]
    document: dict[str, object] = {"begin_ns": stamp_ns, "doors": {}}
    table = new_table("Doors", ("door", "probably open"), ("now (%)", "mean wait", "passes (%)"))
    told: dict[str, object] = {}
    for name, _ in route:
        now = float(passable(known, name, width, [stamp_ns])[0])
        times = spans(known, name, width, stamp_ns, seconds, probability)
        stay = wait(known, name, width, stamp_ns, seconds)
        told[name] = {
            "probability": now,
            "spans": [asdict(each) for each in times],
            "wait": asdict(stay),
        }
        shown = ", ".join(
            f"{_clock(known, t.begin_ns)} to {_clock(known, t.end_ns)}" for t in times
        )
        table.add_row(
            name, shown or "never", percent(now), _duration(stay.mean_s), percent(stay.within)
        )
    best = best_departure(known, route, width, stamp_ns, seconds)
    document |= {"doors": told, "departure": asdict(best)}
    if as_json:
        print_text(json.dumps(document, indent=2))
        return
    print_table(table)
    print_text(
        f"Set off at {_clock(known, best.stamp_ns)}: all doors may be passed with "
        f"{100 * best.probability:.0f} %. Times are those of {known.settings.calendar.timezone}."
    )


def _unlearnt(world: World, name: str) -> str:
    """Why an object has no habits. Raises QueryError for an unknown one."""
    from objstate.world.habit_words import looked_at_once

    if not world.history(name):
        return "nobody looked at it"
    if name in looked_at_once(world):
        return "it was looked at once; two looks are needed"
    return "the settings say how often it is moved"


def _reached(text: str) -> tuple[str, float]:
    name, _, seconds = text.rpartition(":")
    if not name:
        return text, 0.0
    try:
        return name, float(seconds)
    except ValueError as error:
        raise SettingsError(
            f"'{text}': '{seconds}' is no number of seconds; give DOOR or DOOR:SECONDS."
        ) from error


def _clock(world: World, stamp_ns: int) -> str:
    from objstate.world.habit_rows import calendar_of

    return calendar_of(world.settings.calendar).local(stamp_ns).strftime("%a %H:%M")


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"


def _table(words: dict[str, dict[str, Any]]) -> Table:
    table = new_table(
        "Habits", ("door",), ("looks", "closed (%)", "in office hours (%)", "moves a day")
    )
    for name, each in words.items():
        moves = each["moves_per_day"]
        office = [
            hour["shares"][0]["value"]
            for hour in each["hours"]
            if hour["kind"] == "working" and 8 <= hour["hour"] < 18
        ]
        table.add_row(
            name,
            str(each["looks"]),
            _share(each["shares"][0]),
            percent(sum(office) / len(office)),
            f"{moves['value']:.1f} ({moves['lower']:.1f} to {moves['upper']:.1f})",
        )
    return table


def _pieces(words: dict[str, dict[str, Any]]) -> Table:
    headings = ("looks", "moves a day", "places", "away (%)")
    table = new_table("Furniture", ("piece",), headings)
    for name, each in words.items():
        moves = each["moves_per_day"]
        table.add_row(
            name,
            str(each["looks"]),
            f"{moves['value']:.2f} ({moves['lower']:.2f} to {moves['upper']:.2f})",
            str(len(each["places"])),
            percent(each["away"]),
        )
    return table


def _places(name: str, words: dict[str, Any]) -> Table:
    headings = ("share of arrivals (%)", "x (m)", "y (m)", "yaw (deg)")
    table = new_table(f"Where {name} stood", (), (*headings, "also of"))
    for place in sorted(words["places"], key=lambda each: -float(each["share"])):
        at = place["state"]
        table.add_row(
            percent(place["share"]),
            f"{at['x']:.2f}",
            f"{at['y']:.2f}",
            f"{math.degrees(at['yaw']):.0f}",
            ", ".join(place["also_of"]),
        )
    return table


def _moves(name: str, words: dict[str, Any]) -> Table:
    table = new_table(f"{name} by hour", ("day", "hour"), ("moves an hour",))
    for hour in words["hours"]:
        moves = hour["moves_per_hour"]
        rate = f"{moves['value']:.3f} ({moves['lower']:.3f} to {moves['upper']:.3f})"
        table.add_row(hour["kind"], f"{hour['hour']:02d}", rate)
    return table


def _hours(name: str, words: dict[str, Any]) -> Table:
    columns = (*(f"{region} (%)" for region in words["regions"]), "moves an hour")
    table = new_table(f"{name} by hour", ("day", "hour"), columns)
    for hour in words["hours"]:
        table.add_row(
            hour["kind"],
            f"{hour['hour']:02d}",
            *(_share(share) for share in hour["shares"]),
            f"{hour['moves_per_hour']['value']:.2f}",
        )
    return table


def _share(figure: dict[str, float]) -> str:
    value, lower, upper = (percent(figure[each]) for each in ("value", "lower", "upper"))
    return f"{value} ({lower} to {upper})"
