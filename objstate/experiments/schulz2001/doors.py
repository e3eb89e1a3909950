"""Section 4.1: the doors of a corridor, passed at 70 cm/s and estimated from 3.5 m on."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from pathlib import Path
from typing import Literal

from objstate.config import ObjectSettings, ObjectUpdateSettings, Settings
from objstate.experiments.tables import Table, figure, mean, percent, rms
from objstate.experiments.trial import Average, Run, Trial
from objstate.simulation.scene import load_scene

SCENE = Path(__file__).with_name("doors.scene.yaml")
PAPER_STEP = 10.0  # deg between the states of a door
PAPER_DISTANCE = 3.5  # m, within which a door's state is estimated
PAPERS = f"{PAPER_STEP:g} deg, marginal"  # the paper's way
STEPS = (PAPER_STEP, 5.0, 2.0, 0.5)  # deg, with the default inference; the last is the default
RIGHT = 5.0  # deg


def trial(seed: int) -> Trial:
    """The drive of a seed: each door somewhere between closed and open."""
    ways = {PAPERS: _settings(PAPER_STEP, "marginal")}
    ways |= {_name(step): _settings(step, "joint") for step in STEPS}
    return Trial(load_scene(SCENE, seed), ways)


def tables(runs: Sequence[Run]) -> tuple[Table, ...]:
    """Errors by the step between states, and the doors of the first drive as in Fig. 5."""
    return _by_step(runs), _by_door(runs[0])


def _name(step: float) -> str:
    return f"{step:g} deg"


def _settings(step: float, inference: Literal["joint", "marginal"]) -> Settings:
    updates = ObjectUpdateSettings(inference=inference, max_distance=PAPER_DISTANCE)
    return Stepped(object_updates=updates, step_deg=step)


class Stepped(Settings):
    """Settings with another step between the states of doors."""

    step_deg: float

    def for_object(self, name: str, default_class: Literal["door", "furniture"]) -> ObjectSettings:
        """The settings of one object, with the step."""
        chosen = super().for_object(name, default_class)
        return chosen.model_copy(update={"resolution_deg": self.step_deg})


def _by_step(runs: Sequence[Run]) -> Table:
    ways = {PAPERS: PAPER_STEP} | {_name(step): step for step in STEPS}
    rows = [
        (name, *_cells(step, [run for run in runs if run.setting == name]))
        for name, step in ways.items()
    ]
    paper = ("paper: 10 deg", "", f"{PAPER_STEP / 2:.2f}", "0.50", *[""] * 7)
    return Table(
        "4.1 Doors at 70 cm/s",
        (
            "states every", "doors", "all estimates: mean error (deg)", "in steps",
            "final: mean error (deg)", "in steps", "within 5 deg", "in 90 % interval",
            "bound (deg)", "error / bound", "robot (cm)",
        ),
        (paper, *rows),
        "Marginal inference is the paper's, the others are joint, as by default. All estimates: every "
        "estimate of a door while it was in sight, averaged, as in the paper's Fig. 5. Final: the "
        "last one. Bound: Cramér-Rao, root mean square, as is the error in error / bound.",
    )  # fmt: skip


def _cells(step: float, runs: Sequence[Run]) -> tuple[str, ...]:
    finals = [final for run in runs for final in run.finals]
    averages = [average for run in runs for average in run.averages]
    errors = [degrees(abs(final.error)) for final in finals]
    bound = rms(degrees(final.bound) for final in finals)
    averaged, final = mean(degrees(abs(each.error)) for each in averages), mean(errors)
    return (
        str(len(finals)),
        figure(averaged),
        figure(averaged / step),
        figure(final),
        figure(final / step),
        percent(error <= RIGHT for error in errors),
        percent(final.inside for final in finals),
        figure(bound),
        figure(rms(errors) / bound, 1),
        figure(100 * mean(run.robot_error for run in runs), 1),
    )


def _by_door(run: Run) -> Table:
    return Table(
        f"4.1 Doors of the drive with seed {run.seed}, states every {run.setting}",
        ("door", "truth (deg)", "mean of estimates (deg)", "std (deg)", "final (deg)"),
        tuple(_door_row(run, average) for average in run.averages),
    )


def _door_row(run: Run, average: Average) -> tuple[str, ...]:
    final = [each.estimate for each in run.finals if each.object == average.object]
    return (
        average.object,
        figure(degrees(average.truth), 1),
        figure(degrees(average.truth + average.error), 1),
        figure(degrees(average.std), 1),
        figure(degrees(final[-1]), 1) if final else "-",
    )
