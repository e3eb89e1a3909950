"""Coordinates that were estimated together make a placement."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.experiments.placements import ERROR_COLUMNS, error_cells, placements
from objstate.experiments.trial import Final
from tests.experiments.conftest import placed


def test_coordinates_of_one_moment_belong_together() -> None:
    finals = [*placed("desk", 5, (1.0, 2.0, 0.3), (0.03, 0.04, -0.2)), *placed("desk", 9)]
    door = Final("door", "angle", 5, 0.4, 0.1, True, 0.1)
    first, second = placements([*reversed(finals), door])
    assert (first.object, first.stamp_ns, second.stamp_ns) == ("desk", 5, 9)
    np.testing.assert_allclose(first.estimate, [1.03, 2.04, 0.1])
    assert (first.off, first.turned) == pytest.approx((0.05, 0.2))
    assert first.least_off == pytest.approx(0.01 * np.sqrt(2))
    assert first.within(0.051, 0.21)
    assert not first.within(0.049, 0.21)
    assert not first.within(0.051, 0.19)


def test_cells_are_means_over_placements() -> None:
    finals = [*placed("desk", 5, errors=(0.03, 0.04, 0.0)), *placed("desk", 9)]
    cells = dict(zip(ERROR_COLUMNS, error_cells(placements(finals), 0.02, 0.1), strict=False))
    assert len(error_cells([], 0.02, 0.1)) == len(ERROR_COLUMNS)
    assert (cells["n"], cells["mean error (cm)"], cells["right"]) == ("2", "2.50", "50 %")
    assert cells["in 90 % interval"] == "67 %"  # x and y of the first are outside
    assert cells["error / bound (cm)"] == "2.5"  # 5 / sqrt(2) beside sqrt(2)
