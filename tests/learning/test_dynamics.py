"""From estimates to rests, rates, shares, and settings that can be used."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from objstate.building.model import Building
from objstate.config import ObjectRule, Settings, load_settings
from objstate.learning import learn_dynamics, learn_shares, rests_of, write_dynamics
from objstate.learning.rests import Rest
from objstate.recording.tables import estimate_schema
from tests.rooms import building, door, enclosure, table

HZ = 5.0
DOOR = door("a", 0.0, 0.0)
PLACE = building(enclosure(6.0, 4.0), DOOR, door("b[1]", 2.0, 0.0), table("t", 1.0, 1.0))


def looks(
    name: str,
    spans: Sequence[tuple[float, float, float]],
    coordinate: str = "angle",
    **more: object,
) -> pl.DataFrame:
    """Estimates of an object from one second to another at a value, for each span."""
    rows = [
        {"stamp": round(1e9 * time), "object": name, "coordinate": coordinate, "median": value}
        for begin, end, value in spans
        for time in np.arange(begin, end, 1.0 / HZ)
    ]
    frame = pl.DataFrame(rows).with_columns(
        mean=pl.col("median"),
        std=pl.lit(0.01),
        lower=pl.col("median") - 0.02,
        upper=pl.col("median") + 0.02,
        observed=True,
        fit=pl.lit(1.0),
        presence=pl.lit(1.0),
        lost=pl.lit(False),
        p_closed=pl.lit(None, pl.Float64()),
        p_localized=pl.lit(1.0),
    )
    return frame.with_columns(**more).select(estimate_schema().names())


def learnt(estimates: pl.DataFrame, place: Building = PLACE, settings: Settings | None = None):
    return learn_dynamics(estimates, place, settings or Settings())


def test_a_door_that_stands_has_one_rest() -> None:
    (rest,) = rests_of(looks("a", [(0.0, 20.0, 0.7)]), DOOR)
    assert rest.state.tolist() == [0.7]
    assert rest.seconds == pytest.approx(19.8)


def test_a_swing_is_one_move_and_not_many() -> None:
    swing = [(20.0 + 0.4 * k, 20.4 + 0.4 * k, 0.2 * k) for k in range(5)]
    rests = rests_of(looks("a", [(0.0, 20.0, 0.0), *swing, (22.0, 40.0, 1.0)]), DOOR)
    assert [rest.state[0] for rest in rests] == [0.0, 1.0]


def test_looks_apart_are_rests_apart() -> None:
    rests = rests_of(looks("a", [(0.0, 5.0, 0.5), (60.0, 65.0, 0.5)]), DOOR)
    assert len(rests) == 2


@pytest.mark.parametrize(
    "unfit",
    [
        {"std": pl.lit(0.5)},
        {"observed": pl.lit(False)},
        {"lost": pl.lit(True)},
        {"presence": pl.lit(0.1)},
    ],
)
def test_estimates_that_tell_nothing_are_no_rests(unfit: dict[str, pl.Expr]) -> None:
    assert rests_of(looks("a", [(0.0, 5.0, 0.5)], **unfit), DOOR) == []


def test_a_door_moved_between_looks_raises_its_rate_and_less_that_of_the_others() -> None:
    still = looks("a", [(0.0, 60.0, 0.5), (600.0, 660.0, 0.5)])
    moved = looks("a", [(0.0, 60.0, 0.5), (600.0, 660.0, 1.2)])
    rates = [{each.name: each.rate for each in learnt(each).objects} for each in (still, moved)]
    assert rates[1]["a"].moves == pytest.approx(1.0, abs=0.01)
    assert rates[0]["a"].moves < 0.1
    assert rates[1]["a"].mean > 2.0 * rates[0]["a"].mean
    assert rates[0]["b[1]"].mean < rates[1]["b[1]"].mean < rates[1]["a"].mean
    assert rates[0]["t"].mean == rates[1]["t"].mean  # furniture doesn't learn from doors


def test_furniture_moves_in_three_coordinates() -> None:
    spans = {"x": (1.0, 1.8), "y": (1.0, 1.0), "yaw": (3.1, -3.1)}
    estimates = pl.concat(
        [
            looks("t", [(0.0, 10.0, before), (300.0, 310.0, after)], name)
            for name, (before, after) in spans.items()
        ]
    )
    (rate,) = [each.rate for each in learnt(estimates).objects if each.name == "t"]
    assert rate.moves == pytest.approx(1.0, abs=0.01)


def test_what_was_estimated_while_lost_does_not_count() -> None:
    estimates = looks("a", [(0.0, 60.0, 0.5), (100.0, 160.0, 1.2), (200.0, 260.0, 0.5)])
    lost = [(90 * 10**9, 170 * 10**9)]
    rate = learn_dynamics(estimates, PLACE, Settings(), lost).objects[0].rate
    assert rate.moves < 0.1


def test_rests_at_the_limits_are_told_from_those_between() -> None:
    def rests(angle: float, count: int) -> list[tuple]:
        return [(DOOR, Rest(0, 1, np.array([angle]), np.array([0.01])))] * count

    shares = learn_shares(rests(0.01, 40) + rests(1.55, 20) + rests(0.8, 20))
    assert shares.closed == pytest.approx(0.5, abs=0.04)
    assert shares.open == pytest.approx(0.25, abs=0.04)
    assert shares.closed + shares.open + shares.anywhere == pytest.approx(1.0)
    assert shares.rests == 80


def test_without_rests_the_shares_are_those_assumed() -> None:
    shares = learn_shares([], prior=(2.0, 1.0, 1.0))
    assert (shares.closed, shares.open, shares.anywhere) == pytest.approx((0.5, 0.25, 0.25))


def test_what_is_written_serves_as_settings_and_keeps_the_others(tmp_path: Path) -> None:
    rule = ObjectRule(match="b*", prior_std_deg=1.0)
    settings = Settings(objects=(rule,))
    found = learnt(looks("a", [(0.0, 60.0, 0.5), (600.0, 660.0, 1.2)]), settings=settings)
    write_dynamics(tmp_path / "d.yaml", found, settings)
    read = load_settings(tmp_path / "d.yaml")
    for each in found.objects:
        kind = "furniture" if each.name == "t" else "door"
        used = read.for_object(each.name, kind)
        assert used.dynamics.moves_per_hour == pytest.approx(each.rate.mean, rel=1e-3)
        assert used.dynamics.drift_deg == each.assumed.drift_deg
    assert read.for_object("b[1]", "door").prior_std_deg == 1.0
