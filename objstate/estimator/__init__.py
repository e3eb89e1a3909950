"""The loop: simultaneous object state estimation and localization."""

from objstate.estimator.estimator import Estimator

__all__ = ["Estimator"]
