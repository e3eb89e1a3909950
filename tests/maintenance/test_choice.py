"""Gain against cost: eqs. (7) to (11) of Elfring et al. 2014."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.maintenance.choice import ChoiceSettings, best, costs, utilities

gains = st.lists(st.floats(0.0, 30.0), min_size=1, max_size=8)


def test_costs_and_utilities_are_those_of_the_paper() -> None:
    s = ChoiceSettings(gain_norm=5.0, cost_weight=0.75, cost_scale=10.0, measuring_cost=0.1)
    cost = costs(np.array([0.0, 5.0]), s)
    assert cost == pytest.approx([0.1, 0.6])
    assert utilities(np.array([5.0, 10.0]), cost, s) == pytest.approx([0.925, 1.55])


@given(gains, st.floats(0.0, 30.0))
def test_the_best_is_above_the_threshold_and_no_other_such_is_more_useful(
    values: list[float], threshold: float
) -> None:
    gain, s = np.array(values), ChoiceSettings(gain_threshold=threshold, least_utility=-np.inf)
    utility = utilities(gain, costs(np.arange(len(gain), dtype=float), s), s)
    chosen = best(gain, utility, s)
    if chosen is None:
        assert (gain <= threshold).all()
    else:
        assert gain[chosen] > threshold
        assert (utility[gain > threshold] <= utility[chosen]).all()


@given(gains)
def test_of_equal_gains_the_nearest_is_the_best(values: list[float]) -> None:
    s = ChoiceSettings(gain_threshold=-1.0, least_utility=-np.inf)
    distances = np.arange(len(values), dtype=float)
    equal = np.full(len(values), values[0])
    assert best(equal, utilities(equal, costs(distances, s), s), s) == 0


@given(gains)
def test_what_is_less_useful_than_waiting_is_left_undone(values: list[float]) -> None:
    gain, s = np.array(values), ChoiceSettings(gain_threshold=-1.0)
    utility = utilities(gain, costs(10.0 * np.arange(1.0, len(gain) + 1), s), s)
    chosen = best(gain, utility, s)
    if chosen is None:
        assert (utility <= 0.0).all()
    else:
        assert utility[chosen] == utility.max() > 0.0
