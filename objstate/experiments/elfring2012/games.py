"""Many shuffles: how often objects that look alike are taken for one another."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from objstate.association import Motion
from objstate.experiments.elfring2012.camera import Camera
from objstate.experiments.elfring2012.exploration import EXPLORING, PLAYING
from objstate.experiments.elfring2012.laser import LaserLook, scan
from objstate.experiments.elfring2012.looks import CameraLook, Look
from objstate.experiments.elfring2012.scene import GREEN, Scene
from objstate.experiments.elfring2012.shuffling import (
    FRAMES_PER_SECOND,
    ON_THE_FLOOR,
    ON_THE_TABLE,
    Game,
    Hiding,
    Stage,
    play,
)
from objstate.experiments.elfring2012.trackers import JointTracker, KMeans, Tracker
from objstate.geometry import FloatArray
from objstate.processes import in_order

STD = 0.005  # m, to which cups are known before a shuffle
# probability of having kept all, below which the tracker is told who is who before it goes on
SURE = 0.99


@dataclass(frozen=True)
class Method:
    """One way to follow the cups."""

    name: str
    kind: type[KMeans] | type[JointTracker]
    allowed: float  # m^2
    always_moves: bool = False  # constant velocity alone, as in the paper

    def motion(self, game: Game) -> Motion:
        own = game.motion
        return replace(own, starts=1.0, stops=0.0) if self.always_moves else own


METHODS = (
    Method("k-means, constant velocity", KMeans, PLAYING, always_moves=True),
    Method("k-means", KMeans, PLAYING),
    Method("joint association", JointTracker, PLAYING),
    Method("k-means, as allowed before", KMeans, EXPLORING),
    Method("joint, as allowed before", JointTracker, EXPLORING),
)
SPEEDS = (0.25, 0.5, 1.0)  # m/s, of cups
FLOOR_SPEEDS = 2.0  # times as fast people push bins


@dataclass(frozen=True)
class Outcome:
    """What came of one shuffle."""

    right: bool  # all tracks are on their own cups
    kept: float  # probability of that, as the tracker sees it


@dataclass(frozen=True)
class Tally:
    """Shuffles of one kind, followed by one method."""

    method: str
    game: Game
    outcomes: tuple[Outcome, ...]
    checks_per_second: float  # of one cup
    rounds: tuple[int, ...]  # of k-means, how often how many: from 1 on

    @property
    def lost(self) -> int:
        return sum(not each.right for each in self.outcomes)

    @property
    def stated(self) -> float:
        """Shuffles in which an identity should have been lost, as the tracker sees it."""
        return sum(1.0 - each.kept for each in self.outcomes)


def stages_at(speeds: Sequence[float]) -> dict[Stage, tuple[float, ...]]:
    """Both stages, with the speeds in m/s of cups, and those of bins in proportion."""
    return {
        ON_THE_TABLE: tuple(speeds),
        ON_THE_FLOOR: tuple(FLOOR_SPEEDS * speed for speed in speeds),
    }


def shuffled(
    shuffles: int,
    processes: int,
    stages: Mapping[Stage, Sequence[float]],
    methods: Sequence[Method] = METHODS,
    hidings: Sequence[Hiding] = tuple(Hiding),
) -> Iterator[Tally]:
    """Every method on the same shuffles of every kind, by any number of processes."""
    jobs = [
        (Game(speed, hiding, shuffles, stage), tuple(methods))
        for stage, speeds in stages.items()
        for hiding in hidings
        for speed in speeds
    ]
    for tallies in in_order(_tallied, jobs, processes):
        yield from tallies


def _tallied(job: tuple[Game, tuple[Method, ...]]) -> list[Tally]:
    game, methods = job
    rng = np.random.default_rng(0)
    course, sensor = play(game, rng), _sensor(game)
    followers = [_Follower(method, game, course.cups[0]) for method in methods]
    for frame, cups in enumerate(course.cups):
        look = sensor(course.scene(frame), rng)
        for each in followers:
            each.see(look)
            if frame in course.ends:
                each.judge(cups)
    seconds = len(course.cups) / FRAMES_PER_SECOND
    return [each.tally(seconds) for each in followers]


def _sensor(game: Game) -> Callable[[Scene, np.random.Generator], Look]:
    if game.stage != ON_THE_TABLE:
        return lambda scene, rng: LaserLook(scan(scene, rng), game.radius)
    camera = Camera(game.camera)
    return lambda scene, rng: CameraLook(camera, camera.take(scene, rng), GREEN)


class _Follower:
    """A method at work, and what came of it so far."""

    def __init__(self, method: Method, game: Game, places: FloatArray) -> None:
        self.method, self.game = method, game
        self.tracker: Tracker = self._told(places)
        self.outcomes: list[Outcome] = []
        self.checks = 0
        self.rounds = np.zeros(64, int)

    def _told(self, places: FloatArray) -> Tracker:
        return self.method.kind.at(
            places, STD, self.method.motion(self.game), 2.0 * self.game.radius
        )

    def see(self, look: Look) -> None:
        """One frame."""
        self.tracker = self.tracker.predicted(1.0 / FRAMES_PER_SECOND)
        spread = self.tracker.tracks.position_covariance
        due = np.diagonal(spread, axis1=-2, axis2=-1).max(axis=-1) > self.method.allowed
        if due.any():
            self.tracker, done = self.tracker.checked(look, due)
            self.checks += int(done.checked.sum())
            np.add.at(self.rounds, list(done.rounds), 1)

    def judge(self, cups: FloatArray) -> None:
        """A shuffle has come to rest."""
        off = np.hypot(*np.moveaxis(self.tracker.tracks.positions - cups, -1, 0))
        right, kept = bool(off.max() < self.game.radius), self.tracker.kept
        self.outcomes.append(Outcome(right, kept))
        if not right or kept < SURE:
            self.tracker = self._told(cups)

    def tally(self, seconds: float) -> Tally:
        rate = self.checks / seconds / 3.0
        last = int(np.flatnonzero(self.rounds).max(initial=1))
        rounds = tuple(self.rounds[1 : last + 1].tolist())
        return Tally(self.method.name, self.game, tuple(self.outcomes), rate, rounds)
