"""Which beams pass a leaf's free edge tells how wide it is."""

from __future__ import annotations

import json

import numpy as np
import pytest

from objstate.config import BuildingErrorSettings
from objstate.world.statics import DoorEvidence, combined
from objstate.world.widths import WIDTHS, WidthEvidence, wider
from tests.rooms import door
from tests.world.test_statics import evidence

ERROR = BuildingErrorSettings()


def seen(width: float, std: float = 0.004, aim: tuple[float, float] = (1.0, 0.0)) -> WidthEvidence:
    """A drive that found the free edge so much farther from the modelled hinge."""
    return WidthEvidence(-0.5 * ((WIDTHS - width) / std) ** 2, 50.0 * np.array(aim), 50.0)


def drive(width: WidthEvidence, x: float = 0.0) -> dict[str, DoorEvidence]:
    own = evidence(x, 0.0, 0.002)
    return {"door": DoorEvidence(own.places, own.pull, own.bearing, width)}


def test_a_width_is_what_all_drives_tell() -> None:
    (found,) = combined([drive(seen(-0.05)) for _ in range(4)], ERROR)
    assert found.width == pytest.approx(-0.05, abs=0.005)
    assert found.width_std < 0.01
    (untold,) = combined([drive(WidthEvidence()) for _ in range(4)], ERROR)
    assert untold.width == 0.0


def test_an_edge_that_is_farther_out_with_its_hinge_is_no_wider_leaf() -> None:
    turns = (0.0, 0.8, 1.6)
    drives = []
    for turn in turns:
        own = evidence(0.03, 0.0, 0.001, turn=turn)
        edge = seen(0.03 * np.cos(turn), aim=(np.cos(turn), np.sin(turn)))
        drives.append({"door": DoorEvidence(own.places, own.pull, own.bearing, edge)})
    (found,) = combined(drives, ERROR)
    assert found.hinge[0] == pytest.approx(0.03, abs=0.006)
    assert found.width == pytest.approx(0.0, abs=0.008)


def test_evidence_follows_the_model_and_is_written_and_read() -> None:
    about = seen(0.01).beside(np.array([0.02, 0.0]), 0.03)
    assert WIDTHS[np.argmax(about.log)] == pytest.approx(0.06, abs=0.002)
    again = WidthEvidence.read(json.loads(json.dumps(about.words())))
    np.testing.assert_allclose(again.log, about.log, atol=1e-3)
    packed = DoorEvidence.unpacked(drive(about)["door"].packed(), "door")
    np.testing.assert_allclose(packed.width.aim, about.aim)
    with pytest.raises(ValueError, match="another form"):
        WidthEvidence.read([0.0])


def test_only_the_free_edge_moves() -> None:
    before = door("door", 0.0, 0.0).mesh
    after = wider(before, 0.1)
    assert after.vertices[:, 0].max() == pytest.approx(before.vertices[:, 0].max() + 0.1)
    assert after.vertices[:, 0].min() == before.vertices[:, 0].min()
