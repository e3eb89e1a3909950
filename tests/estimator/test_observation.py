"""What one scan says of the objects near, each by itself."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from objstate.building.model import Building, Mesh, MovableObject
from objstate.config import BeamModelSettings, Settings
from objstate.estimator.believed import Believed
from objstate.estimator.observation import Observation, observe
from objstate.geometry import FloatArray
from objstate.localization import PoseBelief
from objstate.objects import ObjectBelief
from objstate.particles import Weights
from objstate.records import Scan
from objstate.sensing import BeamModel, ExpectedRanges, ScanView, Sensing
from tests.rooms import block, building, door, enclosure, fan, observed, table, wall

TEMPERING = 0.2
ROBOT = np.array([0.35, -0.6, 1.4])
RAYS = fan(181, 1.5 * np.pi)


def doorway(*unmodelled: Mesh, item: MovableObject | None = None) -> Building:
    """A wall at y = 1 with a doorway from x = 0 to 0.9, and a room behind."""
    walls = [wall((-3, 1), (0, 1)), wall((0.9, 1), (3, 1)), enclosure(6.0, 8.0)]
    return building(Mesh.joined([*walls, *unmodelled]), item or door("door", 0.0, 1.0))


def read(place: Building, name: str, state: FloatArray, seed: int | None = None) -> Scan:
    rng = None if seed is None else np.random.default_rng(seed)
    return observed(ExpectedRanges(place), {name: state}, ROBOT, RAYS, rng)


def view_of(place: Building, scan: Scan) -> ScanView:
    return Sensing(place, BeamModel(BeamModelSettings())).view(scan)


def exactly(pose: FloatArray) -> PoseBelief:
    return PoseBelief(pose[None], Weights.uniform(1))


def seen(
    state: Believed,
    name: str,
    view: ScanView,
    robot: PoseBelief,
    stamp_ns: int = 1,
    shift_std: float = 0.0,
) -> Observation:
    return observe(state, view, [name], robot, stamp_ns, TEMPERING, shift_std)


def after_scans(
    place: Building, name: str, scans: Sequence[Scan], known: dict[str, ObjectBelief] | None = None
) -> tuple[ObjectBelief, list[float | None]]:
    """The marginal after scans from the true pose, five a second, and the fits."""
    state, fits = Believed(place, Settings(), 0, known or {}), []
    for k, scan in enumerate(scans):
        observation = seen(state, name, view_of(place, scan), exactly(ROBOT), k * 2 * 10**8)
        state.keep(observation.beliefs.items())
        fits.append(observation.fits.get(name))
    return state.marginals[name], fits


# --- fit ----------------------------------------------------------------------------


def test_a_door_that_is_found_fits() -> None:
    place = doorway()
    scans = [read(place, "door", np.array([0.6]), seed) for seed in range(6)]
    belief, fits = after_scans(place, "door", scans)
    assert np.degrees(abs(belief.mean[0] - 0.6)) < 1.0
    assert fits[-1] is not None
    assert fits[-1] > 0.9


def test_where_something_unmodelled_stands_no_state_fits() -> None:
    """A box before the doorway, which no angle of the leaf explains."""
    place, reality = doorway(), doorway(block(0.45, 0.75, 0.5, 0.1, 0.5))
    scans = [read(reality, "door", np.array([1.5]), seed) for seed in range(6)]
    _, fits = after_scans(place, "door", scans)
    assert fits[-1] is not None
    assert fits[-1] < 0.75


def test_an_object_on_which_no_beam_bears_has_no_fit_and_keeps_its_belief() -> None:
    place = doorway()
    view = view_of(place, read(place, "door", np.array([0.6])))
    behind = PoseBelief(np.array([[-2.0, -2.0, -np.pi / 2]]), Weights.uniform(1))
    state = Believed(place, Settings(), 0, {})
    observation = observe(state, view, ["door"], behind, 1, TEMPERING, 0.0)
    assert observation.fits == {}
    np.testing.assert_array_equal(
        observation.beliefs["door"].weights.values, state.marginals["door"].weights.values
    )


# --- what hides, and what isn't there -----------------------------------------------


@pytest.mark.parametrize("degrees", [10.0, 45.0, 80.0])
def test_a_door_hidden_by_an_unmodelled_box_keeps_its_belief(degrees: float) -> None:
    """It spreads as things do in time, and isn't pushed to a limit."""
    place, true = doorway(), np.radians([degrees])
    known, _ = after_scans(place, "door", [read(place, "door", true, k) for k in range(8)])
    box = doorway(block(0.4, 0.1, 1.6, 0.1))
    hidden = [read(box, "door", true, k) for k in range(25)]
    belief, _ = after_scans(place, "door", hidden, {"door": known})
    assert np.degrees(abs(belief.mean[0] - true[0])) < 1.5


def table_room(stands: bool) -> tuple[Building, Building]:
    """What the model says, and what is: a chest before the robot, or none."""
    item = table("table", 0.35, 0.7)
    walls = enclosure(6.0, 6.0)
    return building(walls, item), building(walls, *([item] if stands else []))


@pytest.mark.parametrize(("stands", "sure"), [(True, 0.99), (False, 0.01)])
def test_presence_goes_up_where_furniture_is_seen_and_down_where_beams_pass(
    stands: bool, sure: float
) -> None:
    place, reality = table_room(stands)
    states = {"table": place["table"].home} if stands else {}
    scans = [
        observed(ExpectedRanges(reality), states, ROBOT, RAYS, np.random.default_rng(k))
        for k in range(10)
    ]
    belief, fits = after_scans(place, "table", scans)
    assert (belief.presence > sure) is stands
    assert (belief.presence < sure) is not stands
    assert fits[-1] is not None
    assert fits[-1] > 0.9  # by its absence, where it is gone
