"""Section 4.3: four desks in two offices, 20 cm from where the model has them."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians
from pathlib import Path

import numpy as np

from objstate.config import Settings
from objstate.experiments.placements import ERROR_COLUMNS, Placement, error_cells, placements
from objstate.experiments.tables import Table, figure, mean, percent
from objstate.experiments.trial import Run, Trial
from objstate.simulation.scene import ObjectRule, PlanarState, load_scene

SCENE = Path(__file__).with_name("desks.scene.yaml")
DESKS = ("desk_1", "desk_2", "desk_3", "desk_4")
FURNITURE = (*DESKS, "table")
PAPER = {"desk_1": "right", "desk_2": "right", "desk_3": "wrong", "desk_4": "right", "table": "wrong"}  # fmt: skip
SHIFT_SIGMA, TURN_SIGMA = 0.02, radians(2.0)  # m, rad: how drives differ in where things stand
RIGHT, RIGHT_TURN = 0.05, radians(5.0)  # what counts as found
SETTING = "defaults"


def trial(seed: int) -> Trial:
    """The drive of a seed, in which all furniture stands a little elsewhere."""
    scene, rng = load_scene(SCENE, seed), np.random.default_rng(seed)
    rules = tuple(_nudged(rule, rng) for rule in scene.objects)
    return Trial(scene.model_copy(update={"objects": rules}), {SETTING: Settings()})


def tables(runs: Sequence[Run]) -> tuple[Table, ...]:
    """Errors by piece of furniture, and how many desks of each drive are right."""
    placed = [placements(run.finals) for run in runs]
    rows = [(name, PAPER[name], *_cells(name, placed)) for name in FURNITURE]
    found = [sum(_right(each) for each in own if each.object in DESKS) for own in placed]
    return (
        Table(
            "4.3 Desks that the model has 20 cm too near to the middle of the room",
            ("object", "paper", *ERROR_COLUMNS),
            tuple(rows),
            "Right: within 5 cm and 5 degrees. Desk 3 is hidden by the table, of which the lasers see "
            f"next to nothing, and by a chair that isn't in the model. {_found(found)}",
        ),
    )


def _found(counts: Sequence[int]) -> str:
    return (
        f"Desks right in a drive: {figure(mean(counts), 1)} of {len(DESKS)} on average, "
        f"at least 3 in {percent(count >= 3 for count in counts)} of {len(counts)} drives; "
        "3 in the paper's one."
    )


def _nudged(rule: ObjectRule, rng: np.random.Generator) -> ObjectRule:
    """A piece of furniture a little elsewhere; other rules as they are."""
    state = rule.initial
    if not isinstance(state, PlanarState):
        return rule
    dx, dy, turn = (rng.standard_normal(3) * [SHIFT_SIGMA, SHIFT_SIGMA, TURN_SIGMA]).tolist()
    moved = PlanarState(x=state.x + dx, y=state.y + dy, yaw=state.yaw + turn)
    return rule.model_copy(update={"initial": moved})


def _right(placement: Placement) -> bool:
    return placement.within(RIGHT, RIGHT_TURN)


def _cells(name: str, placed: Sequence[Sequence[Placement]]) -> tuple[str, ...]:
    own = [each for drive in placed for each in drive if each.object == name]
    return error_cells(own, RIGHT, RIGHT_TURN)
