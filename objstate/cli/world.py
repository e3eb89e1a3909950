"""``objstate world show | at | history | export | habits | when | adopt``"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from objstate.cli.console import print_table, print_text
from objstate.cli.options import AsJson, Overwrite, help_when_alone
from objstate.cli.parsing import TIME, parse_time
from objstate.cli.world_habits import HABITS, WHEN, habits, when
from objstate.cli.world_tables import history_table, world_table

if TYPE_CHECKING:
    from objstate.config import Settings
    from objstate.world import Snapshot
    from objstate.world.store import WorldStore

MADE = "A world is made by `objstate estimate ... --world world.db`."
SHOW = f"""\b
Examples:
  objstate world show world.db
  objstate world show postgresql://me@server/robots?schema=office --json
{MADE}
"""
AT = """\b
Examples:
  objstate world at world.db now
  objstate world at world.db 2026-11-21T12:00 --json
"""
HISTORY = """\b
Example:
  objstate world history world.db door_07
"""
EXPORT = """\b
Examples:
  objstate world export world.db --out world.json
  objstate world export world.db --samples | jq .drives
"""
ADOPT = """\b
Example:
  objstate estimate drive.mcap --building office.urdf --out out/drive --grid --world world.db
  objstate inspect out/drive
  objstate world adopt world.db unknown_2 --result out/drive --building office.urdf \\
      --as cabinet_1 --out office2.urdf
"""

Place = Annotated[
    str, typer.Argument(metavar="WORLD", help="A file, or postgresql://USER@HOST/DATABASE.")
]
Config = Annotated[
    Path | None,
    typer.Option(metavar="YAML", help="Settings to predict by. Default: the latest drive's."),
]

app = typer.Typer(
    help="What is believed, from drive to drive.",
    invoke_without_command=True,
    callback=help_when_alone,
)


@app.command(epilog=SHOW)
def show(world: Place, config: Config = None, as_json: AsJson = False) -> None:
    """What was believed of every object when anything was last learnt."""
    from objstate.world.store import open_store

    store = open_store(world)
    latest = store.load(_settings(config), newest=True).at()
    _print(store, latest, as_json)


@app.command("at", epilog=AT)
def at_time(
    world: Place,
    when: Annotated[str, typer.Argument(metavar="TIME", help=f"One of: {TIME}.")],
    config: Config = None,
    as_json: AsJson = False,
) -> None:
    """What is believed of every object at a time.

    An earlier time is answered with what was known then, a later one by prediction.
    """
    from objstate.world.store import open_store

    store = open_store(world)
    settings = _settings(config) or store.settings()
    stamp_ns = parse_time(when, settings.calendar.zone)
    _print(store, store.load(settings, since_ns=stamp_ns).at(stamp_ns), as_json)


@app.command(epilog=HISTORY)
def history(
    world: Place,
    name: Annotated[str, typer.Argument(metavar="OBJECT", help="The joint's name.")],
    as_json: AsJson = False,
) -> None:
    """What was learnt of one object, in time order."""
    from objstate.world.store import open_store
    from objstate.world.words import history_words

    known = open_store(world).load()
    beliefs = known.history(name)
    if as_json:
        print_text(json.dumps(history_words(known, name), indent=2))
    elif beliefs:
        print_table(history_table(name, beliefs, known.settings.calendar))
    else:
        print_text(f"{name} was never seen.")


@app.command(epilog=EXPORT)
def export(
    world: Place,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The file to write. Default: stdout.")
    ] = None,
    samples: Annotated[
        bool, typer.Option("--samples", help="Every belief's states and weights, too.")
    ] = False,
    overwrite: Overwrite = False,
) -> None:
    """All that a world knows, as JSON: drives, and each object's history."""
    from objstate.outputs import whole
    from objstate.world.store import open_store
    from objstate.world.words import world_words

    store = open_store(world)
    words = world_words(store.load(), store.building(), store.drives(), samples)
    text = json.dumps(words, indent=None if samples else 2)
    if out is None:
        print_text(text)
        return
    with whole(out, overwrite=overwrite) as file:
        file.write_text(text + "\n", encoding="utf-8")
    print_text(f"Written: {out}")


@app.command(epilog=ADOPT)
def adopt(
    world: Place,
    candidate: Annotated[str, typer.Argument(metavar="CANDIDATE", help="Its name in the result.")],
    result: Annotated[Path, typer.Option(metavar="DIR", help="The result that has it.")],
    building: Annotated[Path, typer.Option(metavar="URDF", help="The world's building.")],
    name: Annotated[str, typer.Option("--as", metavar="NAME", help="The object's name.")],
    out: Annotated[
        Path, typer.Option(metavar="URDF", help="The building with it, in the same folder.")
    ],
    height: Annotated[float, typer.Option(metavar="M", help="Of the object.")] = 1.0,
) -> None:
    """Keep an obstacle as an object: in a new building, and in the world.

    The world then belongs to the new building.
    """
    from objstate.maintenance.adoption import adopt as kept
    from objstate.world.store import open_store

    grown = kept(open_store(world), building, result, candidate, name, out, height)
    x, y, _ = grown[name].home.tolist()
    print_text(f"'{name}' stands at {x:.2f}, {y:.2f} m; {world} knows it, and is of {out} now.")
    print_text(f"Written: {out}")


app.command(epilog=HABITS)(habits)
app.command(epilog=WHEN)(when)


def _settings(config: Path | None) -> Settings | None:
    from objstate.config import load_settings

    return None if config is None else load_settings(config)


def _print(store: WorldStore, snapshot: Snapshot, as_json: bool) -> None:
    from objstate.world.words import snapshot_words

    if as_json:
        print_text(json.dumps(snapshot_words(snapshot, store.building()), indent=2))
        return
    print_text(f"{store.location}: building '{store.building()}', {_sources(store)}")
    print_table(world_table(snapshot))


def _sources(store: WorldStore) -> str:
    """From how many drives and reports a world has learnt."""
    are_reports = [each.is_report for each in store.drives()]
    counts = {"drive": are_reports.count(False), "report": are_reports.count(True)}
    words = [f"{count} {noun}{'s' if count != 1 else ''}" for noun, count in counts.items()]
    return ", ".join(words if counts["report"] else words[:1])
