"""Other answers to what section 7 leaves open, one at a time, and those that change most together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from objstate.experiments.elfring2014.setup import Assumptions
from objstate.gaze.sensors import ALL_ROUND

DEFAULT = Assumptions()

ALTERNATIVES: dict[str, Assumptions] = {
    "as assumed": DEFAULT,
    "shortest order, 0.9 m/s": replace(DEFAULT, order="shortest", speed=0.9),
    "sees 90 deg": replace(DEFAULT, field_of_view=np.radians(90.0)),
    "sees all round": replace(DEFAULT, field_of_view=ALL_ROUND),
    "time step 1 s": replace(DEFAULT, step=1.0),
    "time step 0.25 s": replace(DEFAULT, step=0.25),
    "updates while waiting": replace(DEFAULT, updates_when_idle=True),
    "gain: what is left at the end": replace(DEFAULT, counting="at the end"),
    "positions of 3 coordinates": replace(DEFAULT, coordinates=3),
    "3 coordinates, gain at the end": replace(DEFAULT, coordinates=3, counting="at the end"),
    "the same, sees 90 deg": replace(
        DEFAULT, coordinates=3, counting="at the end", field_of_view=np.radians(90.0)
    ),
    "3 coordinates, step 1 s, shortest": replace(
        DEFAULT, coordinates=3, step=1.0, order="shortest", speed=0.9
    ),
}
