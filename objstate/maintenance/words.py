"""What to look at next, in words that JSON has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from objstate.maintenance.coordinator import Action
from objstate.maintenance.tasks import VerificationTask
from objstate.world import Due, Snapshot


def age(moment: Snapshot, name: str) -> float | None:
    """s since an object was last seen; None where it never was."""
    seen = moment[name].last_observed_ns
    return None if seen is None else (moment.stamp_ns - seen) / 1e9


def next_words(
    moment: Snapshot,
    tasks: list[VerificationTask],
    wanted: Sequence[Due],
    actions: list[Action],
    wait: float | None,
) -> dict[str, Any]:
    """What to look at next, in SI units and radians; ``wait`` is in s until an action is worth it."""

    def words(action: Action) -> dict[str, Any]:
        return _action_words(action) | _since_words(moment, action.object)

    return {
        "tasks": [
            {
                **words(task.action),
                "why": task.reason,
                "lower": task.expected.lower.tolist(),
                "upper": task.expected.upper.tolist(),
            }
            for task in tasks
        ],
        "actions": [words(action) for action in actions],
        "due": [asdict(each) for each in wanted],
        "next_worthwhile_in_s": wait,
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


def _since_words(moment: Snapshot, name: str) -> dict[str, Any]:
    moved = moment.world.probability_moved(name, moment.stamp_ns)
    return {"last_observed_ns": moment[name].last_observed_ns, "p_moved_since": moved}
