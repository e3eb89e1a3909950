"""Whether a cup that is gone is falsified, and none that is hidden (sections III-E and IV-B.4)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from objstate.experiments.elfring2012.camera import Camera
from objstate.experiments.elfring2012.exploration import GONE, RARELY, present
from objstate.experiments.elfring2012.looks import CameraLook
from objstate.experiments.elfring2012.scene import (
    CUP_HEIGHT,
    CUP_RADIUS,
    OTHER,
    RED,
    Scene,
)
from objstate.experiments.elfring2012.shuffling import Game
from objstate.experiments.elfring2012.trackers import KMeans
from objstate.geometry import FloatArray
from objstate.processes import in_order

PRESENCE = 0.95  # before the first check
CHECKS = 30
BOX = (0.16, 0.02, 0.22)  # m, of what stands before it
STD = 0.03  # m, to which its place is known


class Case(StrEnum):
    """What there is to be seen."""

    GONE = "gone, in sight"
    THERE = "there, in sight"
    GONE_HIDDEN = "gone, its place hidden"
    HIDDEN = "there, hidden"
    HALF = "there, half hidden"


@dataclass(frozen=True)
class Falsified:
    """How many trials of a case ended with the object out of the model."""

    case: Case
    trials: int
    falsified: int
    checks: float  # until then, the mean; nan of none


def falsify(trials: int, processes: int) -> Iterator[Falsified]:
    """Every case, many times."""
    jobs = [(case, seed) for case in Case for seed in range(trials)]
    found = np.array(list(in_order(_trial, jobs, processes))).reshape(len(Case), trials)
    for case, counts in zip(Case, found, strict=True):
        gone = counts[counts > 0]
        mean = float(gone.mean()) if len(gone) else float("nan")
        yield Falsified(case, trials, len(gone), mean)


def _trial(job: tuple[Case, int]) -> int:
    """After how many checks a red cup was falsified; 0: not at all."""
    case, seed = job
    rng = np.random.default_rng(seed)
    camera = Camera(Game().camera)
    place = np.array([rng.uniform(-0.3, 0.3), rng.uniform(1.0, 1.4)])
    scene = _scene(case, place)
    believed = place + STD * rng.standard_normal(2)
    tracker, presence = KMeans.at(believed[None], STD, RARELY), PRESENCE
    for check in range(1, CHECKS + 1):
        look = CameraLook(camera, camera.take(scene, rng), RED)
        tracker, done = tracker.checked(look, np.ones(1, bool))
        if not done.hidden[0]:
            presence = present(presence, not done.missing[0])
        if presence < GONE:
            return check
    return 0


def _scene(case: Case, place: FloatArray) -> Scene:
    x, y = place.tolist()
    there = case not in (Case.GONE, Case.GONE_HIDDEN)
    rounds = [[x, y, CUP_RADIUS, CUP_HEIGHT, float(RED)]] if there else []
    boxes = []
    if case in (Case.GONE_HIDDEN, Case.HIDDEN, Case.HALF):
        width, depth, height = BOX
        # a box on the way from the camera, 12 cm before the cup
        near = y - 0.12
        at = x * near / y + (width / 2.0 if case is Case.HALF else 0.0)
        boxes = [[at - width / 2.0, at + width / 2.0, near - depth, near, 0.0, height, OTHER]]
    return Scene(np.array(rounds).reshape(-1, 5), np.array(boxes, dtype=float).reshape(-1, 7))
