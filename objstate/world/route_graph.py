"""Costs of a route graph's edges, in the form of Nav2's service ``DynamicEdges``."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from objstate.errors import QueryError
from objstate.geometry import FloatArray
from objstate.world.blocking import checked_path, states_on
from objstate.world.world import Snapshot

LARGEST_ID = 2**16 - 1  # nav2_msgs counts edges by uint16
JOINED = 0.01  # m, within which the end of one edge is the beginning of another


@dataclass(frozen=True, eq=False)
class RouteEdge:
    """An edge of a route graph: the way from one node to another."""

    edgeid: int
    path: ArrayLike  # (n, 2) m, in the building's frame


@dataclass(frozen=True)
class EdgeCost:
    """``nav2_msgs/msg/EdgeCost``."""

    edgeid: int
    cost: float


@dataclass(frozen=True)
class DynamicEdges:
    """The request of ``nav2_msgs/srv/DynamicEdges``, field by field."""

    closed_edges: tuple[int, ...]
    opened_edges: tuple[int, ...]
    adjust_edges: tuple[EdgeCost, ...]

    def to_dict(self) -> dict[str, Any]:
        """The same in words that JSON and ROS' tools have."""
        return {
            "closed_edges": list(self.closed_edges),
            "opened_edges": list(self.opened_edges),
            "adjust_edges": [asdict(cost) for cost in self.adjust_edges],
        }


def dynamic_edges(
    snapshot: Snapshot,
    edges: Iterable[RouteEdge],
    robot_radius: float,
    *,
    detour_cost: float,
    close_from: float = 0.9,
) -> DynamicEdges:
    """A route server's data about movable objects on its edges.

    An edge that is blocked with a probability of ``close_from`` or more is closed, every other one
    opened. The cost of an edge is the expected cost of its blockage: the probability times
    ``detour_cost``, the cost of returning from a closed way, in the unit of the graph's costs. An
    object that blocks several consecutive edges is charged once along them: each state's
    probability is divided by the number of edges in the longest row through the edge that it
    blocks. Nav2 adds the cost to the results of its other scorers. Every request names every edge,
    since Nav2 keeps earlier requests.

    Raises QueryError for a path, an edge's number, or figures that are invalid.
    """
    if not (0.0 <= detour_cost < math.inf and 0.0 < close_from <= 1.0):
        raise QueryError(
            f"A detour cost of {detour_cost} must be 0 or more, and finite, and close_from "
            f"({close_from}) above 0 and at most 1."
        )
    paths = _paths(edges, robot_radius)
    blocked, shared = _chances(snapshot, list(paths.values()), robot_radius)
    closed = tuple(
        edgeid for edgeid, chance in zip(paths, blocked, strict=True) if chance >= close_from
    )
    return DynamicEdges(
        closed_edges=closed,
        opened_edges=tuple(edgeid for edgeid in paths if edgeid not in closed),
        adjust_edges=tuple(
            EdgeCost(edgeid, float(detour_cost) * chance)
            for edgeid, chance in zip(paths, shared.tolist(), strict=True)
        ),
    )


def _paths(edges: Iterable[RouteEdge], robot_radius: float) -> dict[int, FloatArray]:
    """Paths by the numbers of their edges. Raises QueryError."""
    paths: dict[int, FloatArray] = {}
    for edge in edges:
        edgeid = _checked_id(edge.edgeid)
        if edgeid in paths:
            raise QueryError(f"Two edges have the number {edgeid}; give each its own.")
        paths[edgeid] = checked_path(edge.path, robot_radius)
    return paths


def _checked_id(edgeid: int) -> int:
    """The number of an edge, whatever integer type it has. Raises QueryError."""
    try:
        number = operator.index(edgeid)
    except TypeError:
        number = -1
    if not 0 <= number <= LARGEST_ID:
        raise QueryError(
            f"Nav2 can't have an edge {edgeid!r}; number with integers from 0 to {LARGEST_ID}."
        )
    return number


def _chances(
    snapshot: Snapshot, paths: Sequence[FloatArray], robot_radius: float
) -> tuple[FloatArray, FloatArray]:
    """(e,) how probably each edge is blocked, and what of that it is charged with."""
    free, uncharged = np.ones(len(paths)), np.ones(len(paths))
    follows = _successors(paths)
    for name in snapshot:
        belief = snapshot[name]
        found = ((e, states_on(belief, path, robot_radius)) for e, path in enumerate(paths))
        hits = {e: hit for e, hit in found if hit is not None}
        if not hits:
            continue
        patterns, which = np.unique(np.array(list(hits.values())), axis=1, return_inverse=True)
        mass = belief.presence * np.bincount(
            which.reshape(-1), belief.weights.values, patterns.shape[1]
        )
        rows = _rows(list(hits), patterns, follows)
        free[list(hits)] *= 1.0 - (patterns @ mass).clip(max=1.0)
        uncharged[list(hits)] *= 1.0 - ((patterns / rows) @ mass).clip(max=1.0)
    return 1.0 - free, 1.0 - uncharged


def _successors(paths: Sequence[FloatArray]) -> Mapping[int, tuple[int, ...]]:
    """Which edges begin where each one ends, but for its own way back."""
    if not paths:
        return {}
    starts, ends = (np.array([path[k] for path in paths]) for k in (0, -1))
    meets = np.linalg.norm(ends[:, None] - starts, axis=2) <= JOINED  # (e, e)
    back = meets & meets.T
    return {e: tuple(np.flatnonzero(row).tolist()) for e, row in enumerate(meets & ~back)}


def _rows(
    edges: Sequence[int], patterns: FloatArray, follows: Mapping[int, tuple[int, ...]]
) -> FloatArray:
    """(e, p) edges in the longest direct row of blocked ones through each edge, by pattern; or 1."""
    rows = np.ones(patterns.shape)
    for p, blocked in enumerate(patterns.T):
        among = {e for e, is_blocked in zip(edges, blocked, strict=True) if is_blocked}
        precedes = {e: [f for f in among if e in follows[f]] for e in among}
        succeeds = {e: [f for f in follows[e] if f in among] for e in among}
        for k, e in enumerate(edges):
            if e in among:
                rows[k, p] = 1 + _farthest(e, succeeds) + _farthest(e, precedes)
    return rows


def _farthest(edge: int, to: Mapping[int, Sequence[int]]) -> int:
    """Number of edges beyond an edge on the way to the farthest, each reached by the fewest."""
    reached, front, steps = {edge}, [edge], -1
    while front:
        steps += 1
        front = list(dict.fromkeys(f for e in front for f in to[e] if f not in reached))
        reached.update(front)
    return steps
