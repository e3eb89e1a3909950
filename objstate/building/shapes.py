"""The shapes a URDF link is made of, and their triangles."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from objstate.building.mesh_files import load_mesh
from objstate.building.model import Mesh
from objstate.geometry import FloatArray, IntArray

SAGITTA = 0.0005  # m, how far a facet may lie inside the true round surface
MIN_SECTIONS = 16  # facets around even the thinnest cylinder
MOST_SECTIONS = 512  # around the thickest: enough up to a radius of 26 m


@dataclass(frozen=True)
class Box:
    """A box about its middle."""

    size: tuple[float, ...]  # x, y, z m

    def mesh(self) -> Mesh:
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        return Mesh(corners * np.array(self.size) / 2, _triangles(np.array(quads)))


@dataclass(frozen=True)
class Cylinder:
    """A cylinder about its middle, its axis along z."""

    radius: float  # m
    length: float  # m

    def mesh(self) -> Mesh:
        count = _sections(self.radius)
        ring = self.radius * _circle(count)
        half = np.full((count, 1), self.length / 2)
        ends = np.array([[0.0, 0.0, -self.length / 2], [0.0, 0.0, self.length / 2]])
        vertices = np.concatenate([np.hstack([ring, -half]), np.hstack([ring, half]), ends])
        here, after = np.arange(count), (np.arange(count) + 1) % count
        sides = _triangles(np.column_stack([here, after, after + count, here + count]))
        bottom = np.column_stack([np.full(count, 2 * count), after, here])
        top = np.column_stack([np.full(count, 2 * count + 1), here + count, after + count])
        return Mesh(vertices, np.concatenate([sides, bottom, top]))


@dataclass(frozen=True)
class Sphere:
    """A sphere about its middle."""

    radius: float  # m

    def mesh(self) -> Mesh:
        count = _sections(self.radius)
        polar = np.linspace(0.0, np.pi, count // 2 + 1)
        ring = _circle(count)
        rows = [np.hstack([np.sin(p) * ring, np.full((count, 1), np.cos(p))]) for p in polar]
        row, column = np.meshgrid(np.arange(count // 2), np.arange(count), indexing="ij")
        after = (column + 1) % count
        quads = [row * count + column, (row + 1) * count + column]
        quads += [(row + 1) * count + after, row * count + after]
        corners = np.stack(quads, axis=-1).reshape(-1, 4)
        return Mesh(self.radius * np.concatenate(rows), _triangles(corners))


@dataclass(frozen=True)
class MeshFile:
    """A mesh in a file of its own."""

    path: Path
    scale: tuple[float, ...]  # along the link's x, y, z
    where: str = field(compare=False)  # the line that names it, for errors

    def mesh(self) -> Mesh:
        loaded = load_mesh(self.path, self.where)
        return Mesh(loaded.vertices * np.array(self.scale), loaded.faces)


Shape = Box | Cylinder | Sphere | MeshFile


def _sections(radius: float) -> int:
    """How many facets keep within SAGITTA of a circle; an even number."""
    half_angle = np.arccos(max(0.0, 1.0 - SAGITTA / radius))
    return 2 * int(np.ceil(np.clip(np.pi / half_angle, MIN_SECTIONS, MOST_SECTIONS) / 2))


def _circle(count: int) -> FloatArray:
    """(count, 2) points on the unit circle."""
    turn = 2 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(turn), np.sin(turn)])


def _triangles(quads: IntArray) -> IntArray:
    """(2q, 3) two triangles for each quad (q, 4)."""
    return np.asarray(np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), dtype=np.int64)
