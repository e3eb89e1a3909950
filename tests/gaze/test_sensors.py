"""What is in view of a sensor."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.errors import SettingsError
from objstate.gaze.sensors import ALL_ROUND, Sensor

coordinate = st.floats(-3.0, 3.0)


@given(coordinate, coordinate, st.floats(-np.pi, np.pi))
def test_what_is_seen_does_not_depend_on_where_everything_is(
    x: float, y: float, yaw: float
) -> None:
    sensor = Sensor("eye", range_min=0.5, range_max=2.0, field_of_view=1.0)
    here = np.array([[1.0, 0.2], [1.0, 1.0], [0.3, 0.0], [3.0, 0.0], [-1.0, 0.0]])
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    there = here @ turn.T + np.array([x, y])
    seen = sensor.sees(np.array([x, y, yaw]), there)
    assert seen.tolist() == [True, False, False, False, False]


def test_a_sensor_that_sees_all_round_casts_no_beam_twice() -> None:
    rays = Sensor("round", field_of_view=ALL_ROUND, beams=8).rays()
    assert len(np.unique(rays.directions.round(9), axis=0)) == 8
    assert Sensor("round", field_of_view=ALL_ROUND).sees(np.zeros(3), np.array([[-1.0, 0.0]])).all()


def test_the_outer_beams_stand_at_the_edges_of_the_field_of_view() -> None:
    rays = Sensor("front", field_of_view=np.pi, beams=3, height=0.4).rays()
    bearings = np.arctan2(rays.directions[:, 1], rays.directions[:, 0])
    assert np.allclose(bearings, [-np.pi / 2, 0.0, np.pi / 2])
    assert (rays.origins[:, 2] == 0.4).all()


def test_beams_leave_from_where_the_sensor_is_mounted() -> None:
    rays = Sensor("rear", field_of_view=1.0, beams=3, x=-0.3, y=0.1, yaw=np.pi).rays()
    assert rays.directions[1] == pytest.approx([-1.0, 0.0, 0.0])
    assert rays.origins == pytest.approx(np.tile([-0.3, 0.1, 0.3], (3, 1)))


@given(coordinate, coordinate, st.floats(-np.pi, np.pi))
def test_a_mounted_sensor_sees_what_one_at_its_place_sees(x: float, y: float, yaw: float) -> None:
    mounted = Sensor("rear", field_of_view=1.5, x=-0.3, y=0.1, yaw=2.0)
    places, robot = np.random.default_rng(0).uniform(-6.0, 6.0, (50, 2)), np.array([x, y, yaw])
    plain = Sensor("plain", field_of_view=1.5)
    assert (mounted.sees(robot, places) == plain.sees(mounted.poses(robot), places)).all()


@pytest.mark.parametrize(
    "figures",
    [{"beams": 10**9}, {"beams": 0}, {"range_max": np.nan}, {"range_max": -1.0}, {"yaw": np.inf},
     {"range_min": 9.0}, {"field_of_view": 0.0}],
)  # fmt: skip
def test_a_sensor_that_cannot_be_is_refused(figures: dict[str, float]) -> None:
    with pytest.raises(SettingsError, match="Sensor 'front'"):
        Sensor("front", **figures)
