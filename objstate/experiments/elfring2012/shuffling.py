"""Three identical cups, shuffled: where cups and hands are at each moment."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from math import pi

import numpy as np

from objstate.association import Motion
from objstate.experiments.elfring2012.camera import CameraSetup
from objstate.experiments.elfring2012.scene import (
    CUP_HEIGHT,
    CUP_RADIUS,
    GREEN,
    HAND_HEIGHT,
    HAND_RADIUS,
    OTHER,
    Scene,
)
from objstate.geometry import FloatArray

FRAMES_PER_SECOND = 30.0
PLACES = np.array([[-0.2, 1.1], [0.0, 1.1], [0.2, 1.1]])  # m
PAUSES = (0.1, 0.4)  # s, between shuffles
STARTS = 0.5  # 1/s, of a thing that is being shuffled, as a tracker is told
PAIRS = ((0, 1), (1, 2), (0, 2))


class Hiding(StrEnum):
    """What hides the cups while they are shuffled."""

    OPEN = "open"  # the camera looks down steeply, and cups pass far from each other
    CUPS = "cups"  # it looks along the table: the cup that passes before hides the other
    HANDS = "hands"  # besides, a hand hides one of both as they pass
    SCREEN = "screen"  # both go behind a screen, where every other time they turn back


@dataclass(frozen=True)
class Stage:
    """What is shuffled, and where."""

    name: str
    scale: float  # of the table's lengths
    hand: float  # m, radius of what moves them: a hand, or a person's legs
    motion: Motion


ON_THE_TABLE = Stage(
    "cups, camera",
    1.0,
    HAND_RADIUS,
    Motion(walk=2.2e-4, starts=1.0 / 36000.0, speed=0.6, acceleration=3.0),
)
ON_THE_FLOOR = Stage(
    "bins, laser",
    4.0,
    0.09,
    Motion(walk=2.2e-4, starts=1.0 / 36000.0, speed=1.2, acceleration=6.0),
)


@dataclass(frozen=True)
class Game:
    """How three things are shuffled."""

    speed: float = 0.5  # m/s, the mean along the way of a shuffle
    hiding: Hiding = Hiding.CUPS
    shuffles: int = 10
    stage: Stage = ON_THE_TABLE

    @property
    def motion(self) -> Motion:
        """Of things that somebody is at."""
        return replace(self.stage.motion, starts=STARTS)

    @property
    def radius(self) -> float:
        """m, of what is shuffled."""
        return CUP_RADIUS * self.stage.scale

    @property
    def camera(self) -> CameraSetup:
        if self.hiding is Hiding.OPEN:
            return CameraSetup(height=1.0, pitch=np.radians(45.0))
        return CameraSetup(height=0.5, pitch=np.radians(24.0))


@dataclass(frozen=True, eq=False)
class Course:
    """A game as it went."""

    cups: FloatArray = field(repr=False)  # (t, 3, 2) m
    hands: FloatArray = field(repr=False)  # (t, 2, 2) m; nan: none on the table
    screens: FloatArray = field(repr=False)  # (t, 2) m, from and to which x; nan: none
    ends: tuple[int, ...]  # frames in which a shuffle has come to rest
    stage: Stage

    def scene(self, frame: int) -> Scene:
        hands = self.hands[frame]
        hands = hands[np.isfinite(hands[:, 0])]
        scale = self.stage.scale
        cup = scale * CUP_RADIUS, scale * CUP_HEIGHT
        hand = self.stage.hand, scale * HAND_HEIGHT
        rounds = [[x, y, *cup, GREEN] for x, y in self.cups[frame].tolist()]
        rounds += [[x, y, *hand, OTHER] for x, y in hands.tolist()]
        left, right = self.screens[frame].tolist()
        box = [*(np.array([0.80, 0.81, 0.0, 0.25]) * scale), OTHER]
        boxes = [[left, right, *box]] if np.isfinite(left) else []
        return Scene(np.array(rounds), np.array(boxes).reshape(-1, 7))


def play(game: Game, rng: np.random.Generator) -> Course:
    """A game, frame by frame. The cup in place k at the start is number k."""
    at = np.arange(3)  # which cup is in which place
    cups, hands, screens, ends = [], [], [], []
    for _ in range(game.shuffles):
        still = round(rng.uniform(*PAUSES) * FRAMES_PER_SECOND)
        places = np.empty((3, 2))
        places[at] = PLACES
        cups += [places] * still
        hands += [np.full((2, 2), np.nan)] * still
        screens += [np.full(2, np.nan)] * still
        pair = PAIRS[rng.integers(3)]
        back = game.hiding is Hiding.SCREEN and rng.random() < 0.5
        ways, covers, screen = _shuffle(game, pair, back, rng)
        for way, cover in zip(ways, covers, strict=True):
            moved = places.copy()
            moved[at[list(pair)]] = way
            cups.append(moved)
            hands.append(cover)
            screens.append(screen)
        if not back:
            at[list(pair)] = at[list(pair)][::-1]
        rested = round(PAUSES[0] * FRAMES_PER_SECOND)
        places = np.empty((3, 2))
        places[at] = PLACES
        cups += [places] * rested
        hands += [np.full((2, 2), np.nan)] * rested
        screens += [np.full(2, np.nan)] * rested
        ends.append(len(cups) - 1)
    stage = game.stage
    all_cups, all_hands, all_screens = (
        stage.scale * np.array(each) for each in (cups, hands, screens)
    )
    return Course(all_cups, all_hands, all_screens, tuple(ends), stage)


def _shuffle(
    game: Game, pair: tuple[int, int], back: bool, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Ways (f, 2, 2) of two cups that exchange or turn back, hands (f, 2, 2), screen (2,)."""
    first, second = PLACES[list(pair)]
    middle, half = (first + second) / 2.0, float(second[0] - first[0]) / 2.0
    wide = 0.12 if game.hiding is Hiding.OPEN else rng.uniform(0.05, 0.09)
    if half > 0.15:  # about the cup between
        wide = max(wide, 0.10)
    turn = 1.0 if rng.random() < 0.5 else -1.0
    length = pi * np.sqrt((half**2 + wide**2) / 2.0)
    frames = max(round(length * game.stage.scale / game.speed * FRAMES_PER_SECOND), 2)
    share = np.arange(1, frames + 1) / frames
    phase = pi * (3.0 * share**2 - 2.0 * share**3)
    if back:
        phase = 0.45 * pi * (1.0 - np.cos(2.0 * pi * share)) / 2.0
    arc = np.stack([-half * np.cos(phase), turn * wide * np.sin(phase)], axis=-1)
    ways = np.stack([middle + arc, middle - arc], axis=1)
    hands = ways + np.array([0.0, HAND_RADIUS + CUP_RADIUS + 0.01])  # behind
    if game.hiding is Hiding.HANDS:
        covered = rng.integers(2)
        passing = (share > 0.35) & (share < 0.65)
        aside = rng.uniform(-0.03, 0.03)
        before = np.array([aside, -(HAND_RADIUS + CUP_RADIUS + 0.01)])
        hands[passing, covered] = ways[passing, covered] + before
    screen = np.full(2, np.nan)
    if game.hiding is Hiding.SCREEN:
        screen = middle[0] + np.array([-1.0, 1.0]) * 0.6 * half
    return ways, hands, screen
