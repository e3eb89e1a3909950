"""Sections without Embree hit what Embree hits, along rays that are level."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import Mesh
from objstate.building.shapes import Cylinder
from objstate.errors import PlatformError
from objstate.sensing.section import SectionCaster
from tests.rooms import block, enclosure, placed
from tests.sensing.casting import assert_as_embree

FLAT = np.eye(3)
THINGS = Mesh.joined(
    [
        enclosure(8.0, 6.0),
        block(1.0, 1.0, 0.4, 0.3, 0.5),
        block(1.4, 1.0, 0.4, 0.3, 0.5),  # it touches the one beside it
        Cylinder(0.2, 0.9).mesh().moved(placed(-2.0, -1.0, 0.45)),
    ]
)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_level_rays_hit_what_embree_hits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    upright = placed(0.0, 0.0, 0.0, tuple(rng.uniform(-3.0, 3.0, 3)))[:3, :3]
    mesh = THINGS.moved(np.block([[upright.T, np.zeros((3, 1))], [np.zeros((1, 3)), 1.0]]))
    heights = rng.choice([0.3, 1.7, 2.6], 200)
    bearing = rng.uniform(-np.pi, np.pi, 200)
    origins = np.column_stack([rng.uniform(-3.9, 3.9, 200), rng.uniform(-2.9, 2.9, 200), heights])
    directions = np.column_stack([np.cos(bearing), np.sin(bearing), np.zeros(200)])
    found = SectionCaster(mesh, upright).distances(origins @ upright, directions @ upright)
    assert np.isinf(found[heights == 2.6]).all()  # it is above everything
    assert_as_embree(found, THINGS, origins, directions)


def test_a_corner_where_segments_meet_lets_nothing_through() -> None:
    caster = SectionCaster(enclosure(8.0, 6.0), FLAT)
    corner = np.array([4.0, 3.0, 0.0])
    origins = np.random.default_rng(1).uniform([-3.5, -2.5, 0.5], [3.5, 2.5, 0.5], (1000, 3))
    towards = (corner - origins) * [1.0, 1.0, 0.0]
    gap = np.linalg.norm(towards, axis=1)
    assert caster.distances(origins, towards / gap[:, None]) == pytest.approx(gap, abs=1e-6)


def test_nothing_is_hit_where_there_is_nothing() -> None:
    nothing = Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    ray = np.array([[0.0, 0.0, 0.5]]), np.array([[1.0, 0.0, 0.0]])
    assert np.isinf(SectionCaster(nothing, FLAT).distances(*ray)).all()


def test_a_tilted_ray_is_refused() -> None:
    slope = np.array([[np.cos(0.01), 0.0, np.sin(0.01)]])
    with pytest.raises(PlatformError, match="Linux on Arm"):
        SectionCaster(THINGS, FLAT).distances(np.array([[0.0, 0.0, 0.5]]), slope)
