"""What people type for a sensor: ``front:range=8,view=180``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from objstate.errors import SettingsError

if TYPE_CHECKING:
    from objstate.gaze import Sensor

SENSOR = (
    "NAME:range=M,near=M,view=DEG,beams=N,sigma=M,height=M,x=M,y=M,yaw=DEG (mounting), all but "
    "the name optional"
)
FIELDS = {
    "range": "range_max",
    "near": "range_min",
    "view": "field_of_view",
    "beams": "beams",
    "sigma": "sigma",
    "height": "height",
    "x": "x",
    "y": "y",
    "yaw": "yaw",
}
ANGLES = ("view", "yaw")


def parse_sensor(text: str) -> Sensor:
    """The sensor that ``--sensor`` gives. Raises SettingsError."""
    from objstate.gaze import Sensor

    name, _, rest = text.partition(":")
    try:
        given: dict[str, Any] = dict(_pair(part) for part in rest.split(",") if part.strip())
        sensor = Sensor(name.strip(), **given)
    except ValueError as error:
        raise SettingsError(f"--sensor '{text}' is no sensor; give {SENSOR}.") from error
    if not name.strip():
        raise SettingsError(f"--sensor '{text}' has no name; give {SENSOR}.")
    return sensor


def _pair(text: str) -> tuple[str, float]:
    """A field of ``Sensor`` and its value. Raises ValueError."""
    key, _, number = text.strip().partition("=")
    if key not in FIELDS:
        raise ValueError(f"no sensor has '{key}'")
    value = int(number) if key == "beams" else float(number)
    return FIELDS[key], math.radians(value) if key in ANGLES else value
