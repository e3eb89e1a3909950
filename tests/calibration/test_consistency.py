"""Parts of a drive against each other."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.calibration.adjustment import Adjusted, Unknowns
from objstate.calibration.consistency import birge_ratios


def part(value: float, std: float, frames: tuple[str, ...] = ("laser",)) -> Adjusted:
    lasers = np.full((len(frames), 4), value)
    unknowns = Unknowns(np.zeros((1, 3)), np.full(2, value), lasers)
    return Adjusted(frames, unknowns, std**2 * np.eye(2 + lasers.size), 0.02, 0.01, 0.9)


def test_parts_that_agree_leave_the_deviations() -> None:
    assert (birge_ratios(part(0.0, 1.0), [part(1.0, 1.0), part(1.2, 1.0)]) == 1.0).all()


@settings(max_examples=40)
@given(st.floats(2.0, 100.0), st.floats(0.01, 10.0))
def test_two_parts_so_many_deviations_apart(apart: float, std: float) -> None:
    ratios = birge_ratios(part(0.0, std), [part(0.0, std), part(apart * std, std)])
    assert ratios == pytest.approx(apart / np.sqrt(2.0))


def test_a_part_that_knows_little_widens_nothing() -> None:
    parts = [part(0.0, 0.1), part(0.1, 0.1), part(50.0, 100.0)]
    assert (birge_ratios(part(0.0, 0.1), parts) == 1.0).all()


def test_a_laser_that_only_one_part_has_is_left_alone() -> None:
    both = part(5.0, 0.1, ("laser", "rear"))
    ratios = birge_ratios(both, [both, part(0.0, 0.1)])
    assert ratios[2] > 1.0
    assert (ratios[6:] == 1.0).all()
