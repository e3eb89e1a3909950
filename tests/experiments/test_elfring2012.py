"""The experiment of Elfring et al. 2012."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from objstate.experiments.elfring2012 import (
    METHODS,
    Case,
    Exploration,
    Hiding,
    exploration,
    explore,
    falsify,
    reproduce,
    shuffled,
)
from objstate.experiments.elfring2012.camera import Camera, CameraSetup
from objstate.experiments.elfring2012.looks import CameraLook
from objstate.experiments.elfring2012.scene import CUP_HEIGHT, CUP_RADIUS, GREEN, OTHER, Scene
from objstate.experiments.elfring2012.shuffling import ON_THE_FLOOR, ON_THE_TABLE, Game, play


@pytest.fixture(scope="module")
def explored() -> Exploration:
    return explore(seed=0, shuffles=3)


def test_the_book_is_verified_every_four_or_five_seconds(explored: Exploration) -> None:
    spans = explored.intervals("book", np.inf)
    assert len(spans) > 5
    assert ((spans > 4.0) & (spans < 5.0)).all()


def test_the_task_says_how_often_cups_are_verified(explored: Exploration) -> None:
    assert (explored.intervals("green cup 1", 38.0) > 3.0).all()
    assert explored.rate("green cup 1", 38.0) == pytest.approx(30.0, abs=1.0)


def test_only_the_red_cup_is_falsified_when_it_becomes_uncertain(explored: Exploration) -> None:
    assert explored.falsified == {"red cup": pytest.approx(18.0, abs=0.2)}
    answers = {(each.object, each.answer) for each in explored.verifications}
    assert {name for name, answer in answers if answer == "falsified"} == {"red cup"}


def test_cups_are_where_they_are_believed(explored: Exploration) -> None:
    assert max(explored.errors.values()) < 0.01
    game = explored.times > 38.5
    off = np.hypot(*np.moveaxis(explored.tracked[game] - explored.cups[game], -1, 0))
    assert np.median(off) < 0.005
    assert explored.kept > 0.99


def test_a_camera_sees_cups_where_they_are() -> None:
    camera = Camera(CameraSetup())
    cup = np.array([[0.1, 1.2, CUP_RADIUS, CUP_HEIGHT, GREEN]])
    picture = camera.take(Scene(cup, np.empty((0, 7))), np.random.default_rng(0))
    look = CameraLook(camera, picture, GREEN)
    seen = look.seen(cup[:, :2], np.array([0.06]))
    distances = np.hypot(*(seen.points - cup[0, :2]).T)
    assert len(distances) > 200
    assert np.median(distances) == pytest.approx(CUP_RADIUS, abs=0.002)
    assert np.abs(look.coded(cup[:, :2])[0] - seen.codes.mean(axis=0)).max() < 4.0
    assert look.hidden(cup[:, :2]) == pytest.approx([0.0])


def test_what_stands_before_a_cup_hides_it() -> None:
    camera = Camera(CameraSetup())
    box = np.array([[-0.1, 0.1, 0.9, 0.92, 0.0, 0.3, OTHER]])
    picture = camera.take(Scene(np.empty((0, 5)), box), np.random.default_rng(0))
    hidden = CameraLook(camera, picture, GREEN).hidden(
        np.array([[0.0, 1.1], [0.4, 1.1], [0.0, 0.7]])
    )
    assert hidden.tolist() == [1.0, 0.0, 0.0]


@pytest.mark.parametrize("hiding", list(Hiding))
def test_cups_never_touch_and_come_to_rest_on_the_places(hiding: Hiding) -> None:
    course = play(Game(0.5, hiding, 20), np.random.default_rng(3))
    for a, b in ((0, 1), (0, 2), (1, 2)):
        apart = np.hypot(*(course.cups[:, a] - course.cups[:, b]).T)
        assert apart.min() >= 2.0 * CUP_RADIUS
    rested = np.sort(course.cups[list(course.ends)][..., 0], axis=1)
    assert rested == pytest.approx(np.tile([-0.2, 0.0, 0.2], (20, 1)))


def test_joint_association_keeps_identities_that_k_means_loses() -> None:
    chosen = [METHODS[k] for k in (1, 2, 4)]
    tallies = {
        each.method: each
        for each in shuffled(12, 1, {ON_THE_TABLE: (0.5,)}, chosen, (Hiding.CUPS,))
    }
    assert tallies["joint association"].lost == 0
    assert tallies["k-means"].lost > 0
    assert tallies["joint association"].checks_per_second == pytest.approx(30.0, abs=0.5)
    assert tallies["joint, as allowed before"].checks_per_second < 15.0


@pytest.mark.parametrize("hiding", [Hiding.CUPS, Hiding.HANDS])
def test_bins_on_the_floor_keep_their_names(hiding: Hiding) -> None:
    (tally,) = shuffled(6, 1, {ON_THE_FLOOR: (1.0,)}, METHODS[2:3], (hiding,))
    assert len(tally.outcomes) == 6
    assert tally.lost == 0


def test_what_happens_behind_a_screen_is_stated_to_be_unknown() -> None:
    (tally,) = shuffled(12, 1, {ON_THE_TABLE: (0.25,)}, METHODS[2:3], (Hiding.SCREEN,))
    assert 0.5 < tally.stated < 10.0
    assert all(each.right for each in tally.outcomes if each.kept > 0.99)


def test_what_is_gone_is_falsified_and_what_is_hidden_never() -> None:
    found = {each.case: each.falsified for each in falsify(8, 1)}
    assert found[Case.GONE] == 8
    assert not any(count for case, count in found.items() if case is not Case.GONE)


def test_same_seed_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exploration, "TASK_SWITCHES", 4.0)
    for name, processes in (("a", 1), ("b", 2)):
        reproduce(1, 1, out=tmp_path / name, stages={ON_THE_FLOOR: (2.0,)}, processes=processes)
    names = {path.name for path in (tmp_path / "a").iterdir()}
    assert {"tables.md", "verifications.csv", "fig4_variances.png", "fig5_paths.png"} <= names
    for name in ("tables.md", "verifications.csv"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
