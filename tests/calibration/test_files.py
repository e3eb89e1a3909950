"""Calibrations as files."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from objstate.calibration import (
    Calibration,
    LaserCorrection,
    read_calibration,
    write_calibration,
)
from objstate.errors import SettingsError
from objstate.geometry import rotation_from_rpy, transform

angles, metres = st.floats(-1.5, 1.5), st.floats(-2.0, 2.0)


def calibration(laser: LaserCorrection) -> Calibration:
    return Calibration((laser,), 0.01, 0.002, 0.0, 0.001, 100, 0.02, 0.01, 0.9)


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(angles, angles, angles, metres, metres, metres)
def test_what_is_written_is_read_back(
    tmp_path: Path, roll: float, pitch: float, yaw: float, x: float, y: float, z: float
) -> None:
    mount = transform(rotation_from_rpy(roll, pitch, yaw), [x, y, z])
    correction = np.array([0.01, -0.02, 0.03, 0.04])
    laser = LaserCorrection(
        "front", mount, 0.01, correction, np.full(4, 0.001), np.ones(4, dtype=bool)
    )
    write_calibration(tmp_path / "c.yaml", calibration(laser))
    mounts, clocks = read_calibration(tmp_path / "c.yaml")
    np.testing.assert_allclose(mounts["front"], laser.corrected_mount, atol=2e-6)
    assert clocks["front"] == pytest.approx(0.05)


def test_what_is_not_told_changes_nothing(tmp_path: Path) -> None:
    told = np.array([False, False, True, False])
    laser = LaserCorrection("front", np.eye(4), 0.0, np.full(4, 0.02), np.full(4, 0.1), told)
    write_calibration(tmp_path / "c.yaml", calibration(laser))
    text = (tmp_path / "c.yaml").read_text()
    mounts, clocks = read_calibration(tmp_path / "c.yaml")
    assert (mounts["front"][:3, 3] == 0.0).all()
    assert mounts["front"][1, 0] == pytest.approx(np.sin(0.02), abs=1e-6)
    assert clocks["front"] == 0.0
    assert "not_told:\n    - x\n    - y\n    - clock\n" in text


def test_a_key_that_is_unknown_is_an_error_with_the_near_one(tmp_path: Path) -> None:
    (tmp_path / "c.yaml").write_text("lasers: {front: {mont: {x: 0}}}")
    with pytest.raises(SettingsError, match=r"c\.yaml.*mount"):
        read_calibration(tmp_path / "c.yaml")
