"""The independent offices are possible, and what is measured of them means what it says."""

from __future__ import annotations

import json
from itertools import combinations
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from benchmarks.independent import log
from benchmarks.independent.furniture import SCENARIOS, main, measured, row, simulated
from benchmarks.independent.office import Office, modelled, office, office_drive, urdf
from benchmarks.independent.shapes import overlap, placed
from objstate import load_building

SEEDS = range(3)


def made(seed: int, scenario: str = "all") -> tuple[Office, float]:
    duration = office_drive(seed).duration
    return office(seed, SCENARIOS[scenario].options, duration), duration


@pytest.mark.parametrize("seed", SEEDS)
def test_no_two_things_stand_in_one_place_nor_in_walls(seed: int) -> None:
    there, duration = made(seed, "moved")
    for time in np.linspace(0.0, duration, 9):
        stand = [placed(each.footprint, *pose) for each in there.things if (pose := each.at(time))]
        assert not any(overlap(a, b) for a, b in combinations(stand, 2))
        assert not any(overlap(a, wall.outline) for a in stand for wall in there.walls)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_robot_drives_past_all_things(seed: int) -> None:
    there, duration = made(seed)
    drive = office_drive(seed)
    for time in np.linspace(0.0, duration, 60):
        _, _, owners = there.segments(float(time))
        segments = there.segments(float(time))[0][owners >= 0]
        (place,) = drive.at(np.array([time]))[:, :2]
        assert np.hypot(*(segments[:, :2] - place).T).min() > 0.3


@pytest.mark.parametrize("seed", SEEDS)
def test_the_model_shows_things_at_home_as_large_as_they_are(seed: int, tmp_path: Path) -> None:
    there, _ = made(seed, "nothing")
    path = tmp_path / "office.urdf"
    path.write_text(urdf(there.walls, modelled(seed, there.things, 0.0)), encoding="utf-8")
    objects = load_building(path).objects
    for thing in there.things:
        item = objects[thing.name]
        off = item.home - thing.home
        off[2] = np.remainder(off[2] + np.pi, 2.0 * np.pi) - np.pi
        np.testing.assert_allclose(off, 0.0, atol=1e-5)
        assert item.symmetry.order == thing.order
        size = np.ptp(item.upright_mesh.vertices[:, :2], axis=0)
        np.testing.assert_allclose(size, np.ptp(thing.footprint, axis=0), atol=2e-3)


def rows(name: str, second: float, state: list[float], presence: float) -> list[dict[str, object]]:
    return [
        {
            "stamp": log.stamp(second),
            "object": name,
            "coordinate": coordinate,
            "median": value,
            "lower": value - 0.02,
            "upper": value + 0.02,
            "presence": presence,
            "observed": True,
        }
        for coordinate, value in zip(("x", "y", "yaw"), state, strict=True)
    ]


def test_wrong_places_headings_and_presences_are_counted_by_their_time(tmp_path: Path) -> None:
    thing = {"name": "desk", "order": 2, "stays": [[0.0, [1.0, 2.0, 0.5]], [20.0, None]]}
    facts = {"end": 40.0, "things": [thing]}
    (tmp_path / "facts.json").write_text(json.dumps(facts), encoding="utf-8")
    seconds = np.arange(0.0, 40.0, 0.5)
    seen = {
        "stamps": np.array([log.stamp(each) for each in seconds]),
        "beams": np.where(seconds < 20.0, 9, 0)[:, None],
    }
    np.savez(tmp_path / "seen.npz", **seen)
    told = [
        *rows("desk", 5.0, [1.0, 2.0, 0.5], 1.0),
        *rows("desk", 6.0, [1.5, 2.0, 0.5], 1.0),  # wrong for a second
        *rows("desk", 7.0, [1.0, 2.0, 0.5], 0.05),  # denied for one
        *rows("desk", 8.0, [1.01, 2.0, 0.5 + np.pi], 1.0),  # right: it looks the same
        *rows("desk", 25.0, [1.0, 2.0, 0.5], 0.95),  # wrong for half a second
        *rows("desk", 25.5, [1.0, 2.0, 0.5], 0.1),
    ]
    pl.DataFrame(told).write_parquet(tmp_path / "estimates.parquet")
    out = measured("test", 1, tmp_path, tmp_path / "estimates.parquet")
    (final,) = out.finals
    assert final.off == pytest.approx(0.01)
    assert final.turned == pytest.approx(0.0, abs=1e-9)
    assert final.inside == (True, True, True)
    assert out.gone == [pytest.approx(0.1)]
    assert out.times.wrong_place == pytest.approx(1.5)
    assert out.times.denied == pytest.approx(1.0)
    assert row("test", [out]).count("|") == 9


def test_a_drive_is_simulated_once_and_alike(tmp_path: Path) -> None:
    one, other = (simulated("gone", 1, tmp_path / each) for each in ("a", "b"))
    for name in ("log.mcap", "building.urdf", "facts.json"):
        assert (one / name).read_bytes() == (other / name).read_bytes()
    assert simulated("gone", 1, tmp_path / "a") == one


def test_an_unknown_scenario_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--scenarios", "nothing,unheard-of"])
    assert "unheard-of" in capsys.readouterr().err
