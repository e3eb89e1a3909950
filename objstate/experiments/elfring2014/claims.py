"""What section 7 of Elfring et al. 2014 says, beside what came out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from objstate.experiments.elfring2014.sweeps import Averages, Difference, Mean, Reproduction

NEAR = 0.25  # relative, within which a figure counts as the paper's


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper, and the same of the simulation."""

    where: str
    paper: str
    here: str
    holds: bool


def claims(found: Reproduction) -> list[Claim]:
    """All that section 7 says in figures."""
    bench, at_8 = found.benchmark, found.at_weight(1.0)
    below_worst = _below(found.thresholds, bench, "worst_entropy")
    below_total = _below(found.thresholds, bench, "total_entropy")
    total_by_weight = _below(found.weights, bench, "total_entropy")
    constant = found.at_threshold(4.0).distance.value / bench.distance.value
    half, tenth = (found.at_threshold(n).distance.value / bench.distance.value for n in (9.0, 16.0))
    thresholds = [each.setup.gain_threshold for each in found.thresholds]
    weights = [each.setup.cost_weight for each in found.weights]
    return [
        *(
            _lower("Fig. 4a", "worst", each, each.worst_entropy, each.better_worst)
            for each in found.differences
        ),
        *(
            _lower("Fig. 4b", "total", each, each.total_entropy, each.better_total)
            for each in found.differences
        ),
        Claim(
            "Fig. 4a",
            "worst entropy below the benchmark's for all IG_thr",
            _listed(thresholds, below_worst),
            all(below_worst),
        ),
        Claim(
            "Fig. 4b",
            "total entropy below the benchmark's up to IG_thr about 10",
            _listed(thresholds, below_total),
            _up_to(thresholds, below_total, 10.0),
        ),
        Claim(
            "Fig. 4c",
            "distance constant up to IG_thr 4",
            f"{constant:.2f} at 4",
            abs(constant - 1.0) < 0.1,
        ),
        Claim("Fig. 4c", "distance at IG_thr 9: half", f"{half:.2f}", _near(half, 0.5)),
        Claim("Fig. 4c", "distance at IG_thr 16: a tenth", f"{tenth:.2f}", abs(tenth - 0.1) < 0.05),
        Claim(
            "Fig. 6a",
            "worst entropy below the benchmark's for all alpha",
            _listed(weights, worst := _below(found.weights, bench, "worst_entropy")),
            all(worst),
        ),
        Claim(
            "Fig. 6b",
            "total entropy below the benchmark's for alpha below 1.7",
            _listed(weights, total_by_weight),
            _up_to(weights, total_by_weight, 1.7),
        ),
        Claim(
            "Fig. 6c",
            "distance below the benchmark's for all alpha",
            _listed(weights, less := _below(found.weights, bench, "distance")),
            all(less),
        ),
        _count("Fig. 7b", "actions of the benchmark", 263, bench.actions.value),
        _count("Fig. 7b", "actions of the coordinator, alpha 1", 104, at_8.actions.value),
        _count("Fig. 7a", "updates of the benchmark", 973, bench.updates.value),
        _count("Fig. 7a", "updates of the coordinator, alpha 1", 515, at_8.updates.value),
    ]


def _lower(where: str, which: str, found: Difference, less: Mean, better: float) -> Claim:
    """A claim on an entropy at a threshold, by rooms in which both strategies ran."""
    nats = found.setup.gain_threshold
    here = f"{less.value:+.2f} ± {less.half:.2f} nats, in {100 * better:.0f} % of rooms"
    return Claim(
        where,
        f"{which} entropy below the benchmark's at IG_thr {nats:g}",
        here,
        less.value + less.half < 0.0,
    )


def _below(found: Sequence[Averages], bench: Averages, field: str) -> list[bool]:
    limit = getattr(bench, field).value
    return [getattr(each, field).value < limit for each in found]


def _up_to(values: Sequence[float], holds: Sequence[bool], last: float) -> bool:
    """Whether something holds for all values below ``last``."""
    return all(held for value, held in zip(values, holds, strict=True) if value < last)


def _listed(values: Sequence[float], holds: Sequence[bool]) -> str:
    kept = [f"{value:g}" for value, held in zip(values, holds, strict=True) if held]
    if len(kept) == len(values):
        return "for all"
    return f"at {', '.join(kept)}" if kept else "for none"


def _near(value: float, said: float) -> bool:
    return abs(value / said - 1.0) <= NEAR


def _count(where: str, what: str, said: int, value: float) -> Claim:
    return Claim(where, f"{what}: {said}", f"{value:.0f}", _near(value, said))
