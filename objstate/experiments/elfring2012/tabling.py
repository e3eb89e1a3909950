"""What the paper says beside what came out, and the tables of the trials."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from objstate.experiments.elfring2012.exploration import TASK_SWITCHES, Exploration
from objstate.experiments.elfring2012.falsifying import Falsified
from objstate.experiments.elfring2012.games import Tally
from objstate.experiments.tables import Table, figure

GREEN_CUP = "green cup 1"


def paper_table(found: Exploration) -> Table:
    """Section IV-C and Figs. 4 to 6."""
    book = found.intervals("book", np.inf)
    cup = found.intervals(GREEN_CUP, TASK_SWITCHES)
    gone = ", ".join(f"{name} at {at:.1f} s" for name, at in found.falsified.items())
    answers = Counter(each.answer for each in found.verifications if each.object != "red cup")
    worst = max(found.errors[name] for name in found.errors if name != "book")
    rows = (
        ("Fig. 4", "the book's position is verified every four or five seconds", _spans(book)),
        ("Fig. 4", "a green cup's at first alike", _spans(cup)),
        (
            "Fig. 4",
            "in the game verifications are sent about 28 times a second",
            f"{found.rate(GREEN_CUP, TASK_SWITCHES):.0f} of each cup",
        ),
        (
            "Fig. 4",
            "the allowed variance is 0.001 m^2; after a verification it is less",
            f"{1e6 * _after(found, 'book'):.0f} mm^2 after one",
        ),
        ("Fig. 4", "about t = 18 the red cup is falsified", gone or "not at all"),
        (
            "IV-B.4",
            "what is occluded isn't falsified",
            f"{answers['hidden']} times hidden, {answers['falsified']} falsified",
        ),
        (
            "Figs. 5, 6",
            "all three cups are kept track of, identities aren't mixed",
            f"within {1000 * worst:.1f} mm in the end",
        ),
    )
    return Table("The paper, and here", ("where", "paper", "here"), rows)


def games_table(tallies: Sequence[Tally]) -> Table:
    """Identities lost, by speed, occlusion and method."""
    rows = tuple(
        (
            each.game.stage.name,
            each.game.hiding.value,
            f"{each.game.speed:g}",
            each.method,
            f"{each.lost} of {len(each.outcomes)}",
            figure(each.stated, 1),
            figure(each.checks_per_second, 1),
            _rounds(each.rounds),
        )
        for each in tallies
    )
    note = (
        "Lost: after how many shuffles a track was not on its own cup. Stated: in how many it should "
        "have been, by the tracker's own probabilities; k-means has none. Checks are of one cup, a "
        "second. Rounds: the share of k-means in which no reading changed its cluster after one or two."
    )
    columns = ("what", "hiding", "m/s", "method", "lost", "stated", "checks", "rounds")
    return Table("Shuffles of three identical cups", columns, rows, note)


def falsified_table(found: Sequence[Falsified]) -> Table:
    """Section IV-B.4."""
    rows = tuple(
        (each.case.value, f"{each.falsified} of {each.trials}", figure(each.checks, 1))
        for each in found
    )
    columns = ("a red cup in the model is", "falsified", "checks until then")
    return Table("Falsification", columns, rows)


def _spans(seconds: Sequence[float] | np.ndarray) -> str:
    return f"every {np.min(seconds):.1f} to {np.max(seconds):.1f} s" if len(seconds) else "never"


def _after(found: Exploration, name: str) -> float:
    """m^2, the median variance just after a verification."""
    frames = [
        int(np.searchsorted(found.times, v.time)) for v in found.verifications if v.object == name
    ]
    return float(np.median(found.variances[name][frames]))


def _rounds(counts: Sequence[int]) -> str:
    """Of k-means; the last round only sees that nothing changes."""
    total = sum(counts)
    return f"{100 * sum(counts[:3]) / total:.0f} %" if total else "-"
