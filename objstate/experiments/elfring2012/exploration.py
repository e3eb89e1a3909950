"""Section IV of Elfring et al. 2012: exploration with an outdated model, then a shuffle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import hypot

import numpy as np

from objstate.association import Motion
from objstate.experiments.elfring2012.camera import Camera, Picture
from objstate.experiments.elfring2012.looks import CameraLook
from objstate.experiments.elfring2012.scene import (
    BLUE,
    BOOK,
    CUP_HEIGHT,
    CUP_RADIUS,
    GREEN,
    RED,
)
from objstate.experiments.elfring2012.shuffling import (
    FRAMES_PER_SECOND,
    ON_THE_TABLE,
    PLACES,
    Game,
    Hiding,
    play,
)
from objstate.experiments.elfring2012.trackers import CERTAIN, JointTracker, KMeans, Tracker
from objstate.geometry import FloatArray

EXPLORING, PLAYING = (
    1e-3,
    1e-6,
)  # m^2, allowed of a position: the paper's, and one that each frame exceeds
TASK_SWITCHES = 38.0  # s, as in Fig. 4
STANDS = Motion(walk=2.2e-4)  # the book's variance reaches what is allowed in 4.5 s, as in Fig. 4
RARELY = Motion(walk=5e-5)  # the red cup's in 18 s
BEFORE = 1e-4  # m^2, the variance that was left by the trial before
SEEN_WRONGLY = 0.01  # probability of enough readings of a colour where nothing of it is
GONE = 0.05  # probability of being there, below which an object leaves the model
BOOK_AT = np.array([-0.42, 1.20])  # m, of its middle
RED_AT = np.array([0.42, 1.20])
OFF = 0.01  # m, sigma of what the model is off by


@dataclass(frozen=True)
class Verification:
    """One check of one object."""

    time: float  # s
    object: str
    answer: str  # verified, hidden or falsified
    seconds: float  # of processor time that it took


@dataclass(frozen=True, eq=False)
class Exploration:
    """What came of it."""

    times: FloatArray = field(repr=False)  # (t,) s
    variances: Mapping[str, FloatArray] = field(repr=False)  # (t,) m^2 in x; nan: not in the model
    tracked: FloatArray = field(repr=False)  # (t, 3, 2) m, the green cups as believed
    cups: FloatArray = field(repr=False)  # (t, 3, 2) m, as they are
    overlay: Mapping[str, FloatArray]  # (2,) where in the first picture objects are believed
    errors: Mapping[str, float]  # m, at the end
    verifications: tuple[Verification, ...] = field(repr=False)
    picture: Picture = field(repr=False)  # the first
    kept: float  # probability that no cup was taken for another, as believed in the end

    @property
    def seconds_per_check(self) -> float:
        """Of processor time, of one object: the median."""
        return float(np.median([each.seconds for each in self.verifications]))

    @property
    def falsified(self) -> dict[str, float]:
        """s, when an object left the model."""
        return {
            name: float(self.times[np.flatnonzero(np.isnan(values))[0]])
            for name, values in self.variances.items()
            if np.isnan(values).any()
        }

    def intervals(self, name: str, until: float) -> FloatArray:
        """(n,) s between an object's verifications before a moment."""
        return np.diff([v.time for v in self.verifications if v.object == name and v.time < until])

    def rate(self, name: str, start: float) -> float:
        """1/s, verifications of an object from a moment on."""
        count = sum(v.object == name and v.time >= start for v in self.verifications)
        return count / (float(self.times[-1]) - start)


@dataclass(frozen=True, eq=False)
class _Known:
    """An object or several alike in the model."""

    names: tuple[str, ...]
    tracker: Tracker
    colour: int
    presence: float = 0.95

    def look(self, camera: Camera, picture: Picture) -> CameraLook:
        if self.colour == BLUE:
            radius = hypot(BOOK[0], BOOK[1]) / 2.0
            return CameraLook(camera, picture, BLUE, radius, BOOK[2], round=False)
        return CameraLook(camera, picture, self.colour)


def explore(
    seed: int, hiding: Hiding = Hiding.CUPS, speed: float = 0.5, shuffles: int = 20
) -> Exploration:
    """The scenario of section IV-A: exploration for 38 s, then the game."""
    rng = np.random.default_rng(seed)
    game = Game(speed, hiding, shuffles)
    course, camera = play(game, rng), Camera(game.camera)
    quiet = round(TASK_SWITCHES * FRAMES_PER_SECOND)
    count = quiet + len(course.cups)
    known = _model(rng)
    overlay = _overlay(known, camera)
    variances = {name: np.full(count, np.nan) for name in overlay}
    found: list[Verification] = []
    tracked, first = np.full((count, 3, 2), np.nan), None
    for frame in range(count):
        time = frame / FRAMES_PER_SECOND
        scene = course.scene(max(frame - quiet, 0))
        picture = camera.take(replace(scene, boxes=np.vstack([scene.boxes, _book()])), rng)
        first = first or picture
        if frame == quiet:
            known = [_in_the_game(each, game) for each in known]
        known = [_checked(each, camera, picture, time, found) for each in known]
        known = [each for each in known if each.presence > GONE]
        for each in known:
            spread = each.tracker.tracks.position_covariance
            for k, name in enumerate(each.names):
                variances[name][frame] = spread[k, 0, 0]
        tracked[frame] = known[-1].tracker.tracks.positions
    assert first is not None
    truth = {"book": BOOK_AT} | {f"green cup {k + 1}": course.cups[-1, k] for k in range(3)}
    errors = {
        name: hypot(*(each.tracker.tracks.positions[k] - truth[name]))
        for each in known
        for k, name in enumerate(each.names)
        if name in truth
    }
    return Exploration(
        np.arange(count) / FRAMES_PER_SECOND,
        variances,
        tracked,
        np.concatenate([np.repeat(course.cups[:1], quiet, axis=0), course.cups]),
        overlay,
        errors,
        tuple(found),
        first,
        known[-1].tracker.kept,
    )


def _model(rng: np.random.Generator) -> list[_Known]:
    """What the trial before left: positions that are off, and a red cup that is gone."""
    std = float(np.sqrt(BEFORE))

    def off(place: FloatArray) -> FloatArray:
        return place + OFF * rng.standard_normal(place.shape)

    cups = JointTracker.at(off(PLACES), std, ON_THE_TABLE.motion, 2.0 * CUP_RADIUS)
    return [
        _Known(("book",), KMeans.at(off(BOOK_AT[None]), std, STANDS), BLUE),
        _Known(("red cup",), KMeans.at(off(RED_AT[None]), std, RARELY), RED),
        _Known(tuple(f"green cup {k + 1}" for k in range(3)), cups, GREEN),
    ]


def _in_the_game(known: _Known, game: Game) -> _Known:
    """Green cups are shuffled from now on: the task says that, too."""
    if not isinstance(known.tracker, JointTracker):
        return known
    return replace(known, tracker=JointTracker(known.tracker.joint.moving(game.motion)))


def _overlay(known: list[_Known], camera: Camera) -> dict[str, FloatArray]:
    found: dict[str, FloatArray] = {}
    for each in known:
        places = each.tracker.tracks.positions
        height = BOOK[2] if each.colour == BLUE else CUP_HEIGHT / 2.0
        pixels, _ = camera.pixels(np.column_stack([places, np.full(len(places), height)]))
        found |= dict(zip(each.names, pixels, strict=True))
    return found


def _book() -> FloatArray:
    """(1, 7)."""
    (x, y), (width, depth, height) = BOOK_AT, BOOK
    bounds = [x - width / 2, x + width / 2, y - depth / 2, y + depth / 2, 0.0, height]
    return np.array([[*bounds, float(BLUE)]])


def _checked(
    known: _Known, camera: Camera, picture: Picture, time: float, found: list[Verification]
) -> _Known:
    """Predict to the next frame, and verify where the task requires it. Checks are recorded."""
    tracker = known.tracker.predicted(1.0 / FRAMES_PER_SECOND)
    allowed = PLAYING if known.colour == GREEN and time >= TASK_SWITCHES else EXPLORING
    spread = tracker.tracks.position_covariance
    due = np.diagonal(spread, axis1=-2, axis2=-1).max(axis=-1) > allowed
    if not due.any():
        return replace(known, tracker=tracker)
    tracker, checks = tracker.checked(known.look(camera, picture), due)
    presence, spent = known.presence, checks.seconds / int(checks.checked.sum())
    for k in np.flatnonzero(checks.checked).tolist():
        answer = "verified"
        if checks.missing[k]:
            answer = "hidden" if checks.hidden[k] else "falsified"
        found.append(Verification(time, known.names[k], answer, spent))
        if len(known.names) == 1 and answer != "hidden":
            presence = present(presence, answer == "verified")
    return replace(known, tracker=tracker, presence=presence)


def present(before: float, seen: bool) -> float:
    """By Bayes' rule."""
    there, gone = (CERTAIN, SEEN_WRONGLY) if seen else (1.0 - CERTAIN, 1.0 - SEEN_WRONGLY)
    return before * there / (before * there + (1.0 - before) * gone)
