"""What people type for a sensor: ``front:range=8,view=180``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from objstate.errors import SettingsError

if TYPE_CHECKING:
    from objstate.gaze import Sensor
    from objstate.gaze.field import Head

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
HEAD = (
    "NAME:view=DEG,range=M,turn=DEG (to either side),speed=DEG (per second),yaw=DEG (its present "
    "direction), and all fields of a sensor, all but the name optional"
)
HEAD_FIELDS = {"turn": "turn", "speed": "speed"}
ANGLES = ("view", "yaw", "turn", "speed")
VIEW = math.radians(60.0)  # of a head where nothing else is said


def parse_sensor(text: str) -> Sensor:
    """The sensor that ``--sensor`` gives. Raises SettingsError."""
    from objstate.gaze import Sensor

    name, given = _given(text, "--sensor", "sensor", SENSOR, FIELDS)
    return Sensor(name, **given)


def parse_head(text: str) -> Head:
    """The head that ``--head`` gives. Raises SettingsError."""
    from objstate.gaze import Sensor
    from objstate.gaze.field import Head

    name, given = _given(text, "--head", "head", HEAD, FIELDS | HEAD_FIELDS)
    own = {key: given.pop(key) for key in HEAD_FIELDS.values() if key in given}
    return Head(Sensor(name, **({"field_of_view": VIEW} | given)), **own)


def _given(
    text: str, option: str, noun: str, form: str, known: Mapping[str, str]
) -> tuple[str, dict[str, Any]]:
    """The name and the fields that an option's value gives. Raises SettingsError."""
    name, _, rest = text.partition(":")
    try:
        pairs = [_pair(part, noun, known) for part in rest.split(",") if part.strip()]
    except ValueError as error:
        raise SettingsError(f"{option} '{text}' is no {noun}; give {form}.") from error
    if not name.strip():
        raise SettingsError(f"{option} '{text}' has no name; give {form}.")
    return name.strip(), dict(pairs)


def _pair(text: str, noun: str, known: Mapping[str, str]) -> tuple[str, float]:
    """A field and its value. Raises ValueError."""
    key, _, number = text.strip().partition("=")
    if key not in known:
        raise ValueError(f"no {noun} has '{key}'")
    value = int(number) if key == "beams" else float(number)
    return known[key], math.radians(value) if key in ANGLES else value
