"""``objstate next``"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from objstate.cli.console import print_parts, print_table, print_text
from objstate.cli.next_head import show_gazes
from objstate.cli.options import AsJson
from objstate.cli.parsing import POSE, TIME, parse_pose, parse_time
from objstate.cli.sensors import HEAD, SENSOR, parse_sensor
from objstate.cli.tables import duration, new_table, percent
from objstate.errors import SettingsError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rich.table import Table

    from objstate.maintenance import (
        Action,
        Coordinator,
        CoordinatorSettings,
        Plan,
        VerificationTask,
    )
    from objstate.world import Due, Snapshot, Task

HORIZON = 24.0 * 3600.0  # s, within which what a task wants verified is listed
EXAMPLES = """\b
Examples:
  objstate next --world world.db --building office.urdf --at 2.0,0,90deg
  objstate next --world world.db --building office.urdf --at 2,0,0 --for "pass door_07" --width 0.6
  objstate next --world world.db --building office.urdf --at 2,0,0 --when now \\
      --sensor front:range=8,view=180 --sensor back:range=4,view=90,yaw=180 --json
  objstate next --world world.db --building office.urdf --at 2,0,0 --task tasks.yaml
  objstate next --world world.db --building office.urdf --at 2,0,0 \\
      --head camera:view=60,turn=120,speed=90 --grid out/drive/grid.yaml --way "3,0;3,2"
"""


def next_(
    world: Annotated[
        str, typer.Option(metavar="WORLD", help="A file, or postgresql://USER@HOST/DATABASE.")
    ],
    building: Annotated[Path, typer.Option(metavar="URDF", help="The building.")],
    at: Annotated[str, typer.Option(metavar="POSE", help=f"Where the robot is: {POSE}.")],
    plans: Annotated[
        list[str] | None,
        typer.Option(
            "--for",
            metavar="PLAN",
            help="What is about to be done: pass, grab, go to or release, and an object. Repeatable.",
        ),
    ] = None,
    width: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            help="Of the robot, to pass doors and to drive. Default: 0.5, or twice the "
            "floor.robot_radius of --config.",
        ),
    ] = None,
    sensors: Annotated[
        list[str] | None,
        typer.Option("--sensor", metavar="SENSOR", help=f"{SENSOR}. Repeatable."),
    ] = None,
    when: Annotated[
        str | None,
        typer.Option(metavar="TIME", help=f"{TIME}. Default: when anything was last learnt."),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(metavar="YAML", help="Settings of the choice. Default: built in.")
    ] = None,
    task: Annotated[
        Path | None,
        typer.Option(metavar="YAML", help="Tasks, and the uncertainty that each allows."),
    ] = None,
    doing: Annotated[
        str | None, typer.Option(metavar="NAME", help="Which of these tasks. Default: the first.")
    ] = None,
    head: Annotated[
        str | None,
        typer.Option(
            metavar="HEAD", help=f"Where to turn a head, from where the robot is: {HEAD}."
        ),
    ] = None,
    grid: Annotated[
        Path | None,
        typer.Option(
            metavar="YAML",
            help="With --head: what is occupied, as `estimate --grid` wrote it. Default: what the "
            "world knows.",
        ),
    ] = None,
    way: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y;X,Y", help="With --head: where the robot is about to drive, watched most."
        ),
    ] = None,
    position_std: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            min=0,
            help="With --head: of the robot's position; landmarks count by it. Default: 0.",
        ),
    ] = None,
    stay: Annotated[
        bool, typer.Option("--stay", help="Only what can be seen without driving.")
    ] = False,
    top: Annotated[int, typer.Option(metavar="N", min=1, help="Actions to show.")] = 10,
    as_json: AsJson = False,
) -> None:
    """Choose what to look at next, from where, and why.

    Weighs the expected gains of looks at doors and furniture against the way there. Required looks
    come first, then the most useful action.
    """
    from objstate.building import load_building
    from objstate.config import load_yaml, parse_strict
    from objstate.gaze import Sensor
    from objstate.maintenance import (
        Coordinator,
        CoordinatorSettings,
        Plan,
        next_tasks,
        next_words,
        seconds_until_worthwhile,
    )
    from objstate.world import load_tasks
    from objstate.world.store import open_store

    _require("--task", task, {"--doing": doing})
    _require("--head", head, {"--grid": grid, "--way": way, "--position-std": position_std})
    if head is not None:
        _refuse_beside_head(
            {
                "--for": plans,
                "--width": width,
                "--sensor": sensors,
                "--config": config,
                "--task": task,
                "--stay": stay or None,
            }
        )
    pose, due = parse_pose(at, "--at"), [Plan.parse(text) for text in plans or []]
    robot = [parse_sensor(text) for text in sensors or []] or [Sensor("laser")]
    settings = CoordinatorSettings()
    if config is not None:
        settings = parse_strict(CoordinatorSettings, load_yaml(config), str(config))
    if width is not None:
        settings = settings.for_width(width)
    allowed = None if task is None else load_tasks(task).named(doing)
    model, store = load_building(building), open_store(world)
    store.check(model)
    zone = store.settings().calendar.zone
    stamp_ns = store.latest_ns() if when is None else parse_time(when, zone)
    known = store.load(objects=model.objects, since_ns=stamp_ns, until_ns=stamp_ns)
    moment = known.at(stamp_ns)
    if head is not None:
        std = position_std or 0.0
        show_gazes(model, moment, pose, head, grid, way, std, top, as_json=as_json)
        return
    coordinator = Coordinator(model, robot, settings, known.settings)
    ranked = coordinator.actions(moment.beliefs, pose, may_drive=not stay)
    wanted = () if allowed is None else known.due(allowed, HORIZON, moment.stamp_ns)
    tasks = next_tasks(coordinator, ranked, moment.beliefs, moment.stamp_ns, plans=due, due=wanted)
    wait: float | None = 0.0
    is_idle = coordinator.best(ranked) is None
    if is_idle:
        wait = seconds_until_worthwhile(
            coordinator, known, moment.stamp_ns, pose, may_drive=not stay
        )
    if as_json:
        print_text(json.dumps(next_words(moment, tasks, wanted, ranked[:top], wait), indent=2))
        return
    for plan in due:
        if not any(task.reason.startswith(f"before: {plan}") for task in tasks):
            print_text(_without_a_look(coordinator, moment, plan))
    if tasks:
        print_table(_tasks(coordinator, moment, tasks))
    if allowed is not None:
        print_parts([_due(allowed, wanted, moment.stamp_ns)])
    if is_idle:
        print_text(_nothing(ranked, settings, wait))
    if ranked:
        print_table(_ranked(coordinator, moment, ranked[:top]))


def _require(option: str, value: object, those: Mapping[str, object]) -> None:
    """Raises SettingsError where an option is missing without which others have no effect."""
    given = [name for name, each in those.items() if each is not None]
    if given and value is None:
        raise SettingsError(f"{given[0]} has no effect without {option}; give {option} too.")


def _refuse_beside_head(those: Mapping[str, object]) -> None:
    """Raises SettingsError for options that say nothing of where to turn a head."""
    given = [name for name, each in those.items() if each is not None]
    if given:
        raise SettingsError(f"{given[0]} has no effect with --head; leave one of them out.")


def _tasks(coordinator: Coordinator, moment: Snapshot, tasks: list[VerificationTask]) -> Table:
    numbers = ("gain", "way (m)", "last seen", "moved since")
    table = new_table("Next", ("object", "sensor", "why", "from (x, y, yaw)"), numbers)
    for task in tasks:
        action = task.action
        place = f"{action.pose[0]:.2f}, {action.pose[1]:.2f}, {_degrees(action.pose[2])}"
        figures = f"{action.gain:.1f}", f"{action.distance:.1f}"
        since = _since(moment, action.object)
        table.add_row(action.object, action.sensor, task.reason, place, *figures, *since)
    return table


def _due(allowed: Task, wanted: Sequence[Due], now_ns: int) -> Table | str:
    """Times at which allowed variances will be exceeded without a look."""
    if not wanted:
        return f"'{allowed.name}' asks for no look within {duration(HORIZON)}."
    table = new_table(
        f"To be verified for '{allowed.name}', within {duration(HORIZON)}",
        ("object", "coordinate"),
        ("variance", "allowed", "in"),
    )
    for each in wanted:
        wait = "now" if each.due_ns <= now_ns else duration((each.due_ns - now_ns) / 1e9)
        table.add_row(
            each.object, each.coordinate, f"{each.variance:.3g}", f"{each.allowed:.3g}", wait
        )
    return table


def _ranked(coordinator: Coordinator, moment: Snapshot, actions: list[Action]) -> Table:
    s = coordinator.settings.choice
    unit = "nats" if s.counting == "gain" else "nat hours"
    title = (
        f"By utility; worth the way above {s.least_utility:g}, with a gain above "
        f"{s.gain_threshold:g} nats; worth in {unit}"
    )
    numbers = ("x", "y", "yaw", "gain", "worth", "cost", "utility", "last seen", "moved since")
    table = new_table(title, ("object", "sensor"), numbers)
    for each in actions:
        figures = (each.gain, each.worth, each.cost, each.utility)
        x, y, yaw = each.pose
        cells = [f"{x:.2f}", f"{y:.2f}", _degrees(yaw), *(f"{value:.2f}" for value in figures)]
        table.add_row(each.object, each.sensor, *cells, *_since(moment, each.object))
    return table


def _since(moment: Snapshot, name: str) -> tuple[str, str]:
    """How long ago an object was last seen, and how probably it was moved since."""
    from objstate.maintenance import age

    seconds, moved = age(moment, name), moment.world.probability_moved(name, moment.stamp_ns)
    if seconds is None or moved is None:
        return "never", "-"
    return f"{duration(seconds)} ago", f"{percent(moved)} %"


def _without_a_look(coordinator: Coordinator, moment: Snapshot, plan: Plan) -> str:
    """Why nothing needs to be seen before a plan."""
    belief = moment[plan.object]
    if plan.verb != "pass" or belief.item.kind.value == "planar":
        return f"{plan}: needs no look."
    width = coordinator.robot_width
    clear = belief.probability_clear(width)
    passes = "passes" if clear > 0.5 else "doesn't pass"
    likely = max(clear, 1.0 - clear)
    return f"{plan}: needs no look; a robot {width:.2f} m wide {passes}, probability {likely:.2f}."


def _nothing(ranked: list[Action], settings: CoordinatorSettings, wait: float | None) -> str:
    """That nothing is worth a look, why, and for how long."""
    if not ranked:
        return "Nothing: from here no sensor sees any object."
    s = settings.choice
    gain, utility = max(each.gain for each in ranked), ranked[0].utility
    best = (
        f"Nothing is worth a look: the largest gain is {gain:.2f} nats, the largest utility "
        f"{utility:.2f}; needed are more than {s.gain_threshold:g} and {s.least_utility:g}"
    )
    if wait is None:
        return f"{best}. Within a day that stays so."
    return f"{best}. The next look is worth it in about {duration(wait)}."


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.0f}deg"
