"""Which action next: gain against cost (sections 5.2 and 5.3, Elfring et al. 2014)."""

from __future__ import annotations

from typing import Literal

import numpy as np

from objstate.config import NonNegative, Positive, Strict
from objstate.geometry import FloatArray


class ChoiceSettings(Strict):
    """What makes an action worth its way."""

    gain_threshold: float = 1.0  # nats, IG_thr: actions that promise no more are left undone
    counting: Literal["lasting gain", "gain"] = "lasting gain"  # the paper counts the gain alone
    gain_norm: Positive = 5.0  # nat h of lasting gain, or nats (IG_norm), that weigh as much as 1
    cost_weight: NonNegative = 0.75  # alpha
    cost_scale: Positive = 10.0  # m, V_scale: the way that costs 1; e.g. the length of the room
    measuring_cost: NonNegative = 0.0  # of each action, besides its way
    least_utility: float = 0.0  # that of waiting: less useful actions are left undone; -inf: none


def costs(distances: FloatArray, settings: ChoiceSettings) -> FloatArray:
    """Eq. (8), and what measuring costs: of ways of ``distances`` (a,) m."""
    return np.asarray(distances / settings.cost_scale + settings.measuring_cost)


def utilities(worths: FloatArray, costs: FloatArray, settings: ChoiceSettings) -> FloatArray:
    """Eq. (9), from expected gains (a,), as the settings count them, and costs (a,)."""
    return np.asarray(worths / settings.gain_norm - settings.cost_weight * costs)


def best(gains: FloatArray, utilities: FloatArray, settings: ChoiceSettings) -> int | None:
    """Eqs. (7), (10) and (11): the most useful of the actions above the thresholds, if any."""
    worthwhile = (gains > settings.gain_threshold) & (utilities > settings.least_utility)
    if not worthwhile.any():
        return None
    return int(np.where(worthwhile, utilities, -np.inf).argmax())
