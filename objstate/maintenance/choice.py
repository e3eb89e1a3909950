"""Which action next: gain against cost (sections 5.2 and 5.3, Elfring et al. 2014)."""

from __future__ import annotations

import numpy as np

from objstate.config import NonNegative, Positive, Strict
from objstate.geometry import FloatArray


class ChoiceSettings(Strict):
    """What makes an action worth its way."""

    gain_threshold: float = 1.0  # nats, IG_thr: actions that promise no more are left undone
    gain_norm: Positive = 5.0  # nats, IG_norm: the gain that weighs as much as 1
    cost_weight: NonNegative = 0.75  # alpha
    cost_scale: Positive = 10.0  # m, V_scale: the way that costs 1; e.g. the length of the room
    measuring_cost: NonNegative = 0.0  # of each action, besides its way


def costs(distances: FloatArray, settings: ChoiceSettings) -> FloatArray:
    """Eq. (8), and what measuring costs: of ways of ``distances`` (a,) m."""
    return np.asarray(distances / settings.cost_scale + settings.measuring_cost)


def utilities(gains: FloatArray, costs: FloatArray, settings: ChoiceSettings) -> FloatArray:
    """Eq. (9), of expected gains (a,) nats and costs (a,)."""
    return np.asarray(gains / settings.gain_norm - settings.cost_weight * costs)


def best(gains: FloatArray, utilities: FloatArray, settings: ChoiceSettings) -> int | None:
    """Eqs. (7), (10) and (11): the most useful of the actions above the threshold, if any."""
    worthwhile = gains > settings.gain_threshold
    if not worthwhile.any():
        return None
    return int(np.where(worthwhile, utilities, -np.inf).argmax())
