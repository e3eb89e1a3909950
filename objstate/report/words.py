"""What a page says in plain words: states, moments, warnings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime

from objstate.evaluation import LatestState
from objstate.evaluation.units import UNITS
from objstate.report.material import Material

LEAST_PRESENCE = 0.5  # furniture less likely to be there at all is worth a word
LEAST_FIT = 0.5  # so is an object whose best state explains fewer of the beams on it,
FITS = 20  # by the median of so many last scans that bore on it: one alone may have few beams
UNSURE = {"deg": 20.0, "m": 0.2}  # an interval so wide is worth a word
NAMES_SHOWN = 8  # so many names tell which objects are meant


def figure(coordinate: str, value: float | None) -> str:
    """A state as people read it, with its unit."""
    if value is None:
        return "–"
    unit, factor, decimals = UNITS[coordinate]
    return f"{factor * value:z.{decimals}f}{'°' if unit == 'deg' else ' m'}"


def moment(stamp_ns: int) -> str:
    """A stamp as a date and time of UTC."""
    return f"{datetime.fromtimestamp(stamp_ns / 1e9, UTC):%Y-%m-%d %H:%M:%S} UTC"


def span(seconds: float) -> str:
    """A duration."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


def warnings(material: Material, latest: Sequence[LatestState]) -> list[str]:
    """Everything that should make a reader wonder: the run's own warnings, then the report's."""
    return [*material.summary["warnings"], *material.doubts, *_of_states(material, latest)]


def _of_states(material: Material, latest: Sequence[LatestState]) -> Iterator[str]:
    in_view = set(material.estimates["object"])
    never = [name for name in material.summary["objects"] if name not in in_view]
    if never:
        yield f"The robot never had {_some(never)} in view from near; the plan shows them as the model does."
    unseen = _names(state for state in latest if not state.estimate.observed)
    if unseen:
        yield f"No beam bore on {_some(unseen)}; their states are what was assumed before."
    unsure = _names(state for state in latest if state.estimate.observed and _is_unsure(state))
    if unsure:
        yield f"The scans left it open how {_some(unsure)} stood: the 90 % interval is wide."
    gone = _names(state for state in latest if state.estimate.presence < LEAST_PRESENCE)
    if gone:
        yield f"Probably not there at all any more: {_some(gone)}."
    strange = _badly_fitting(material)
    if strange:
        yield (
            f"Even the best state of {_some(strange)} explains less than half of the beams on "
            "it: something stands there that the building doesn't hold, or a hinge is wrong."
        )
    wrong = _names(state for state in latest if _misses(state))
    if wrong:
        yield f"The true state of {_some(wrong)} lies outside the last 90 % interval."


def _badly_fitting(material: Material) -> list[str]:
    """The objects that no state explains well."""
    import polars as pl

    fits = (
        material.estimates.filter(pl.col("observed") & ~pl.col("lost"))
        .unique(["stamp", "object"], keep="first", maintain_order=True)
        .group_by("object", maintain_order=True)
        .agg(pl.col("fit").tail(FITS).median())
    )
    return sorted(fits.filter(pl.col("fit") < LEAST_FIT)["object"])


def _names(states: Iterable[LatestState]) -> list[str]:
    return list(dict.fromkeys(state.estimate.object for state in states))


def _is_unsure(state: LatestState) -> bool:
    unit, factor, _ = UNITS[state.estimate.coordinate]
    return factor * (state.estimate.upper - state.estimate.lower) > UNSURE[unit]


def _misses(state: LatestState) -> bool:
    if state.error is None:
        return False
    true = state.estimate.mean - state.error
    return not state.estimate.lower <= true <= state.estimate.upper


def _some(names: Sequence[str]) -> str:
    more = len(names) - NAMES_SHOWN
    shown = ", ".join(names[:NAMES_SHOWN])
    return f"{shown} and {more} more" if more > 0 else shown
