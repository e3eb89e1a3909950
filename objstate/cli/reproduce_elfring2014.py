"""``objstate reproduce elfring2014``"""

from __future__ import annotations

import math
from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from objstate.cli.console import print_parts, print_table, print_text
from objstate.cli.tables import new_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.table import Table

    from objstate.experiments.elfring2014 import (
        Assumptions,
        Averages,
        Claim,
        Mean,
        Reproduction,
    )

FEW = (2.0, 4.0, 6.0, 9.0, 16.0)  # nats, the thresholds at which alternatives are compared
WEIGHTS = (0.05, 1.0, 2.0)  # alpha, likewise
STRETCH = (400.0, 500.0)  # s of Fig. 5's paths
BAR = 20  # characters of the longest bar
DEGREES = 180.0 / math.pi


class Counted(StrEnum):
    """Whose gains count."""

    own = "own object"
    all = "all objects"


class Counting(StrEnum):
    """What of a way counts as its gain."""

    updates = "every update"
    end = "at the end"


def elfring2014(
    runs: Annotated[int, typer.Option(metavar="N", min=2, help="Of each setting.")] = 250,
    alternative_runs: Annotated[
        int, typer.Option(metavar="N", min=0, help="Of each alternative; 0: none.")
    ] = 25,
    processes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Cores to use; the result is the same.")
    ] = 2,
    counted: Annotated[
        Counted, typer.Option(help="Whose gain an action counts: eq. (6) has its own object's.")
    ] = Counted.own,
    counting: Annotated[
        Counting, typer.Option(help="Of every update on the way, or what is left at its end.")
    ] = Counting.updates,
    coordinates: Annotated[
        int, typer.Option(metavar="N", min=2, max=3, help="Of an object's position.")
    ] = 3,
    step: Annotated[float, typer.Option(metavar="S", min=0.05, max=5.0, help="Time step.")] = 0.5,
    speed: Annotated[
        float, typer.Option(metavar="M/S", min=0.05, max=5.0, help="Of the robot.")
    ] = 1.45,
    view: Annotated[
        float, typer.Option(metavar="DEG", min=1.0, max=360.0, help="The sensor's field of view.")
    ] = 57.0,
) -> None:
    """Sections 7 and 8 of Elfring et al. 2014: when to update which object, with which sensor.

    Ten objects in a room of 10 m; a coordinator weighs the expected gain of an update against the
    way there, a benchmark drives a fixed path. Prints the paper's statements beside the results,
    then the cat of section 8.1 and the choice between sensors of section 8.2.
    """
    from objstate.experiments import elfring2014 as paper

    assumed = paper.Assumptions(
        counted=counted.value,
        counting=counting.value,
        coordinates=coordinates,
        step=step,
        speed=speed,
        field_of_view=view / DEGREES,
    )
    (found,) = paper.reproduce([assumed], runs, processes)
    print_table(_sweep("Sweep of IG_thr (Fig. 4)", "IG_thr", found.thresholds, found.benchmark))
    print_table(
        _sweep("Sweep of alpha, IG_thr 8 (Fig. 6)", "alpha", found.weights, found.benchmark)
    )
    print_table(_claims(paper.claims(found)))
    print_parts(_room(assumed))
    print_parts([_cat(), _cleaning()])
    if alternative_runs:
        sets = list(paper.ALTERNATIVES.values())
        others = paper.reproduce(sets, max(alternative_runs, 2), processes, FEW, WEIGHTS)
        print_table(_alternatives(dict(zip(paper.ALTERNATIVES, others, strict=True))))
    print_text(f"Means of {runs} runs with 95 % intervals; alternatives of {alternative_runs}.")


def _sweep(title: str, label: str, rows: Sequence[Averages], benchmark: Averages) -> Table:
    numbers = ("worst (nat)", "total (nat)", "distance (m)", "share", "actions", "updates")
    table = new_table(title, (label,), numbers)
    for row in rows:
        setup = row.setup
        value = setup.gain_threshold if label == "IG_thr" else setup.cost_weight
        table.add_row(f"{value:g}", *_cells(row, benchmark))
    table.add_row("fixed path", *_cells(benchmark, benchmark))
    return table


def _cells(row: Averages, benchmark: Averages) -> list[str]:
    share = row.distance.value / benchmark.distance.value
    return [
        _mean(row.worst_entropy, 2),
        _mean(row.total_entropy, 2),
        _mean(row.distance, 0),
        f"{share:.2f}",
        _mean(row.actions, 0),
        _mean(row.updates, 0),
    ]


def _mean(mean: Mean, decimals: int) -> str:
    return f"{mean.value:.{decimals}f} ± {mean.half:.{decimals}f}"


def _claims(rows: Sequence[Claim]) -> Table:
    table = new_table("The paper, and here", ("figure", "paper", "here", "holds"), ())
    for row in rows:
        table.add_row(row.where, row.paper, row.here, "yes" if row.holds else "no")
    return table


def _room(assumed: Assumptions) -> list[Table]:
    """One room, as in Figs. 5 and 7: how far the robot drives, and bars of updates and actions."""
    from objstate.experiments.elfring2014 import Setup, simulate

    plain = Setup(assumptions=assumed)
    fixed, coordinator = replace(plain, strategy="fixed path"), replace(plain, cost_weight=1.0)
    setups = {
        "fixed path": fixed,
        "IG_thr 5": replace(plain, gain_threshold=5.0),
        "IG_thr 15": replace(plain, gain_threshold=15.0),
        "IG_thr 8, alpha 0.05": replace(plain, cost_weight=0.05),
        "IG_thr 8, alpha 2": replace(plain, cost_weight=2.0),
    }
    start, end = (round(second / assumed.step) for second in STRETCH)
    driven = {name: simulate(each, 0).between(start, end) for name, each in setups.items()}
    title = f"Fig. 5, one room: way from {STRETCH[0]:.0f} s to {STRETCH[1]:.0f} s"
    ways = new_table(title, ("strategy", ""), ("m",))
    for name, metres in driven.items():
        ways.add_row(name, _bar(metres, max(driven.values())), f"{metres:.0f}")
    bars = [ways]
    courses = {"fixed path": simulate(fixed, 0), "coordinator": simulate(coordinator, 0)}
    for figure, of in (("7a", "updates"), ("7b", "approaches")):
        counts = {name: getattr(course, of).tolist() for name, course in courses.items()}
        most = max(max(each) for each in counts.values())
        title = f"Fig. {figure}, one room, alpha 1: {'actions' if of == 'approaches' else of}"
        table = new_table(title, ("strategy", "object", ""), ("count",))
        for name, each in counts.items():
            for k, count in enumerate(each, start=1):
                table.add_row(name, str(k), _bar(count, most), str(count))
            table.add_row(name, "all", "", str(sum(each)))
        bars.append(table)
    return bars


def _bar(value: float, most: float) -> str:
    return "#" * round(BAR * value / most) if most > 0.0 else ""


def _cat() -> Table:
    """Section 8.1, with thresholds about the one that the paper doesn't say."""
    from objstate.experiments.elfring2014 import CatSetup, follow

    title = (
        "Section 8.1, a cat that runs to and fro; the paper: between 10 and 15 updates a second, "
        "every third frame"
    )
    numbers = ("least a second", "most", "mean error (cm)", "entropy (nat)", "in region (%)")
    table = new_table(title, ("IG_thr",), numbers)
    rows = {f"{nats:g}": follow(CatSetup(nats), 0) for nats in (2.0, 2.5, 3.0, 3.5)}
    rows["every frame"] = follow(CatSetup(), 0, every_frame=True)
    for name, course in rows.items():
        rates = course.rates
        figures = (rates.min(), rates.max())
        table.add_row(
            name,
            *(f"{rate:.0f}" for rate in figures),
            f"{100 * course.errors.mean():.1f}",
            f"{course.entropies.mean():.1f}",
            f"{100 * course.inside.mean():.1f}",
        )
    return table


def _cleaning() -> Table:
    """Section 8.2."""
    from objstate.experiments.elfring2014 import verifications

    title = (
        "Section 8.2, before a can is grabbed; the paper: the laser at location 2, "
        "the camera at 4, no update for its gain alone"
    )
    numbers = ("height (m)", "gain of camera (nat)", "of laser", "entropy before", "after")
    table = new_table(title, ("location", "chosen", "worth by gain"), numbers)
    for each in verifications():
        laser = each.gains.get("torso laser")
        table.add_row(
            each.location,
            each.sensor,
            "yes" if each.worth_by_gain else "no",
            f"{each.height:.1f}",
            f"{each.gains['camera']:.2f}",
            "-" if laser is None else f"{laser:.2f}",
            f"{each.before:.2f}",
            f"{each.after:.2f}",
        )
    return table


def _alternatives(found: dict[str, Reproduction]) -> Table:
    from objstate.experiments.elfring2014 import claims

    numbers = (
        "hold", "worst at 2", "at 4", "at 6", "total at 2", "at 4", "at 6",
        "way at 9", "at 16", "actions", "updates",
    )  # fmt: skip
    title = (
        "Other assumptions: how many of the figures above hold; worst and total entropy less the\n"
        "fixed path's, paired by room; share of its distance; actions and updates at alpha 1 / its"
    )
    table = new_table(title, ("assumption",), numbers)
    for name, each in found.items():
        fixed, counts, judged = each.benchmark, each.at_weight(1.0), claims(each)
        shares = [each.at_threshold(n).distance.value / fixed.distance.value for n in (9.0, 16.0)]
        less = [
            *(one.worst_entropy.value for one in each.differences),
            *(one.total_entropy.value for one in each.differences),
        ]
        table.add_row(
            name,
            f"{sum(one.holds for one in judged)} of {len(judged)}",
            *(f"{nats:+.2f}" for nats in less),
            *(f"{share:.2f}" for share in shares),
            f"{counts.actions.value:.0f}/{fixed.actions.value:.0f}",
            f"{counts.updates.value:.0f}/{fixed.updates.value:.0f}",
        )
    return table
