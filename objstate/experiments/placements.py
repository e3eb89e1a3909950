"""Final estimates of furniture: position and heading together."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import degrees

import numpy as np

from objstate.experiments.tables import figure, mean, percent, rms
from objstate.experiments.trial import Final
from objstate.geometry import FloatArray

ERROR_COLUMNS = (
    "n", "mean error (cm)", "(deg)", "right", "in 90 % interval",
    "bound (cm)", "(deg)", "error / bound (cm)", "(deg)",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Placement:
    """Where a piece of furniture was believed to stand in the end, or before it was moved."""

    object: str
    stamp_ns: int
    truth: FloatArray  # (3,) x m, y m, yaw rad
    estimate: FloatArray  # (3,)
    bound: FloatArray  # (3,) least standard deviations
    inside: tuple[bool, ...]  # (3,) the truth lies inside the 90 % interval

    @property
    def off(self) -> float:
        """Distance to the true position, m."""
        return float(np.hypot(*(self.estimate - self.truth)[:2]))

    @property
    def turned(self) -> float:
        """Error of the heading, rad, without its sign."""
        return float(abs((self.estimate - self.truth)[2]))

    @property
    def least_off(self) -> float:
        """Bound of the root mean square distance, m."""
        return float(np.hypot(*self.bound[:2]))

    def within(self, distance: float, turn: float) -> bool:
        """Whether it is no farther off than so many m, and turned by no more than so many rad."""
        return self.off <= distance and self.turned <= turn


def placements(finals: Iterable[Final]) -> list[Placement]:
    """The placements that final estimates of x, y and yaw make, by object and time."""
    groups: dict[tuple[str, int], dict[str, Final]] = defaultdict(dict)
    for final in finals:
        groups[final.object, final.stamp_ns][final.coordinate] = final
    return [
        _placement(name, stamp, [parts[c] for c in ("x", "y", "yaw")])
        for (name, stamp), parts in sorted(groups.items())
        if parts.keys() == {"x", "y", "yaw"}
    ]


def _placement(name: str, stamp: int, parts: list[Final]) -> Placement:
    return Placement(
        object=name,
        stamp_ns=stamp,
        truth=np.array([part.truth for part in parts]),
        estimate=np.array([part.estimate for part in parts]),
        bound=np.array([part.bound for part in parts]),
        inside=tuple(part.inside for part in parts),
    )


def error_cells(placed: Sequence[Placement], distance: float, turn: float) -> tuple[str, ...]:
    """Errors of placements, under ERROR_COLUMNS; right is within so many m and rad."""
    off, turned = [each.off for each in placed], [each.turned for each in placed]
    least_off = rms(each.least_off for each in placed)
    least_turned = rms(float(each.bound[2]) for each in placed)
    return (
        str(len(placed)),
        figure(100 * mean(off)),
        figure(degrees(mean(turned))),
        percent(each.within(distance, turn) for each in placed),
        percent(inside for each in placed for inside in each.inside),
        figure(100 * least_off),
        figure(degrees(least_turned)),
        figure(rms(off) / least_off, 1),
        figure(rms(turned) / least_turned, 1),
    )
