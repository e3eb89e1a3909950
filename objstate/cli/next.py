"""``objstate next``"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from objstate.cli.console import print_table, print_text
from objstate.cli.options import AsJson
from objstate.cli.parsing import POSE, TIME, parse_pose, parse_time
from objstate.cli.sensors import SENSOR, parse_sensor
from objstate.cli.tables import new_table

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.maintenance import Action, CoordinatorSettings, VerificationTask

EXAMPLES = """\b
Examples:
  objstate next --world world.db --building office.urdf --at 2.0,0,90deg
  objstate next --world world.db --building office.urdf --at 2,0,0 --for "pass door_07"
  objstate next --world world.db --building office.urdf --at 2,0,0 --when now \\
      --sensor front:range=8,view=180 --sensor back:range=4,view=90 --json
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
    stay: Annotated[
        bool, typer.Option("--stay", help="Only what can be seen without driving.")
    ] = False,
    top: Annotated[int, typer.Option(metavar="N", min=1, help="Actions to show.")] = 10,
    as_json: AsJson = False,
) -> None:
    """What to look at next, from where, and why.

    Weighs what looks would tell of doors and furniture against the way there. First come the
    objects with which something is about to be done, then the most useful action.
    """
    from objstate.building import load_building
    from objstate.config import load_yaml, parse_strict
    from objstate.gaze import Sensor
    from objstate.maintenance import Coordinator, CoordinatorSettings, Plan, next_tasks
    from objstate.world.store import open_store

    pose, due = parse_pose(at, "--at"), [Plan.parse(text) for text in plans or []]
    robot = [parse_sensor(text) for text in sensors or []] or [Sensor("laser")]
    settings = CoordinatorSettings()
    if config is not None:
        settings = parse_strict(CoordinatorSettings, load_yaml(config), str(config))
    model = load_building(building)
    known = open_store(world).load()
    moment = known.at(None if when is None else parse_time(when))
    coordinator = Coordinator(model, robot, settings, known.settings)
    ranked = coordinator.actions(moment.beliefs, pose, may_drive=not stay)
    tasks = next_tasks(coordinator, ranked, moment.beliefs, moment.stamp_ns, plans=due)
    if as_json:
        print_text(json.dumps(_words(tasks, ranked[:top]), indent=2))
        return
    print_table(_tasks(tasks))
    print_table(_ranked(ranked[:top], settings))


def _tasks(tasks: list[VerificationTask]) -> Table:
    table = new_table("Next", ("object", "sensor", "why", "from (x, y, yaw)"), ("gain", "way (m)"))
    for task in tasks:
        action = task.action
        place = f"{action.pose[0]:.2f}, {action.pose[1]:.2f}, {_degrees(action.pose[2])}"
        gain, distance = f"{action.gain:.1f}", f"{action.distance:.1f}"
        table.add_row(action.object, action.sensor, task.reason, place, gain, distance)
    return table


def _ranked(actions: list[Action], settings: CoordinatorSettings) -> Table:
    s = settings.choice
    unit = "nats" if s.counting == "gain" else "nat hours"
    title = (
        f"By utility; worth the way above {s.least_utility:g}, with a gain above "
        f"{s.gain_threshold:g} nats; worth in {unit}"
    )
    numbers = ("x", "y", "yaw", "gain", "worth", "cost", "utility")
    table = new_table(title, ("object", "sensor"), numbers)
    for each in actions:
        figures = (each.gain, each.worth, each.cost, each.utility)
        x, y, yaw = each.pose
        cells = [f"{x:.2f}", f"{y:.2f}", _degrees(yaw), *(f"{value:.2f}" for value in figures)]
        table.add_row(each.object, each.sensor, *cells)
    return table


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.0f}deg"


def _words(tasks: list[VerificationTask], actions: list[Action]) -> dict[str, Any]:
    return {
        "tasks": [
            {
                **_action_words(task.action),
                "why": task.reason,
                "lower": task.expected.lower.tolist(),
                "upper": task.expected.upper.tolist(),
            }
            for task in tasks
        ],
        "actions": [_action_words(action) for action in actions],
    }


def _action_words(action: Action) -> dict[str, Any]:
    return {
        "object": action.object,
        "sensor": action.sensor,
        "pose": action.pose.tolist(),
        "gain": action.gain,
        "gains": dict(action.gains),
        "worth": action.worth,
        "distance": action.distance,
        "cost": action.cost,
        "utility": action.utility,
    }
