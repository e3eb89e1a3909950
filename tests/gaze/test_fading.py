"""How long what is known lasts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.config import Dynamics, ObjectRule, Settings
from objstate.gaze.entropy import belief_entropy
from objstate.gaze.fading import Fading, fadings
from objstate.objects import filter_for
from tests.gaze.places import chest, two_rooms

ROOMS = two_rooms(chest("chest", 2.0, 1.0), chest("other", -2.0, 1.0))
STD_M, STD_RAD = 0.02, 0.01


def moved(rate: float) -> Settings:
    dynamics = Dynamics(moves_per_hour=rate, drift_deg=0.0, drift_m=0.0)
    return Settings(objects=(ObjectRule(match="*", dynamics=dynamics),))


def fading(name: str, rate: float) -> Fading:
    return Fading.of(ROOMS.objects[name], moved(rate), STD_M, STD_RAD)


SLOW, QUICK = ({name: fading(name, rate) for name in ("door", "chest")} for rate in (0.1, 5.0))


@pytest.mark.parametrize("name", ["door", "chest"])
def test_what_is_known_fades_to_what_is_known_beforehand(name: str) -> None:
    entropies = QUICK[name].entropies
    prior = filter_for(ROOMS.objects[name], moved(5.0)).prior(np.random.default_rng(0))
    assert (np.diff(entropies) >= 0.0).all()
    assert entropies[0] < entropies[-1] - 0.5
    # half known, half as beforehand is less certain than either
    assert -0.1 <= entropies[-1] - belief_entropy(prior) <= np.log(2.0)


@pytest.mark.parametrize("name", ["door", "chest"])
def test_a_nat_of_what_seldom_moves_lasts_longer(name: str) -> None:
    entropy = SLOW[name].entropies[-1]
    assert SLOW[name].worth(entropy, 1.0) > 5.0 * QUICK[name].worth(entropy, 1.0) > 0.0


@given(st.floats(-8.0, 1.0), st.floats(0.0, 4.0), st.floats(0.0, 4.0))
def test_what_two_looks_are_worth_adds_up(entropy: float, first: float, second: float) -> None:
    chest = SLOW["chest"]
    apart = chest.worth(entropy, first) + chest.worth(entropy - first, second)
    assert apart == pytest.approx(chest.worth(entropy, first + second), abs=1e-9)
    assert chest.worth(entropy, first) >= 0.0


def test_the_longer_an_object_was_left_alone_the_more_each_nat_of_a_look_lasts() -> None:
    chest = SLOW["chest"]
    each = [chest.worth(entropy, 1.0) for entropy in np.linspace(-7.0, -1.0, 7)]
    assert (np.diff(each) > 0.0).all()


def test_what_is_as_well_known_as_can_be_is_worth_no_look() -> None:
    assert SLOW["door"].worth(SLOW["door"].entropies[0], 1.0) == 0.0


def test_a_look_at_once_is_worth_what_waiting_costs() -> None:
    """Whittle's index of an age: the age times the entropy, without what has been paid till then."""
    chest = SLOW["chest"]
    ages, entropies = chest.ages[:30], chest.entropies[:30]
    paid = np.sum(np.diff(ages) * (entropies[1:] + entropies[:-1]) / 2.0)
    index = ages[-1] * entropies[-1] - paid
    assert chest.worth(float(entropies[-1]), 100.0) == pytest.approx(index)


def test_objects_that_fade_alike_are_followed_once() -> None:
    found = fadings(ROOMS.objects, moved(1.0), STD_M, STD_RAD)
    assert found["chest"] is found["other"]
    assert found["door"] is not found["chest"]
