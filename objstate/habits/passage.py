"""How long until a door is in one of some regions: first passages of its process."""

from __future__ import annotations

import numpy as np

from objstate.geometry import BoolArray, FloatArray
from objstate.habits.calendar import CELL_NS, NANOSECONDS
from objstate.habits.forecast import Forecast

STEPS = 3  # of a cell, after each of which it is asked whether the door has been there


def waiting(
    forecast: Forecast, state: FloatArray, regions: BoolArray, begin_ns: int, end_ns: int
) -> tuple[FloatArray, FloatArray]:
    """Seconds (n,) from ``begin_ns`` on, and (n,) how probably the door hasn't been in ``regions`` by then.

    ``state`` (d, s) is that at ``begin_ns``, ``regions`` (r,) says which of them are waited for.
    """
    from scipy.linalg import expm

    away = ~np.repeat(regions, 2)
    left = state[:, away]
    of, step_ns = forecast.process, CELL_NS // STEPS
    apart = np.arange(len(away)) // 2
    ways = (apart[:, None] != apart).astype(float)
    steps: dict[int, FloatArray] = {}
    times, alive = [0.0], [float(left.sum(axis=1).mean())]
    now = begin_ns
    while now < end_ns and alive[-1] > 0.0:
        until = min(now - now % step_ns + step_ns, end_ns)
        key = forecast.calendar.key_at(now)
        if until - now == step_ns and key in steps:
            passes = steps[key]
        else:
            rates = of.leaves[:, key, :, None] * of.arrives[:, key, None, :] * ways
            states = np.arange(len(away))
            rates[:, states, states] = -rates.sum(axis=2)
            passes = expm(rates[:, away][:, :, away] * ((until - now) / NANOSECONDS))
            if until - now == step_ns:
                steps[key] = passes
        left = (left[:, None, :] @ passes)[:, 0]
        now = until
        times.append((now - begin_ns) / NANOSECONDS)
        alive.append(float(left.sum(axis=1).mean()))
    return np.array(times), np.array(alive)
