"""What planners ask, answered from a world."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from objstate.building.model import Kind
from objstate.objects import ObjectBelief
from objstate.service.believed import Believed, known_object
from objstate.service.moments import words_of
from objstate.service.problems import Problem
from objstate.world.door_modes import door_modes
from objstate.world.route_graph import RouteEdge, dynamic_edges
from objstate.world.words import belief_words

MOST_POINTS = 10_000  # of a path
FRESH_NS = 10 * 10**9  # for which a belief that fades counts as unchanged


class Strict(BaseModel):
    """A body that holds what it should and nothing else."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class PathQuestion(Strict):
    """A round robot's way, with the time at which it comes to each point, or one for all."""

    path: list[tuple[float, float]] = Field(min_length=2, max_length=MOST_POINTS)
    radius: float = Field(gt=0.0, description="m, of the robot")
    at: int | None = Field(None, description="ns since 1970; default: now")
    arrivals: list[int] | None = Field(None, description="ns since 1970, one for each point")


class Edge(Strict):
    """An edge of a route graph."""

    edgeid: int
    path: list[tuple[float, float]] = Field(min_length=2, max_length=MOST_POINTS)


class EdgesQuestion(Strict):
    """What a route server wants to know of its edges."""

    edges: list[Edge] = Field(min_length=1)
    radius: float = Field(gt=0.0, description="m, of the robot")
    detour_cost: float = Field(ge=0.0, description="of coming back from a closed way")
    close_from: float = Field(0.9, gt=0.0, le=1.0)
    at: int | None = None


class Questions:
    """The answers of one service."""

    def __init__(self, believed: Believed) -> None:
        self._believed = believed

    def objects(self, stamp_ns: int | None) -> dict[str, Any]:
        """All objects at a moment."""
        when = _when(stamp_ns)
        snapshot = self._believed.at(when)
        return self._stamped(when) | {
            "objects": [self._words(snapshot[name], when) for name in snapshot]
        }

    def object(self, name: str, stamp_ns: int | None, samples: bool) -> dict[str, Any]:
        """One object at a moment."""
        when = _when(stamp_ns)
        belief = self._belief(name, when)
        return self._stamped(when) | self._words(belief, when, samples)

    def history(self, name: str, most: int) -> dict[str, Any]:
        """What was learnt of an object, in time order, at most the newest so many."""
        known = self._believed.history(known_object(self._believed.now.world, name), most)
        return {"object": name, "history": [belief_words(belief) for belief in known]}

    def passage(
        self, name: str, width: float, length: float, stamp_ns: int | None
    ) -> dict[str, Any]:
        """How probably a robot of a width and length, m, passes a door at a moment."""
        when = _when(stamp_ns)
        belief = self._belief(name, when)
        if belief.item.kind is Kind.PLANAR:
            raise Problem(422, f"'{name}' is furniture; nothing passes through it.", "Ask a door.")
        clear = belief.clear_width_for(length)
        lower, upper = clear.interval()
        return self._stamped(when) | {
            "object": name,
            "width": width,
            "length": length,
            "probability": belief.probability_clear(width, length),
            "clear_width": {"mean": clear.mean, "lower": lower, "upper": upper},
            "last_observed_ns": belief.last_observed_ns,
        }

    def blocked(self, asked: PathQuestion) -> dict[str, Any]:
        """How probably something movable is in a robot's way, and what."""
        if asked.arrivals is None:
            when = _when(asked.at)
            snapshot = self._believed.at(when)
            found = snapshot.blocked(asked.path, asked.radius)
            chances = {each.object: each.probability for each in found.blockers}
            return self._stamped(when) | _blockage(chances)
        if asked.at is not None or len(asked.arrivals) != len(asked.path):
            detail = f"{len(asked.path)} points need as many arrivals, and no 'at'."
            raise Problem(422, detail, "Give one arrival for each point.")
        if sorted(asked.arrivals) != asked.arrivals:
            raise Problem(422, "The arrivals go back in time.", "Give them in the order of points.")
        chances = {}
        for begin, arrival in enumerate(asked.arrivals[1:]):
            snapshot = self._believed.at(arrival)
            leg = snapshot.blocked(asked.path[begin : begin + 2], asked.radius)
            for each in leg.blockers:
                chances[each.object] = max(chances.get(each.object, 0.0), each.probability)
        return self._stamped(asked.arrivals[-1]) | _blockage(chances)

    def edges(self, asked: EdgesQuestion) -> dict[str, Any]:
        """The request of Nav2's ``DynamicEdges``."""
        when = _when(asked.at)
        edges = [RouteEdge(edge.edgeid, edge.path) for edge in asked.edges]
        snapshot = self._believed.at(when)
        told = dynamic_edges(
            snapshot,
            edges,
            asked.radius,
            detour_cost=asked.detour_cost,
            close_from=asked.close_from,
        )
        return self._stamped(when) | told.to_dict()

    def modes(self, width: float, length: float, stamp_ns: int | None) -> dict[str, Any]:
        """All doors by the numbers of Open-RMF's ``DoorMode``."""
        when = _when(stamp_ns)
        modes = door_modes(self._believed.at(when), width, length=length)
        doors = {name: {"value": int(mode), "name": mode.name} for name, mode in modes.items()}
        return self._stamped(when) | {"doors": doors}

    def revision_of(self, name: str | None, stamp_ns: int | None) -> str:
        """What changes when an answer about an object, or all, may: as something is learnt, or fades.

        Answers about a moment stay; those about now are the same for ``FRESH_NS``.
        """
        known = self._believed.now
        if name is None:
            learnt = f"{known.revision}-{self._believed.live_ns}"
        else:
            known_object(known.world, name)
            learnt = f"{known.revision}-{self._believed.learnt_ns(name)}"
        return learnt if stamp_ns is not None else f"{learnt}-{time.time_ns() // FRESH_NS}"

    def _belief(self, name: str, when: int) -> ObjectBelief:
        known_object(self._believed.now.world, name)
        return self._believed.at(when, name)[name]

    def _words(self, belief: ObjectBelief, when: int, samples: bool = False) -> dict[str, Any]:
        seen = belief.last_observed_ns
        return belief_words(belief, samples) | {"predicted": seen is None or seen < when}

    def _stamped(self, when: int) -> dict[str, Any]:
        return {"revision": self._believed.now.revision, "at_ns": when, "at": words_of(when)}


def _when(stamp_ns: int | None) -> int:
    return time.time_ns() if stamp_ns is None else stamp_ns


def _blockage(chances: dict[str, float]) -> dict[str, Any]:
    """Objects count as independent, and one that is in the way of two legs once."""
    free = 1.0
    for chance in chances.values():
        free *= 1.0 - chance
    return {"probability": 1.0 - free, "blockers": _ranked(chances)}


def _ranked(chances: dict[str, float]) -> Sequence[dict[str, Any]]:
    ranked = sorted(chances.items(), key=lambda each: (-each[1], each[0]))
    return [{"object": name, "probability": chance} for name, chance in ranked]
