"""embreex as it comes, to measure against: arrays ready in float32, nothing done with what it reads."""

from __future__ import annotations

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from objstate.building.model import Building, Mesh
from objstate.geometry import FloatArray, invert, transform_from_pose
from objstate.records import Rays, Scan
from objstate.sensing import BeamModel, cast_from

MISS = 1e36
Single = np.ndarray  # float32


class RawScene:
    """One mesh in an Embree scene of its own."""

    def __init__(self, mesh: Mesh) -> None:
        self._scene = EmbreeScene(robust=True)
        faces = np.ascontiguousarray(mesh.faces, dtype=np.int32)
        TriangleMesh(self._scene, single(mesh.vertices), faces)

    def run(self, rays: tuple[Single, Single]) -> Single:
        """Distances (n,) along rays, 1e37 where nothing is hit."""
        return np.asarray(self._scene.run(*rays, query="DISTANCE"))


def single(values: FloatArray) -> Single:
    """The same in single precision."""
    return np.ascontiguousarray(values, dtype=np.float32)


def flat(rays: tuple[FloatArray, FloatArray]) -> tuple[Single, Single]:
    """Origins and directions (..., 3), all in a row."""
    origins, directions = rays
    return single(origins.reshape(-1, 3)), single(directions.reshape(-1, 3))


def prepared(poses: FloatArray, rays: Rays) -> tuple[Single, Single]:
    """Rays from robot poses as embreex takes them."""
    return flat(cast_from(transform_from_pose(poses), rays))


class BruteForce:
    """Every robot sample, state and beam of one object's estimate, cast by embreex."""

    def __init__(
        self, building: Building, name: str, states: FloatArray, poses: FloatArray, scan: Scan
    ) -> None:
        self._scan, self._item = scan, building[name]
        self._states, self._poses = states, poses
        self._walls, self._object = RawScene(building.walls), RawScene(self._item.mesh)
        self._ready = (prepared(poses, scan.rays), self._in_link())

    def _in_link(self) -> tuple[Single, Single]:
        """Rays in the object's own frame, for all poses (p) and states (s) in turn."""
        into = invert(self._item.transforms(self._states))
        base = into[None] @ transform_from_pose(self._poses)[:, None]
        return flat(cast_from(base, self._scan.rays))

    def cast(self) -> tuple[Single, Single]:
        """All distances, and nothing else: what embreex alone takes."""
        walls, triples = self._ready
        return self._walls.run(walls), self._object.run(triples)

    def log_likelihood(self, model: BeamModel) -> FloatArray:
        """log p(o | s, l) - log p(o | object absent, l) (p, s), from the rays on."""
        walls = self._walls.run(prepared(self._poses, self._scan.rays)).astype(float)
        alone = self._object.run(self._in_link()).astype(float)
        shape = len(self._poses), len(self._states), len(self._scan)
        walls, alone = (np.where(each > MISS, np.inf, each) for each in (walls, alone))
        walls, alone = walls.reshape(shape[0], 1, shape[2]), alone.reshape(shape)
        along = model.along(self._scan.ranges, self._scan.range_max)
        return np.asarray(along(np.minimum(walls, alone))[0] - along(walls)[0])


def posterior(prior: FloatArray, log_likelihood: FloatArray, tempering: float) -> FloatArray:
    """p(s) (s,) by Bayes' rule given each of equally likely robot poses (p, s), then averaged."""
    given = prior * np.exp(tempering * (log_likelihood - log_likelihood.max(axis=1)[:, None]))
    return np.asarray((given / given.sum(axis=1, keepdims=True)).mean(axis=0))
