"""The coordinator against four simpler strategies, each with more and with less driving."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from objstate.experiments.office_day import strategies
from objstate.experiments.office_day.day import Day, run_day
from objstate.experiments.office_day.office import Office, office, working_day
from objstate.experiments.office_day.robot import Robot
from objstate.experiments.office_day.strategies import Choose
from objstate.gaze import Floor, LookSettings, Sensor
from objstate.geometry import FloatArray
from objstate.maintenance import ChoiceSettings, Coordinator, CoordinatorSettings, GainWeight
from objstate.processes import in_order

START = np.array([1.5, 5.0, 0.0])  # m, m, rad: at the west end of the north corridor
DOORS = GainWeight(match="door_*", weight=3.0)  # one coordinate, against three of a chest
# what this robot is off by here, and what its estimator learns of the widths of chests
LOOKS = LookSettings(robot_std=0.012, robot_yaw_std=0.003, variance_factor=0.2)
SETTLING = 0.25  # of the time, after which beliefs are judged: the first drives learn everything

COORDINATOR = "coordinator"

# By strategy, what makes it drive more or less: the weight of the coordinator's cost; s between
# the beginnings of rounds, s after which an object counts as old, s between random looks.
KNOBS: dict[str, tuple[float, ...]] = {
    COORDINATOR: (0.7,),
    "fixed round": (1500.0, 2700.0),
    "oldest first": (2400.0,),
    "greedy nearest": (1500.0, 2700.0),
    "random": (120.0,),
}


@dataclass(frozen=True)
class Trial:
    """One strategy on one day."""

    strategy: str
    knob: float
    seed: int
    hours: float


@dataclass(frozen=True, eq=False)
class Worth:
    """What a trial came to, after settling."""

    trial: Trial
    distance: float  # m an hour
    entropy: float  # nats, mean over time of all objects' together
    right: float  # share of doors whose most probable angle is within 10 degrees, mean over time
    predicted: float  # nats, of all tasks together; zero where nothing was predicted
    realized: float  # nats
    tasks: int
    outcomes: dict[str, int]
    lost: int  # stretches in which the robot was lost
    path: FloatArray = field(repr=False)  # (n, 3) where the robot was, from the beginning


@dataclass(frozen=True)
class Saving:
    """What the coordinator drives, and what others drive to know the same."""

    knob: float  # of the coordinator
    own: float  # m an hour
    best: float  # m an hour, of the other strategy that drives least; nan where none knows the same
    strategy: str  # which that is

    @property
    def share(self) -> float:
        """Of the other's way that the coordinator saves."""
        return 1.0 - self.own / self.best


def compare(
    hours: float, days: int, processes: int, knobs: dict[str, tuple[float, ...]] | None = None
) -> list[Worth]:
    """Every strategy with each of its knobs, on the same days in the same office."""
    trials = [
        Trial(name, knob, seed, hours)
        for name, values in (knobs or KNOBS).items()
        for knob in values
        for seed in range(1, days + 1)
    ]
    return list(in_order(try_day, trials, processes))


def try_day(trial: Trial) -> Worth:
    """One strategy on one day. Two strategies with one seed meet the same day."""
    place = office(np.random.default_rng([trial.seed, 0]))
    truth = working_day(place, trial.hours, np.random.default_rng([trial.seed, 1]))
    sensor = Sensor("laser")
    robot = Robot(place, truth, sensor, START, trial.seed)
    choose = _strategy(trial, _coordinator(place, sensor, trial))
    return _worth(trial, run_day(place, truth, robot, choose, trial.hours))


def savings(found: Sequence[Worth], measure: Callable[[Worth], float]) -> list[Saving]:
    """For each of the coordinator's knobs, how far others drive where a measure is equal.

    Each strategy is a curve of the measure over the distance, means over days, straight
    between its knobs; it counts where its curve reaches the coordinator's measure.
    """
    names = sorted({each.trial.strategy for each in found} - {COORDINATOR})
    others = {name: _curve(found, name, measure) for name in names}
    saved = []
    for knob in sorted({w.trial.knob for w in found if w.trial.strategy == COORDINATOR}):
        own = [w for w in found if (w.trial.strategy, w.trial.knob) == (COORDINATOR, knob)]
        distance, level = (float(np.mean(all_)) for all_ in zip(*((w.distance, measure(w)) for w in own), strict=True))  # fmt: skip
        ways = {name: _way_at(curve, level) for name, curve in others.items()}
        ways = {name: way for name, way in ways.items() if np.isfinite(way)}
        best = min(ways, key=ways.__getitem__, default="")
        saved.append(Saving(knob, distance, ways.get(best, float("nan")), best))
    return saved


def _curve(
    found: Sequence[Worth], strategy: str, measure: Callable[[Worth], float]
) -> tuple[np.ndarray, np.ndarray]:
    """Distances (k,) and measures (k,) of a strategy's knobs, means over days, by the measure."""
    mine = [each for each in found if each.trial.strategy == strategy]
    points = []
    for knob in sorted({each.trial.knob for each in mine}):
        days = [each for each in mine if each.trial.knob == knob]
        points.append([np.mean([d.distance for d in days]), np.mean([measure(d) for d in days])])
    table = np.array(points)
    table = table[table[:, 1].argsort()]
    return table[:, 0], table[:, 1]


def _way_at(curve: tuple[np.ndarray, np.ndarray], level: float) -> float:
    distances, measures = curve
    if not measures[0] <= level <= measures[-1]:
        return float("nan")
    return float(np.interp(level, measures, distances))


def _coordinator(place: Office, sensor: Sensor, trial: Trial) -> Coordinator:
    choice = ChoiceSettings(cost_weight=trial.knob if trial.strategy == COORDINATOR else 1.0)
    settings = CoordinatorSettings(choice=choice, looks=LOOKS, weights=(DOORS,))
    floor = Floor.of(place.shut, settings.floor)
    return Coordinator(place.building, [sensor], settings, place.settings, floor)


def _strategy(trial: Trial, coordinator: Coordinator) -> Choose:
    rng = np.random.default_rng([trial.seed, 2])
    makers: dict[str, Callable[[], Choose]] = {
        COORDINATOR: lambda: strategies.coordinated(coordinator),
        "fixed round": lambda: strategies.fixed_round(coordinator, trial.knob),
        "oldest first": lambda: strategies.oldest_first(coordinator, trial.knob),
        "greedy nearest": lambda: strategies.greedy_nearest(coordinator, trial.knob),
        "random": lambda: strategies.at_random(coordinator, trial.knob, rng),
    }
    return makers[trial.strategy]()


def _worth(trial: Trial, day: Day) -> Worth:
    settled = day.times >= SETTLING * trial.hours * 3600.0
    since = max(int(settled.argmax()) - 1, 0)
    hours = (day.times[-1] - day.times[since]) / 3600.0
    return Worth(
        trial,
        distance=float((day.driven[-1] - day.driven[since]) / hours),
        entropy=float(day.entropies[settled].mean()),
        right=float(day.right[settled].mean()),
        predicted=float(day.predicted.sum()),
        realized=float(day.realized.sum()),
        tasks=day.tasks,
        outcomes=day.outcomes,
        lost=day.lost,
        path=day.path,
    )
