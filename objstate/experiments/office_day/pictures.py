"""Pictures of the comparison: what driving buys, and where the robots drove."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Kind
from objstate.experiments.office_day.comparison import COORDINATOR, Worth
from objstate.experiments.office_day.office import DOOR_RATES, Office, office
from objstate.experiments.plans import (
    ESTIMATE,
    MODEL,
    PATH,
    STRANGER,
    TRUTH,
    WALL,
    draw_legend,
    draw_object,
    draw_plan,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {COORDINATOR: ESTIMATE, "fixed round": TRUTH, "greedy nearest": STRANGER,
           "oldest first": PATH, "random": WALL}  # fmt: skip
BUSY = DOOR_RATES[0]  # moves an hour


def draw_curves(found: Sequence[Worth]) -> Figure:
    """Total entropy and share of right doors over the way driven: each day, and means over days."""
    figure = new_figure(11.0, 3.8)
    entropy, right = figure.subplots(1, 2)
    for name, colour in COLOURS.items():
        mine = [each for each in found if each.trial.strategy == name]
        _curve(entropy, mine, [each.entropy for each in mine], colour)
        _curve(right, mine, [100.0 * each.right for each in mine], colour)
    entropy.set_ylabel("total entropy (nat)")
    right.set_ylabel("doors right within 10° (%)")
    for axes in (entropy, right):
        axes.set_xlabel("way (m/h)")
        axes.spines[["top", "right"]].set_visible(False)
    draw_legend(figure, *((colour, name) for name, colour in COLOURS.items()))
    return figure


def draw_paths(found: Sequence[Worth]) -> Figure:
    """The plan of one day's office with the paths of some trials on it."""
    figure = new_figure(11.0, 3.0 * len(found))
    for axes, worth in zip(figure.subplots(len(found), 1, squeeze=False)[:, 0], found, strict=True):
        trial, place = worth.trial, office(np.random.default_rng([worth.trial.seed, 0]))
        draw_plan(axes, place.building, worth.path)
        for name, item in place.building.objects.items():
            colour = ESTIMATE if place.rates[name] >= _often(place, name) else MODEL
            draw_object(axes, item, item.home, colour, 1.8)
        axes.set_title(
            f"{trial.strategy}, knob {trial.knob:g}: {trial.hours:g} hours of day {trial.seed}",
            fontsize=9,
        )
    often, seldom = "moved several times an hour (chests: once)", "moved less often"
    draw_legend(figure, (ESTIMATE, often), (MODEL, seldom), (PATH, "robot"))
    return figure


def _often(place: Office, name: str) -> float:
    """Moves an hour from which on an object of its kind is one of those that move most."""
    return 1.0 if place.building.objects[name].kind is Kind.PLANAR else BUSY


def _curve(axes: Axes, found: Sequence[Worth], values: Sequence[float], colour: str) -> None:
    knobs = sorted({each.trial.knob for each in found})
    of = np.array([each.trial.knob for each in found])
    distances, shown = np.array([each.distance for each in found]), np.array(values)
    axes.plot(distances, shown, ".", color=colour, alpha=0.5, ms=5)
    means = np.array([[distances[of == k].mean(), shown[of == k].mean()] for k in knobs])
    if len(means):
        axes.plot(*means.T, "o-", color=colour, ms=5, lw=1.5)
