"""Beliefs and objects as bytes, small enough to keep for years."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.building.model import Kind, Mesh, MovableObject
from objstate.geometry import wrap
from objstate.objects import ObjectBelief
from objstate.packing import pack, unpack
from objstate.particles import Weights

# weights and samples: a relative error of 1e-7 is far below the information of scans
SINGLE = "<f4"
DOUBLE = "<f8"


def pack_belief(belief: ObjectBelief) -> bytes:
    """A belief without its stamps, and of its object only where it hangs. Lattices keep their weights, samples also places."""
    log, there = (
        np.asarray(belief.weights.log, dtype=SINGLE),
        dict[str, Any](presence=belief.presence),
    )
    if belief.attributes:
        there["attributes"] = {name: dict(values) for name, values in belief.attributes.items()}
    if belief.item.kind is not Kind.PLANAR:
        ends, hinge = belief.states[[0, -1], 0].tolist(), belief.item.hinge.tolist()
        words = {"ends": ends, "cell": float(belief.cell[0]), "hinge": hinge}
        return pack(words | there, {"log": log})
    middle = belief.states.mean(axis=0)  # single precision counts from here
    off = np.asarray(belief.states - middle, dtype=SINGLE)
    words = {"middle": middle.tolist(), **there}
    return pack(words, {"log": log, "off": off})


def unpack_belief(
    packed: bytes, item: MovableObject, stamp_ns: int, last_observed_ns: int | None
) -> ObjectBelief:
    """The belief that was packed, of the object where it was found to hang. Raises WorldError for damage."""
    words, arrays = unpack(packed, f"The belief of '{item.name}' at {stamp_ns} ns")
    count = len(arrays["log"]) - int(
        words.get("scouts", 0)
    )  # earlier worlds end with samples that count for nothing
    weights = Weights.of_logarithms(arrays["log"][:count].astype(float))
    if item.kind is not Kind.PLANAR:
        first, last = words["ends"]
        states = np.linspace(first, last, len(weights))[:, None]
        cell = np.array([words["cell"]])
        hinge = np.array(words.get("hinge", item.hinge))  # earlier worlds don't say
        item = item if np.array_equal(hinge, item.hinge) else item.hung_at(hinge)
    else:
        states, cell = np.array(words["middle"]) + arrays["off"][:count], np.zeros(3)
        states[:, 2] = wrap(states[:, 2])
    return ObjectBelief(
        item,
        states,
        weights,
        cell,
        words["presence"],
        stamp_ns,
        last_observed_ns,
        attributes=words.get("attributes", {}),
    )


def pack_object(item: MovableObject) -> bytes:
    """The building's data of a movable object, so that a world can be queried without it."""
    words = {"kind": item.kind.value, "lower": item.lower, "upper": item.upper, "wraps": item.wraps}
    arrays = {
        "origin": np.asarray(item.origin, dtype=DOUBLE),
        "axis": np.asarray(item.axis, dtype=DOUBLE),
        "vertices": np.asarray(item.mesh.vertices, dtype=DOUBLE),
        "faces": np.asarray(item.mesh.faces, dtype="<i8"),
    }
    return pack(words, arrays)


def unpack_object(packed: bytes, name: str) -> MovableObject:
    """The object that was packed. Raises WorldError for damage."""
    words, arrays = unpack(packed, f"The object '{name}'")
    return MovableObject(
        name=name,
        kind=Kind(words["kind"]),
        origin=arrays["origin"],
        axis=arrays["axis"],
        lower=words["lower"],
        upper=words["upper"],
        mesh=Mesh(arrays["vertices"], arrays["faces"]),
        wraps=words["wraps"],
    )
