"""What should make the reader of a page wonder, in plain words."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from objstate.building.model import COORDINATES, Kind
from objstate.evaluation import LatestState
from objstate.evaluation.units import UNITS
from objstate.order import natural_key
from objstate.report.judgement import Judged, judged
from objstate.report.material import Material

LEAST_PRESENCE = 0.5  # furniture less likely to be there at all is worth a word
LEAST_FIT = 0.5  # so is an object whose best state explains fewer of the beams on it,
FITS = 20  # number of last observing scans whose median counts: a single one may have few beams
UNSURE = {"deg": 20.0, "m": 0.2}  # an interval so wide is worth a word
NAMES_SHOWN = 8  # most names in a list


def warnings(material: Material, latest: Sequence[LatestState]) -> list[str]:
    """Everything that should make a reader wonder: the run's own warnings, then the report's."""
    own = sorted(latest, key=lambda state: natural_key(state.estimate.object))
    return [*material.summary["warnings"], *material.doubts, *_of_states(material, own)]


def _of_states(material: Material, latest: Sequence[LatestState]) -> Iterator[str]:
    in_view = set(material.estimates["object"])
    objects = sorted(material.summary["objects"], key=natural_key)
    never = [name for name in objects if name not in in_view]
    if never:
        yield f"The robot never had {_some(never)} in view from near; the plan shows them as the model does."
    unseen = _names(state for state in latest if not state.estimate.observed)
    if unseen:
        yield f"No beam reached {_some(unseen)}; their states are the priors."
    unsure = _names(state for state in latest if state.estimate.observed and _is_unsure(state))
    if unsure:
        yield f"The scans left it open how {_some(unsure)} stood: the 90 % interval is wide."
    gone = _names(state for state in latest if _is_gone(state))
    if gone:
        yield f"Probably not there at all any more: {_some(gone)}."
    strange = _badly_fitting(material)
    if strange:
        yield (
            f"Even the best state of {_some(strange)} explains less than half of the beams on "
            "it: something that isn't in the building stands there, or the model of the object is "
            "wrong. The state may be right all the same."
        )
    yield from _of_verdicts(judged(latest, material.symmetry))


def _of_verdicts(states: Iterable[Judged]) -> Iterator[str]:
    """Warnings about last states that the truth contradicts."""
    known = list(states)
    for kind, told in (
        (
            "wrong",
            "The last state of {} is wrong: the true one lies far outside its 90 % interval.",
        ),
        (
            "outside",
            "The true state of {} lies outside the last 90 % interval, though not far off.",
        ),
    ):
        names = _names(each.state for each in known if each.verdict == kind)
        if names:
            yield told.format(_some(names))


def _badly_fitting(material: Material) -> list[str]:
    """The objects that no state explains well."""
    import polars as pl

    fits = (
        material.estimates.filter(pl.col("observed") & ~pl.col("lost"))
        .unique(["stamp", "object"], keep="first", maintain_order=True)
        .group_by("object", maintain_order=True)
        .agg(pl.col("fit").tail(FITS).median())
    )
    return sorted(fits.filter(pl.col("fit") < LEAST_FIT)["object"], key=natural_key)


def _names(states: Iterable[LatestState]) -> list[str]:
    return list(dict.fromkeys(state.estimate.object for state in states))


def _is_gone(state: LatestState) -> bool:
    """Whether it is furniture that isn't there; doors without a leaf are in the run's warnings."""
    is_furniture = state.estimate.coordinate in COORDINATES[Kind.PLANAR]
    return is_furniture and state.estimate.presence < LEAST_PRESENCE


def _is_unsure(state: LatestState) -> bool:
    unit, factor, _ = UNITS[state.estimate.coordinate]
    return factor * (state.estimate.upper - state.estimate.lower) > UNSURE[unit]


def _some(names: Sequence[str]) -> str:
    more = len(names) - NAMES_SHOWN
    shown = ", ".join(names[:NAMES_SHOWN])
    return f"{shown} and {more} more" if more > 0 else shown
