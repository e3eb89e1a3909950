"""The file beside a URDF that says how far the building is off."""

from pathlib import Path

from objstate.building.sidecar import read_sidecar, sidecar_of, sidecar_path
from objstate.config import BuildingErrorSettings, DoorErrorSettings


def test_what_was_learnt_of_doors_is_read_as_written(tmp_path: Path) -> None:
    doors = {
        "a": DoorErrorSettings(hinge_std_m=0.01, bearing_std_deg=1.0, stop_is_known=False),
        "b": DoorErrorSettings(hinge_std_m=0.0123, bearing_std_deg=0.5),
    }
    urdf = tmp_path / "office.urdf"
    error = BuildingErrorSettings(wall_std_m=0.02, doors=doors)
    sidecar_path(urdf).write_text(sidecar_of(error), encoding="utf-8")
    read = read_sidecar(urdf)
    assert read is not None
    assert read.doors == doors
