"""``objstate reproduce elfring2014``"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from objstate.cli.console import print_table, print_text
from objstate.cli.tables import new_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.table import Table

    from objstate.experiments.elfring2014 import Averages, Claim, Mean, Reproduction

FEW = (6.0, 9.0, 16.0)  # nats, the thresholds at which alternatives are compared


def elfring2014(
    runs: Annotated[int, typer.Option(metavar="N", min=2, help="Of each setting.")] = 250,
    alternative_runs: Annotated[
        int, typer.Option(metavar="N", min=0, help="Of each alternative; 0: none.")
    ] = 25,
    processes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Cores to use; the result is the same.")
    ] = 2,
) -> None:
    """Section 7 of Elfring et al. 2014: when to update which object.

    Ten objects in a room of 10 m; a coordinator weighs what an update would tell against the way
    there, a benchmark drives a fixed path. Prints what the paper says beside what came out.
    """
    from objstate.experiments import elfring2014 as paper

    (found,) = paper.reproduce([paper.Assumptions()], runs, processes)
    print_table(_sweep("Sweep of IG_thr (Fig. 4)", "IG_thr", found.thresholds, found.benchmark))
    print_table(
        _sweep("Sweep of alpha, IG_thr 8 (Fig. 6)", "alpha", found.weights, found.benchmark)
    )
    print_table(_claims(paper.claims(found)))
    if alternative_runs:
        sets = list(paper.ALTERNATIVES.values())
        others = paper.reproduce(sets, max(alternative_runs, 2), processes, FEW, (1.0,))
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


def _alternatives(found: dict[str, Reproduction]) -> Table:
    numbers = ("D at 6", "at 9", "at 16", "worst", "total", "fixed", "fixed", "actions", "updates")
    title = (
        "Other assumptions: share of the fixed path's distance; worst and total entropy at IG_thr 6\n"
        "and of the fixed path; actions and updates at alpha 1 / of the fixed path"
    )
    table = new_table(title, ("assumption",), numbers)
    for name, each in found.items():
        fixed, low = each.benchmark, each.at_threshold(FEW[0])
        shares = [each.at_threshold(n).distance.value / fixed.distance.value for n in FEW]
        entropies = [low.worst_entropy, low.total_entropy, fixed.worst_entropy, fixed.total_entropy]
        counts = each.at_weight(1.0)
        table.add_row(
            name,
            *(f"{share:.2f}" for share in shares),
            *(f"{entropy.value:.1f}" for entropy in entropies),
            f"{counts.actions.value:.0f}/{fixed.actions.value:.0f}",
            f"{counts.updates.value:.0f}/{fixed.updates.value:.0f}",
        )
    return table
