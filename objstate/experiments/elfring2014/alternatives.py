"""Alternative assumptions for section 7, one at a time, and the main ones together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from objstate.experiments.elfring2014.setup import Assumptions
from objstate.gaze.sensors import ALL_ROUND

DEFAULT = Assumptions()
ALL = replace(DEFAULT, counted="all objects")

ALTERNATIVES: dict[str, Assumptions] = {
    "as assumed": DEFAULT,
    "sees 90 deg": replace(DEFAULT, field_of_view=np.radians(90.0)),
    "sees all round": replace(DEFAULT, field_of_view=ALL_ROUND),
    "time step 1 s": replace(DEFAULT, step=1.0),
    "shortest order, 0.9 m/s": replace(DEFAULT, order="shortest", speed=0.9),
    "updates while waiting": replace(DEFAULT, updates_when_idle=True),
    "positions of 2 coordinates": replace(DEFAULT, coordinates=2),
    "gain: what is left at the end": replace(DEFAULT, counting="at the end"),
    "gains of all objects": ALL,
    "all, 2 coordinates": replace(ALL, coordinates=2),
    "all, at the end": replace(ALL, counting="at the end"),
    "all, at the end, 2 coordinates": replace(ALL, counting="at the end", coordinates=2),
}
