"""The experiments of section 4 of Schulz and Burgard 2001, on simulated drives.

D. Schulz and W. Burgard, "Probabilistic state estimation of dynamic objects with a
moving mobile robot", Robotics and Autonomous Systems 34 (2001) 107-115.
"""

from __future__ import annotations

from collections.abc import Mapping

from objstate.experiments.reproduction import Experiment
from objstate.experiments.schulz2001 import desks, doors, movable, pictures

TITLE = "Schulz and Burgard 2001, section 4"
EXPERIMENTS: Mapping[str, Experiment] = {
    "doors": Experiment(doors.trial, doors.tables, pictures.draw_doors, "fig3_doors.png"),
    "movable": Experiment(movable.trial, movable.tables, pictures.draw_movable, "fig6_movable.png"),
    "desks": Experiment(desks.trial, desks.tables, pictures.draw_desks, "fig8_desks.png"),
}
