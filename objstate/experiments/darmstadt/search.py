"""What the thesis' particles lose against the best of all views, on the maps of a robot that gazes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from objstate.experiments.darmstadt import gazing
from objstate.experiments.darmstadt.robot import FRAMES_A_SECOND, Robot
from objstate.experiments.darmstadt.setting import LAYOUT, STANDING, Scene
from objstate.gaze.field import FocusGazer
from objstate.geometry import compose
from objstate.processes import in_order

COUNTS = (5, 10, 50, 200)  # particles
APART = (0.0, gazing.APART)  # m
SECONDS = 20.0
POSE, BALL = np.zeros(3), np.array([1.0, 0.7])
SCENE = Scene(np.array([[0.9, -0.6]]))
EVERY = 20  # pictures
WINDOWS = "windows"


@dataclass(frozen=True)
class Search:
    """How good the chosen views were, as shares of the best by the same measure, eq. (6.36)."""

    method: str
    particles: int  # 0: all views
    apart: float  # m
    shares: tuple[float, ...]  # one for each seed


def compare(seeds: Sequence[int], processes: int) -> Iterator[Search]:
    """Particles, some many, beside windows."""
    found = np.array(list(in_order(_shares, list(seeds), processes)))
    kinds = [("particles", count, apart) for count in COUNTS for apart in APART]
    for k, (name, count, apart) in enumerate([*kinds, (WINDOWS, 0, 0.0)]):
        yield Search(name, count, apart, tuple(found[:, k].tolist()))


def _shares(seed: int) -> list[float]:
    rng = np.random.default_rng(seed)
    robot, gaze = Robot(SCENE, STANDING, rng), gazing.with_views(seed)
    robot.ball, robot.ball_validity = BALL, 1.0
    gazers = [FocusGazer(LAYOUT, gazing.CAMERA, n, apart) for n in COUNTS for apart in APART]
    shares = []
    for frame in range(1, round(SECONDS * FRAMES_A_SECOND) + 1):
        robot.step(POSE, gaze.target(robot, POSE), BALL)
        if frame % EVERY:
            continue
        bits, seeds = gaze.bits(robot), [robot.ball, compose(POSE, gazing.AHEAD)[:2]]
        pan, tilt = robot.head.pan, robot.head.tilt
        away = gazing.CAMERA.height / np.tan(tilt)
        focus = away * np.array([np.cos(pan), np.sin(pan)])
        chosen = [each.by_particles(bits, POSE, focus, rng, seeds)[0] for each in gazers]
        chosen.append(gazers[0].by_windows(bits, POSE, focus)[0])
        exact = gazers[0]
        allowed = np.flatnonzero(exact.weights(POSE, focus) > 0.0).astype(np.int32)
        most = exact.views(bits, POSE, allowed).max()
        worth = exact.views(bits, POSE, exact.cells(np.array([each.place for each in chosen])))
        shares.append(worth / most)
    return [float(each) for each in np.mean(shares, axis=0)]
