"""Pictures like Figs. 3 to 6 of Elfring et al. 2012."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from objstate.experiments.elfring2012.exploration import (
    EXPLORING,
    PLAYING,
    TASK_SWITCHES,
    Exploration,
)
from objstate.experiments.elfring2012.tabling import GREEN_CUP
from objstate.experiments.plans import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PALETTE = np.array([[196, 170, 140], [46, 139, 87], [192, 57, 43], [41, 98, 168], [226, 190, 160]])
LINES = {"book": "black", "red cup": "#c0392b", GREEN_CUP: "#2e8b57"}
CUPS = ("#0b7a75", "#c8553d", "#6a4c93")


def draw_variances(found: Exploration) -> Figure:
    """Figs. 3 and 4: the first view with the beliefs, and variances in x over time."""
    figure = new_figure(9.0, 5.6)
    view, axes = figure.subplots(2, 1, gridspec_kw={"height_ratios": [1.1, 1.0]})
    view.imshow(PALETTE[found.picture.colours[:170]] / 255.0)
    view.axis("off")
    for name, (u, v) in found.overlay.items():
        view.plot(u, v, "o", color="#e4002b", ms=6)
        view.annotate(name, (u, v), (4, 6), textcoords="offset points", fontsize=8)
    for name, colour in LINES.items():
        axes.semilogy(found.times, found.variances[name], color=colour, lw=1.0, label=name)
    switched = [found.times[0], TASK_SWITCHES, found.times[-1]]
    axes.step(switched, [EXPLORING, PLAYING, PLAYING], "--", where="post", color="#888", lw=0.8)
    axes.set(xlabel="s", ylabel="variance in x (m²)")
    axes.legend(fontsize=8, ncols=3)
    return figure


def draw_paths(found: Exploration) -> Figure:
    """Figs. 5 and 6: the green cups' positions in the game."""
    game = found.times >= TASK_SWITCHES
    figure = new_figure(9.0, 4.4)
    for k, (axes, letter) in enumerate(zip(figure.subplots(2, 1, sharex=True), "xy", strict=True)):
        for cup, colour in enumerate(CUPS):
            axes.plot(found.times[game], found.cups[game, cup, k], color=colour, lw=3.0, alpha=0.3)
            axes.plot(found.times[game], found.tracked[game, cup, k], color=colour, lw=1.0)
        axes.set_ylabel(f"{letter} (m)")
    axes.set_xlabel("s (wide: true, thin: believed)")
    return figure
