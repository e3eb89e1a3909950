"""A fixed path along all objects."""

from __future__ import annotations

import numpy as np

from objstate.geometry import FloatArray, IntArray


def shortest_tour(distance: FloatArray) -> IntArray:
    """A short round trip (n,) by distances (n, n): the nearest next, then untangled by 2-opt."""
    order = [0]
    while len(order) < len(distance):
        left = [k for k in range(len(distance)) if k not in order]
        order.append(min(left, key=lambda k: distance[order[-1], k]))
    return np.array(_untangled(order, distance))


def _untangled(order: list[int], distance: FloatArray) -> list[int]:
    """The tour with stretches turned round as long as that makes it shorter."""
    count, improved = len(order), True
    while improved:
        improved = False
        for start in range(count - 1):
            for end in range(start + 1, count):
                turned = order[:start] + order[start : end + 1][::-1] + order[end + 1 :]
                if _length(turned, distance) < _length(order, distance) - 1e-9:
                    order, improved = turned, True
    return order


def _length(order: list[int], distance: FloatArray) -> float:
    return float(distance[order, np.roll(order, -1)].sum())
