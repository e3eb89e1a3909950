"""What one log adds to the errors of many: sums that can be added up, so that no log is read twice.

Of all updates, by condition: counts, sums and a histogram of the absolute errors, from which
quantiles are told to half a percent. Of the final estimates, of which there are few, every one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.evaluation.movements import MovementErrors, together
from objstate.evaluation.summary import FAR_M, FAR_RAD, NEAR_M, NEAR_RAD, ROTATIONS, StateErrors
from objstate.geometry import FloatArray, IntArray
from objstate.packing import pack, unpack

if TYPE_CHECKING:
    import polars as pl

STEP = math.log(1.005)  # in the logarithm of an absolute error: the width of the histogram's bins
SMALLEST, LARGEST = 1e-9, 1e4  # rad or m; where the bins begin and end
BINS = 1 + math.ceil(math.log(LARGEST / SMALLEST) / STEP)
JOINED = 1000  # logs after which their final estimates become one
MOMENTS = 7  # count, sums of error, its absolute value and its square; near, far, inside
FINAL = ("period", "error", "inside", "std", "lower", "upper")  # of a final estimate

Key = tuple[str, str, str]  # condition, label, coordinate


@dataclass(frozen=True, eq=False)
class Sums:
    """What one log adds: of its updates by condition, and its final estimates."""

    keys: tuple[Key, ...]
    moments: FloatArray  # (g, MOMENTS)
    places: IntArray  # (h,) whose count is not zero: BINS times a key's number, plus the bin
    counts: IntArray  # (h,)
    objects: tuple[str, ...]  # names that ``finals`` numbers
    coordinates: tuple[str, ...]
    finals: Mapping[str, np.ndarray]  # "object" and "coordinate", numbers, and FINAL; (f,) each
    notes: tuple[str, ...] = ()  # what could not be told, and why
    movements: MovementErrors | None = None  # of all objects; None where there are none


def sums_of(
    parts: Mapping[Key, pl.DataFrame],
    judged: pl.DataFrame,
    notes: Sequence[str],
    movements: MovementErrors | None = None,
) -> Sums:
    """The sums of judged estimates, of which ``parts`` are the updates that share a condition."""
    moments = np.zeros((len(parts), MOMENTS))
    places = []
    for number, ((_, _, coordinate), part) in enumerate(parts.items()):
        errors, inside = part["error"].to_numpy(), part["inside"].to_numpy()
        absolute = np.abs(errors)
        near, far = (NEAR_RAD, FAR_RAD) if coordinate in ROTATIONS else (NEAR_M, FAR_M)
        moments[number] = (
            len(errors),
            errors.sum(),
            absolute.sum(),
            np.sum(errors**2),
            np.count_nonzero(absolute <= near),
            np.count_nonzero(absolute <= far),
            np.count_nonzero(inside),
        )
        places.append(BINS * number + _bins(absolute))
    found, counts = np.unique(np.concatenate([np.zeros(0, int), *places]), return_counts=True)
    objects, coordinates, finals = _finals(judged)
    return Sums(
        tuple(parts),
        moments,
        found,
        counts,
        objects,
        coordinates,
        finals,
        tuple(notes),
        movements,
    )


def packed(sums: Sums) -> bytes:
    """The sums as bytes."""
    words = {
        "keys": sums.keys,
        "objects": sums.objects,
        "coordinates": sums.coordinates,
        "notes": sums.notes,
        "movements": None if sums.movements is None else astuple(sums.movements),
    }
    arrays = {
        "moments": sums.moments,
        "places": np.diff(sums.places, prepend=0).astype("<u4"),
        "counts": sums.counts.astype("<u4"),
        **{f"final {name}": values for name, values in sums.finals.items()},
    }
    return pack(words, arrays)


def unpacked(content: bytes, what: str) -> Sums:
    """The sums that were packed. Raises WorldError for damage."""
    words, arrays = unpack(content, what)
    return Sums(
        keys=tuple((str(a), str(b), str(c)) for a, b, c in words["keys"]),
        moments=arrays["moments"],
        places=np.cumsum(arrays["places"].astype(np.int64)),
        counts=arrays["counts"].astype(np.int64),
        objects=tuple(words["objects"]),
        coordinates=tuple(words["coordinates"]),
        finals={
            name.removeprefix("final "): values
            for name, values in arrays.items()
            if name.startswith("final ")
        },
        notes=tuple(words["notes"]),
        movements=None if words["movements"] is None else MovementErrors(*words["movements"]),
    )


class Totals:
    """The sums of many logs added up."""

    def __init__(self) -> None:
        self._numbers: dict[Key, int] = {}
        self._moments = np.zeros((0, MOMENTS))
        self._histograms = np.zeros((0, BINS), dtype=np.int64)
        self._finals = Finals()
        self.notes: list[str] = []
        self.movements: MovementErrors | None = None

    def add(self, log: str, sums: Sums) -> None:
        """Add those of a log."""
        number = np.array([self._number(key) for key in sums.keys], dtype=np.int64)
        self._moments[number] += sums.moments
        rows, bins = np.divmod(sums.places, BINS)
        self._histograms[number[rows], bins] += sums.counts
        self._finals.add(log, sums)
        self.notes += [f"{log}: {note}" if log else note for note in sums.notes]
        some = [each for each in (self.movements, sums.movements) if each is not None]
        self.movements = together(some) if some else None

    def errors(self) -> Iterator[tuple[Key, StateErrors]]:
        """The errors of the updates by condition, label and coordinate, in no order."""
        for key, number in self._numbers.items():
            yield key, _summary(self._moments[number], self._histograms[number])

    def finals(self) -> pl.DataFrame:
        """The final estimates of all logs: ``log, object, coordinate, final`` and FINAL."""
        return self._finals.table()

    def _number(self, key: Key) -> int:
        number = self._numbers.setdefault(key, len(self._numbers))
        if number == len(self._moments):  # twice as much room
            more = max(64, number)
            self._moments = np.concatenate([self._moments, np.zeros((more, MOMENTS))])
            room = np.zeros((more, BINS), dtype=np.int64)
            self._histograms = np.concatenate([self._histograms, room])
        return number


@dataclass(eq=False)
class Finals:
    """The final estimates of many logs."""

    logs: list[str] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    names: dict[str, int] = field(default_factory=dict)
    kinds: dict[str, int] = field(default_factory=dict)
    columns: dict[str, list[np.ndarray]] = field(default_factory=dict)

    def add(self, log: str, sums: Sums) -> None:
        """Add those of a log."""
        self.logs.append(log)
        self.counts.append(len(sums.finals["object"]))
        for column, names, known in (
            ("object", sums.objects, self.names),
            ("coordinate", sums.coordinates, self.kinds),
        ):
            numbers = np.array([known.setdefault(n, len(known)) for n in names], dtype=np.int32)
            self.columns.setdefault(column, []).append(numbers[sums.finals[column]])
        for column in FINAL:
            self.columns.setdefault(column, []).append(sums.finals[column])
        if len(self.logs) % JOINED == 0:  # thousands of small arrays take more than what they hold
            self.columns = {n: [np.concatenate(parts)] for n, parts in self.columns.items()}

    def table(self) -> pl.DataFrame:
        """All of them."""
        import polars as pl

        whole = {name: np.concatenate(parts) for name, parts in self.columns.items()}
        log = np.repeat(np.arange(len(self.logs)), self.counts)
        named = {
            "log": pl.Series(self.logs, dtype=pl.String).gather(log),
            "object": pl.Series(list(self.names), dtype=pl.String).gather(whole.pop("object")),
            "coordinate": pl.Series(list(self.kinds), dtype=pl.String).gather(
                whole.pop("coordinate")
            ),
        }
        frame = pl.DataFrame(named | {name: pl.Series(part) for name, part in whole.items()})
        return frame.with_columns(final=pl.lit(True))


def _finals(
    judged: pl.DataFrame,
) -> tuple[tuple[str, ...], tuple[str, ...], dict[str, np.ndarray]]:
    """Names of objects and coordinates, and the final estimates by numbers of these."""
    if judged.is_empty():
        none = {name: np.zeros(0) for name in ("error", "std", "lower", "upper")}
        whole = {name: np.zeros(0, dtype=np.int32) for name in ("object", "coordinate", "period")}
        return (), (), whole | {"inside": np.zeros(0, dtype=bool)} | none
    finals = judged.filter("final")
    objects, object_ = np.unique(finals["object"].to_numpy().astype(str), return_inverse=True)
    kinds, kind = np.unique(finals["coordinate"].to_numpy().astype(str), return_inverse=True)
    columns: dict[str, Any] = {name: finals[name].to_numpy() for name in FINAL}
    columns["period"] = columns["period"].astype(np.int32)
    numbers = {"object": object_.astype(np.int32), "coordinate": kind.astype(np.int32)}
    return tuple(objects.tolist()), tuple(kinds.tolist()), numbers | columns


def _bins(absolute: FloatArray) -> IntArray:
    """(n,) the bin of each absolute error."""
    clipped = np.clip(absolute, SMALLEST, LARGEST)
    place = np.floor(np.log(clipped / SMALLEST) / STEP).astype(np.int64)
    return np.asarray(np.clip(place, 0, BINS - 1))


def _summary(moments: FloatArray, histogram: IntArray) -> StateErrors:
    count, bias, mean, square, near, far, inside = (float(each) for each in moments)
    return StateErrors(
        count=int(count),
        bias=bias / count,
        mean=mean / count,
        rms=math.sqrt(square / count),
        median=_quantile(histogram, 0.5),
        p90=_quantile(histogram, 0.9),
        within_near=near / count,
        within_far=far / count,
        coverage=inside / count,
    )


def _quantile(histogram: IntArray, share: float) -> float:
    """As of the sorted errors, interpolated; within a bin they are taken as evenly spread."""
    position = share * (int(histogram.sum()) - 1)
    below = math.floor(position)
    low, high = (_ranked(histogram, rank) for rank in (below, math.ceil(position)))
    return low + (position - below) * (high - low)


def _ranked(histogram: IntArray, rank: int) -> float:
    """The error of a rank from 0 on."""
    up_to = np.cumsum(histogram)
    place = int(np.searchsorted(up_to, rank, side="right"))
    count = int(histogram[place])
    within = (rank - (int(up_to[place]) - count) + 0.5) / count
    return SMALLEST * math.exp(STEP * (place + within))
