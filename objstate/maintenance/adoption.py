"""A candidate gets a name, a place in the building, and a belief in the world."""

from __future__ import annotations

import re
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from objstate.building import load_building
from objstate.building.adding import with_box
from objstate.building.model import Building, MovableObject
from objstate.building.sidecar import SUFFIX
from objstate.errors import BuildingError, ResultError
from objstate.geometry import wrap
from objstate.maintenance.answers import LEAST_PRESENCE
from objstate.objects import ObjectBelief
from objstate.outputs import whole
from objstate.particles import Weights
from objstate.recording.candidates import CANDIDATES, Found, read_candidates
from objstate.world.store import WorldStore

STD = 0.05  # m: a candidate's outline is known to a cell of the grid
SAMPLES = 400
NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*")


def adopt(
    store: WorldStore,
    building: Path,
    result: Path,
    candidate: str,
    name: str,
    out: Path,
    height: float = 1.0,
) -> Building:
    """Keep a candidate of a result as an object: a box in a new URDF, and a belief in the world.

    The world is of the new building from then on. Nothing is changed where anything is refused.

    Args:
        store: the world, which has learnt from the result's log.
        building: the URDF of the world's building.
        result: the folder of ``estimate --grid``.
        candidate: its name there.
        name: of the object.
        out: the URDF to write, in the folder of the old one, as its meshes are found from there.
        height: m, of the box, which a level laser can't measure.

    Raises:
        ResultError: the result has no such candidate, or ``out`` exists.
        BuildingError: ``name`` is taken or can't be one, or ``out`` lies elsewhere.
        WorldError: the world is of another building, or hasn't learnt from that log.
    """
    found = _found(result, candidate)
    if not NAME.fullmatch(name):
        raise BuildingError(f"'{name}' can't be an object's name; use letters, digits, _ . and -.")
    if out.absolute().parent != building.absolute().parent:
        raise BuildingError(
            f"{out} has to lie in the folder of {building}: files that it names are found from "
            "there."
        )
    if not (np.isfinite(height) and height > 0.0):
        raise BuildingError(f"An object can't be {height:g} m high; give a height above 0 m.")
    before = load_building(building)
    store.check(before)
    pose, size = np.array([found.x, found.y, found.yaw]), (found.length, found.width, height)
    text = with_box(building.read_text(encoding="utf-8"), name, pose, size)
    sidecar = building.with_name(building.stem + SUFFIX)
    with ExitStack() as made:
        _write(out, text, made)
        if sidecar.is_file():
            _write(out.with_name(out.stem + SUFFIX), sidecar.read_text(encoding="utf-8"), made)
        grown = load_building(out)
        store.adopt(before, grown, _belief(grown[name], found))
        made.pop_all()
    return grown


def _write(path: Path, text: str, made: ExitStack) -> None:
    """A new file, which goes again unless all went well."""
    with whole(path) as file:
        file.write_text(text, encoding="utf-8")
    made.callback(path.unlink)


def _found(result: Path, candidate: str) -> Found:
    known = {each.name: each for each in read_candidates(result)}
    if candidate not in known:
        mapped = (result / CANDIDATES).is_file()
        listed = ", ".join(known) or ("none" if mapped else "none; estimate the log with --grid")
        raise ResultError(f"{result} has no candidate '{candidate}'; it has {listed}.")
    return known[candidate]


def _belief(item: MovableObject, found: Found) -> ObjectBelief:
    """The place of a candidate at its last observation."""
    std = np.array([STD, STD, STD / max(found.length, STD)])
    states = item.home + std * np.random.default_rng(0).standard_normal((SAMPLES, 3))
    states[:, 2] = wrap(states[:, 2])
    return ObjectBelief(
        item,
        states,
        Weights.uniform(SAMPLES),
        np.zeros(3),
        min(found.probability, 1.0 - LEAST_PRESENCE),
        stamp_ns=found.last_ns,
        last_observed_ns=found.last_ns,
    )
