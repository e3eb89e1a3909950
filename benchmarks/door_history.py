"""How often a real door is moved: ``python benchmarks/door_history.py HISTORY``

HISTORY has lines ``unix_time state``, one a minute. The rarer state is taken to be
"open". Prints Markdown tables: shares of time, moves per hour out of each state, and
the rate of moves that a robot finds which looks after a wait, for several waits.

With moves at a rate mu, each to "open" with the probability o, an open door is open
again after t with the probability o + (1 - o) exp(-mu t); the rate solves that.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

MINUTE = 60  # s between lines
WAITS = (1, 2, 5, 10, 20, 30, 60, 120, 240)  # min
OFFICE_HOURS = range(8, 18)  # of the history's clock


def main(path: Path) -> None:
    """Print the tables."""
    times, states = np.loadtxt(path, dtype=np.int64).T
    is_open = states if states.mean() < 0.5 else 1 - states
    office = np.isin(times // 3600 % 24, OFFICE_HOURS)
    days = (times[-1] - times[0]) / 86400
    print(
        f"{len(times)} minutes over {days:.0f} days, open is written as {states[is_open == 1][0]}"
    )
    print("\n| | all day | 8 to 18 h |\n| --- | --- | --- |")
    spans = [np.ones(len(times), dtype=bool), office]
    line("share of time open", [f"{is_open[span].mean():.3f}" for span in spans])
    line("moves an hour", [f"{rate(times, is_open, span):.2f}" for span in spans])
    line("out of closed", [f"{rate(times, is_open, span & (is_open == 0)):.2f}" for span in spans])
    line("out of open", [f"{rate(times, is_open, span & (is_open == 1)):.2f}" for span in spans])
    print(
        "\n| looked again after (min) | moves an hour, all day | 8 to 18 h |\n| --- | --- | --- |"
    )
    for wait in WAITS:
        rates = [effective_rate(times, is_open, span, wait) for span in spans]
        line(str(wait), [f"{each:.2f}" for each in rates])


def rate(times: np.ndarray, is_open: np.ndarray, chosen: np.ndarray) -> float:
    """Changes an hour from one minute to the next, from chosen minutes on."""
    follows = np.diff(times) == MINUTE
    changed = (np.diff(is_open) != 0) & follows & chosen[:-1]
    return float(changed.sum() / ((follows & chosen[:-1]).sum() * MINUTE / 3600.0))


def effective_rate(times: np.ndarray, is_open: np.ndarray, chosen: np.ndarray, wait: int) -> float:
    """Moves an hour, to either state by its share of time, that explain two looks ``wait`` min apart."""
    pairs = (times[wait:] - times[:-wait] == wait * MINUTE) & chosen[:-wait] & chosen[wait:]
    now, then = is_open[wait:][pairs], is_open[:-wait][pairs]
    share = is_open[chosen].mean()
    still = now[then == 1].mean()
    return float(-np.log((still - share) / (1.0 - share)) / (wait * MINUTE / 3600.0))


def line(name: str, cells: list[str]) -> None:
    """One row of a table."""
    print(f"| {name} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
