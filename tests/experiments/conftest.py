"""Runs and final estimates made up by hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from objstate.experiments.trial import Final, Run


def placed(
    name: str,
    stamp_ns: int,
    truth: Sequence[float] = (0.0, 0.0, 0.0),
    errors: Sequence[float] = (0.0, 0.0, 0.0),
) -> list[Final]:
    """Final estimates of x, y and yaw, whose bound is 1 cm and 1 rad; inside where nearly right."""
    parts = zip(("x", "y", "yaw"), truth, errors, (0.01, 0.01, 1.0), strict=True)
    return [
        Final(name, kind, stamp_ns, true, error, abs(error) < 0.03, bound)
        for kind, true, error, bound in parts
    ]


def run_of(setting: str, seed: int, finals: Sequence[Final]) -> Run:
    return Run(setting, seed, 10.0, tuple(finals), (), np.zeros((2, 3)), 0.01)
