"""How fast the next action is chosen: ``python benchmarks/choosing.py``

The office of ``objstate reproduce maintenance``: 50 objects, four places to look at each from. Prints
processor times of one choice, of the fastest of some rounds: the first of a new coordinator, when every
look has to be simulated, the first at other places and moments, and later ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from time import process_time

import numpy as np

from objstate.experiments.office_day.office import Office, office
from objstate.gaze import Floor, Sensor
from objstate.maintenance import Coordinator, CoordinatorSettings
from objstate.objects import ObjectBelief, filter_for
from objstate.particles import Weights

PLACES = np.array([[1.5, 5.0, 0.0], [20.0, 5.0, 0.0], [30.0, 0.0, 1.0], [43.0, -5.0, 2.0]])
HOURS = (0.1, 0.5, 2.0)  # since everything was seen
KNOWN = 0.02  # m and rad
ROUNDS = 5


def seen(place: Office, hours: float) -> Iterator[tuple[str, ObjectBelief]]:
    """What is believed of each object some time after it was seen where its prior has it."""
    rng = np.random.default_rng(0)
    for name, item in place.building.objects.items():
        model = filter_for(item, place.settings)
        prior = model.prior(rng)
        off = (prior.states - prior.states[rng.integers(len(prior.states))]) / KNOWN
        weights = np.exp(-0.5 * (off**2).sum(axis=1)) + np.finfo(float).tiny
        known = prior.with_weights(Weights.of(weights))
        if not known.cell.any():
            states = item.home + KNOWN * rng.standard_normal(prior.states.shape)
            known = prior.with_samples(states, prior.weights)
        yield name, replace(model.predict(known, hours * 3600.0, rng), stamp_ns=0)


def times(
    moments: Mapping[str, Mapping[str, ObjectBelief]], new: Callable[[], Coordinator]
) -> None:
    """A row for each moment and place: the first choice there, and the mean of ten more."""
    first: dict[tuple[str, str], float] = {}
    later: dict[tuple[str, str], float] = {}
    for _ in range(ROUNDS):
        coordinator = new()
        for what, beliefs in moments.items():
            for at in PLACES:
                spot = (what, f"{at[0]:.0f}, {at[1]:.0f}")
                began = process_time()
                coordinator.choose(beliefs, at)
                took = process_time() - began
                first[spot] = min(took, first.get(spot, np.inf))
                began = process_time()
                for _ in range(10):
                    coordinator.choose(beliefs, at)
                took = (process_time() - began) / 10
                later[spot] = min(took, later.get(spot, np.inf))
    for (what, spot), took in first.items():
        again = later[what, spot]
        print(f"| {what} | {spot} | {1e3 * took:.0f} ms | {1e3 * again:.0f} ms |", flush=True)


if __name__ == "__main__":
    place = office(np.random.default_rng([0, 0]))
    settings = CoordinatorSettings()
    floor = Floor.of(place.shut, settings.floor)

    def new() -> Coordinator:
        return Coordinator(place.building, [Sensor("laser")], settings, place.settings, floor)

    priors = {
        name: filter_for(item, place.settings).prior(np.random.default_rng(0))
        for name, item in place.building.objects.items()
    }
    new().choose(priors, PLACES[0])  # compiles
    moments = {"nothing seen": priors} | {f"seen {h:g} h ago": dict(seen(place, h)) for h in HOURS}
    print("| beliefs | robot at | first | again |\n| --- | --- | --- | --- |")
    times(moments, new)
