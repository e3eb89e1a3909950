"""One estimate of one object, and the brute force that casts every robot sample, state and beam."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.altered import Altered
from benchmarks.speed.places import about, boxes, door, laser, scan_from, u_shape
from benchmarks.speed.raw import BruteForce, posterior
from benchmarks.speed.table import Table, milliseconds, number, times
from benchmarks.speed.timing import Effort, in_turns
from objstate.building.model import Building, Kind, MovableObject
from objstate.config import ObjectRule, Settings
from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief, ScanEvidence, filter_for
from objstate.particles import Weights
from objstate.records import Scan
from objstate.sensing import BeamModel, Comparison, Sensing

ROBOT = np.array([0.0, 0.0, 0.4])
SAMPLES, BEAMS = 100, 181
SHIFT = 0.005  # m by which the building may be off, as runs begin


@dataclass(frozen=True, eq=False)
class Case:
    """An object, how finely it is estimated, and the scan that is to tell of it."""

    building: Building
    name: str
    settings: Settings
    scan: Scan

    @property
    def item(self) -> MovableObject:
        return self.building[self.name]


def room(item: MovableObject) -> Building:
    """A room of 10 by 8 m with a few boxes and one object."""
    centres = [
        [0.0, 4.0],
        [0.0, -4.0],
        [5.0, 0.0],
        [-5.0, 0.0],
        [3.0, 2.5],
        [-2.0, 2.0],
        [1.0, -3.0],
    ]
    sizes = [
        [10.0, 0.12],
        [10.0, 0.12],
        [0.12, 8.0],
        [0.12, 8.0],
        [0.5, 0.5],
        [0.8, 0.4],
        [0.6, 0.6],
    ]
    return Building("room", boxes(np.array(centres), np.array(sizes)), {item.name: item})


def door_case(states: int) -> Case:
    """A door 2 m ahead in so many states, from closed to 90 degrees."""
    settings = Altered(changes={"resolution_deg": 90.0 / (states - 1)})
    return _case(door("door", 2.0, 0.3, opens=1.0), np.array([0.6]), settings)


def u_case(samples: int) -> Case:
    """A U-shaped object 2.5 m ahead, whose place is known to some centimetres, of so many samples."""
    rule = ObjectRule(match="*", prior_std_m=0.05, prior_std_deg=3.0)
    settings = Altered(objects=(rule,), changes={"samples": samples})
    return _case(u_shape("u", 2.5, 0.5), np.array([2.53, 0.48, 0.03]), settings)


def _case(item: MovableObject, true_state: FloatArray, settings: Settings) -> Case:
    building = room(item)
    rng = np.random.default_rng(4)
    scan = scan_from(building, {item.name: true_state}, ROBOT, laser(BEAMS), rng)
    return Case(building, item.name, settings, scan)


class Estimate:
    """One estimate: from the scan and the samples of the robot belief to the posterior."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.poses = about(ROBOT, SAMPLES)
        self.in_runs = case.item.kind is not Kind.PLANAR
        model = BeamModel(case.settings.beam_model)
        self.model = model if self.in_runs else model.beam_by_beam
        self.tempering = case.settings.object_updates.tempering
        self._sensing = Sensing(case.building, model)
        self._filter = filter_for(case.item, case.settings)
        self.prior = self._filter.prior(np.random.default_rng(6))

    def posterior(self, shift_std: float = SHIFT) -> ObjectBelief:
        """p(s | o), with the expected ranges of the walls and of the object."""
        view = self._sensing.view(self.case.scan)
        background = view.walls(self.poses)
        evidence = ScanEvidence(
            name=self.case.name,
            view=view,
            poses=self.poses,
            robot_weights=Weights.uniform(SAMPLES),
            background=background,
            log_absent=view.log_likelihood(background),
            tempering=self.tempering,
            shift_std=shift_std,
        )
        update = self._filter.update(self.prior, evidence, np.random.default_rng(7))
        assert update is not None
        return update.belief

    def log_likelihood(self) -> FloatArray:
        """log p(o | s, l) - log p(o | object absent, l) (p, s), of every pose and state."""
        view = self._sensing.view(self.case.scan)
        comparison = Comparison(background=view.walls(self.poses), in_runs=self.in_runs)
        found, _ = view.object_log_likelihood(
            self.case.name, self.prior.states, self.poses, comparison
        )
        return found

    def brute_force(self) -> BruteForce:
        case = self.case
        return BruteForce(case.building, case.name, self.prior.states, self.poses, case.scan)


def estimates(effort: Effort) -> list[Table]:
    """Doors and a U-shaped object, each coarsely and finely."""
    cases = [door_case(10), door_case(91), u_case(40), u_case(400)]
    return [
        Table(
            "One estimate of one object",
            (
                "object",
                "states",
                "estimate",
                "embreex alone, every triple",
                "ratio",
                "brute force in all",
                "ratio",
                "log-likelihoods differ by",
                "posterior by",
            ),
            [_row(Estimate(case), effort) for case in cases],
            (
                f"Marginal inference, from a scan of {BEAMS} beams and {SAMPLES} robot samples to the posterior. "
                "*embreex alone* casts every beam from every robot sample for every state, from arrays that are "
                "ready; *brute force* adds preparing them and the log-likelihoods. The last two columns are the "
                "largest differences to brute force, in nats of a whole scan and in probability of a state.",
                "Where more than 50 states of a door have weight, 50 are cast and the likelihood is "
                "interpolated. The U-shaped object's filter resamples, so that posteriors can't be compared.",
            ),
        )
    ]


def _row(estimate: Estimate, effort: Effort) -> tuple[str, ...]:
    brute, model = estimate.brute_force(), estimate.model
    calls: dict[str, Any] = {
        "estimate": estimate.posterior,
        "cast": brute.cast,
        "brute": lambda: brute.log_likelihood(model),
    }
    taken = in_turns(calls, effort)
    exact = brute.log_likelihood(model)
    off = np.abs(exact - estimate.log_likelihood()).max()
    return (
        estimate.case.name,
        str(len(estimate.prior.states)),
        milliseconds(taken["estimate"]),
        milliseconds(taken["cast"]),
        times(taken["cast"] / taken["estimate"]),
        milliseconds(taken["brute"]),
        times(taken["brute"] / taken["estimate"]),
        number(float(off)),
        _posterior_difference(estimate, exact),
    )


def _posterior_difference(estimate: Estimate, exact: FloatArray) -> str:
    if estimate.case.item.kind is Kind.PLANAR:
        return "-"
    weights = estimate.posterior(shift_std=0.0).weights.values
    true = posterior(estimate.prior.weights.values, exact, estimate.tempering)
    return number(float(np.abs(weights - true).max()))
