"""Costs of a route graph's edges, in the form of Nav2's service ``DynamicEdges``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from numpy.typing import ArrayLike

from objstate.errors import WorldError
from objstate.world.world import Snapshot

LARGEST_ID = 2**16 - 1  # nav2_msgs counts edges by uint16


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
    """What a route server should know of movable objects on its edges.

    An edge that is blocked with a probability of ``close_from`` or more is closed, every
    other one opened. The cost of an edge is what its blockage costs on average: the
    probability times ``detour_cost``, the cost of coming back from a closed way, in the unit
    of the graph's costs. Nav2 adds it to what its other scorers say of the edge. Every edge
    is named each time, since Nav2 keeps what it was told before.

    Raises WorldError for a path, an edge's number, or figures that can't be.
    """
    if not (detour_cost >= 0.0 and 0.0 < close_from <= 1.0):
        raise WorldError(
            f"A detour cost of {detour_cost} must be 0 or more, and close_from ({close_from}) "
            "above 0 and at most 1."
        )
    chances = {
        _checked(edge.edgeid): snapshot.blocked(edge.path, robot_radius).probability
        for edge in edges
    }
    closed = tuple(edgeid for edgeid, chance in chances.items() if chance >= close_from)
    return DynamicEdges(
        closed_edges=closed,
        opened_edges=tuple(edgeid for edgeid in chances if edgeid not in closed),
        adjust_edges=tuple(
            EdgeCost(edgeid, detour_cost * chance) for edgeid, chance in chances.items()
        ),
    )


def _checked(edgeid: int) -> int:
    if not 0 <= edgeid <= LARGEST_ID:
        raise WorldError(f"The edge {edgeid} can't be told to Nav2; number from 0 to {LARGEST_ID}.")
    return edgeid
