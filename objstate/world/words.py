"""Beliefs and worlds in words that JSON has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from objstate.building.model import Kind
from objstate.objects import ObjectBelief
from objstate.world.habit_words import habit_words, piece_words, season_word
from objstate.world.world import Snapshot, World

if TYPE_CHECKING:
    from objstate.world.store import DriveEntry


def belief_words(belief: ObjectBelief, samples: bool = False) -> dict[str, Any]:
    """A belief with its central 90 %: of doors also the passage, of furniture the floor it covers.

    SI units and radians, times in nanoseconds. With ``samples`` its states and weights too.
    """
    lower, upper = belief.interval()
    figures = zip(belief.mean, belief.std, lower, upper, belief.median, strict=True)
    names = ("mean", "std", "lower", "upper", "median")
    words: dict[str, Any] = {
        "object": belief.item.name,
        "kind": belief.item.kind.value,
        "stamp_ns": belief.stamp_ns,
        "last_observed_ns": belief.last_observed_ns,
        "state": {
            coordinate: dict(zip(names, map(float, five), strict=True))
            for coordinate, five in zip(belief.item.coordinates, figures, strict=True)
        },
        "presence": belief.presence,
    }
    if belief.item.kind is Kind.PLANAR:
        words["footprint"] = belief.footprint().tolist()
    else:
        narrowest, widest = belief.clear_width.interval()
        words["clear_width"] = {
            "mean": belief.clear_width.mean,
            "lower": narrowest,
            "upper": widest,
        }
    words["attributes"] = attributes(belief)
    if samples:
        words["states"] = belief.states.tolist()
        words["weights"] = belief.weights.values.tolist()
    return words


def attributes(belief: ObjectBelief) -> dict[str, dict[str, float]]:
    """What isn't a coordinate, as distributions: given ones, and whether it is there or closed."""
    known = {name: dict(values) for name, values in belief.attributes.items()}
    closed = belief.probability_closed
    if belief.item.kind is Kind.PLANAR:
        known["present"] = {"true": belief.presence, "false": 1.0 - belief.presence}
    elif closed is not None:
        known["closed"] = {"true": closed, "false": 1.0 - closed}
    return known


def snapshot_words(snapshot: Snapshot, building: str) -> dict[str, Any]:
    """All objects at one moment."""
    return {
        "building": building,
        "stamp_ns": snapshot.stamp_ns,
        "objects": [belief_words(snapshot[name]) for name in snapshot],
    }


def history_words(world: World, name: str, samples: bool = False) -> list[dict[str, Any]]:
    """All that was learnt of an object, in time order. Raises WorldError for an unknown one."""
    return [belief_words(belief, samples) for belief in world.history(name)]


def world_words(
    world: World, building: str, drives: list[DriveEntry], samples: bool = False
) -> dict[str, Any]:
    """Everything: drives, and what was learnt of each object."""
    season = season_word(world)
    return {
        "building": building,
        "drives": [
            {"digest": drive.digest, "begin_ns": drive.begin_ns, "end_ns": drive.end_ns}
            for drive in drives
        ],
        "objects": {name: history_words(world, name, samples) for name in world.objects},
        "habits": habit_words(world),
        "furniture_habits": piece_words(world),
        **({} if season is None else {"season": season}),  # of the habits' weeks
    }
