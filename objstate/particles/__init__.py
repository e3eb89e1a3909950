"""Weighted samples: weights in log space, resampling, quantiles, entropy."""

from objstate.particles.weights import (
    ImpossibleEvidenceError,
    Weights,
    entropy,
    evenly,
    kld_sample_size,
    largest_step,
    quantiles,
    systematic,
)

__all__ = [
    "ImpossibleEvidenceError",
    "Weights",
    "entropy",
    "evenly",
    "kld_sample_size",
    "largest_step",
    "quantiles",
    "systematic",
]
