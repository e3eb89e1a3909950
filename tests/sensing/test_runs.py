"""Laws of runs of beams that one unexpected thing stops."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from objstate.building.model import Mesh
from objstate.config import BeamModelSettings
from objstate.geometry import FloatArray
from objstate.sensing import BeamModel, Comparison, ExpectedRanges, Sensing
from tests.rooms import block, building, door, enclosure, fan, observed, wall

RANGE_MAX = 8.0  # m
FREE, NEW, SAME = range(3)  # how a beam fares


def readings(seed: int, count: int = 6) -> tuple[FloatArray, FloatArray]:
    """Measured and expected ranges (n,) of a few beams, some of them stopped by one thing."""
    rng = np.random.default_rng(seed)
    expected = rng.uniform(2.0, 4.0, count)
    measured = expected + rng.normal(0.0, 0.05, count)
    measured[1:4] = 1.5 + rng.normal(0.0, 0.05, 3)
    measured[5] = np.inf
    return measured, expected


def summed(
    settings: BeamModelSettings, run: float, measured: FloatArray, expected: FloatArray
) -> float:
    """p(o | d-hat) as the sum over all ways in which the beams may fare."""
    shares = np.array([settings.z_hit, settings.z_short, settings.z_max, settings.z_rand])
    hit, short, missing, random = shares / shares.sum()
    unexpected, lasts = short / (hit + short), 1.0 - 1.0 / run
    total = 0.0
    for ways in product((FREE, NEW, SAME), repeat=len(measured)):
        probability = 1.0
        for j, (way, d, e) in enumerate(zip(ways, measured, expected, strict=True)):
            was_free = 1.0 - unexpected if j == 0 else float(ways[j - 1] == FREE)
            fresh = (1.0 - lasts) * (unexpected if way == NEW else 1.0 - unexpected)
            probability *= {
                FREE: lasts * was_free + fresh,
                NEW: fresh,
                SAME: lasts * (1.0 - was_free),
            }[way]
            if np.isinf(d):
                probability *= missing
                continue
            before = measured[j - 1] if j > 0 else np.inf
            density = {
                FREE: gaussian(d - e, settings.sigma_hit),
                NEW: settings.lambda_short * np.exp(-settings.lambda_short * d) * (d < e),
                SAME: gaussian(d - before, settings.short_std) * (d < e),
            }[way]
            probability *= (hit + short) * density + random / RANGE_MAX
        total += probability
    return float(np.log(total))


def gaussian(off: float, std: float) -> float:
    return float(np.exp(-0.5 * (off / std) ** 2) / (std * np.sqrt(2.0 * np.pi)))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("run", [1.0, 4.0, 20.0])
def test_the_recursion_is_the_sum_over_all_ways_in_which_beams_may_fare(
    seed: int, run: float
) -> None:
    settings = BeamModelSettings()
    measured, expected = readings(seed)
    told, _ = BeamModel(settings, run=run).along(measured, RANGE_MAX)(expected)
    assert told == pytest.approx(summed(settings, run, measured, expected))


@pytest.mark.parametrize("kind", ["mixture", "gaussian"])
def test_runs_of_one_beam_are_beams_by_themselves(kind: str) -> None:
    model = BeamModel(BeamModelSettings.model_validate({"model": kind}), run=1.0)
    measured, expected = readings(0)
    told, _ = model.along(measured, RANGE_MAX)(expected)
    assert told == pytest.approx(model(measured, RANGE_MAX)(expected).sum(), rel=1e-3)


def test_one_box_costs_less_than_as_many_readings_by_themselves_and_a_beam_through_it_no_less() -> (
    None
):
    runs, single = (BeamModel(BeamModelSettings(), run=run) for run in (10, 1))
    expected, box = np.full(20, 3.0), np.full(20, 1.5)
    assert costs(runs, box, expected) < 0.3 * costs(single, box, expected)
    through = np.full(20, 4.0)
    assert costs(runs, through, expected) == pytest.approx(
        costs(single, through, expected), rel=0.05
    )


def costs(model: BeamModel, measured: FloatArray, expected: FloatArray) -> float:
    """By how much less likely a reading is than one of what is expected."""
    told = (model.along(each, RANGE_MAX)(expected)[0] for each in (expected, measured))
    return float(np.subtract(*told))


def test_a_box_in_an_open_doorway_is_not_the_leaf() -> None:
    """It stands where the leaf would, were it closed, and fills two thirds of the doorway.

    Were beams stopped each by itself, so many that hit a closed leaf by chance would outweigh
    those that pass through it.
    """
    sides = wall((-4.5, 2.0), (-0.5, 2.0)), wall((0.4, 2.0), (4.5, 2.0))
    walls, leaf = Mesh.joined([enclosure(9.0, 7.0), *sides]), door("door", -0.5, 2.0)
    box, state = block(-0.2, 2.05, 0.6, 0.1), {"door": np.array([np.pi / 2])}
    robot, rays, rng = np.array([0.0, 0.0, np.pi / 2]), fan(361), np.random.default_rng(0)
    crowded = ExpectedRanges(building(Mesh.joined([walls, box]), leaf))
    scan = observed(crowded, state, robot, rays, rng, 0.03)
    for run, is_open in ((10.0, True), (1.0, False)):
        model = BeamModel(BeamModelSettings(), run=run)
        view = Sensing(building(walls, leaf), model).view(scan)
        told = Comparison(view.walls(robot[None]))
        change, _ = view.object_log_likelihood(
            "door", np.array([[0.0], [np.pi / 2]]), robot[None], told
        )
        assert (change[0, 1] > change[0, 0] + 10.0) == is_open
        assert (change[0, 0] > change[0, 1] + 10.0) != is_open
