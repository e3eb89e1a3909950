"""The posterior of a door's habits as a mixture, for the question of how often the door is moved.

Looks that are hours apart tell little between a door that is seldom moved and one that is moved and
put back between them. Over the level of the rate of moves the likelihood is steep on one side and
nearly flat on the other, so that one Gaussian is too narrow. The prior of the level is therefore a
mixture of narrow normal distributions, and each of them gives a Gaussian posterior by Laplace's
approximation, with its evidence as its weight (as the grid over hyperparameters of Rue, Martino and
Chopin 2009, *Approximate Bayesian inference for latent Gaussian models*, J. R. Stat. Soc. B 71).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.geometry import FloatArray
from objstate.habits.calendar import Calendar
from objstate.habits.design import Design
from objstate.habits.factor import root_of
from objstate.habits.looks import RegionLooks
from objstate.habits.model import Evidence, Gaussian, Told, evidence_of, laplace, mode, prior

NARROWER = 3.0  # deviation of the prior of the level over that of a component
APART = 1.5  # component deviations between components: their sum is even to 2 %
LEAST_LOG = -4.0  # log weight against the largest, below which no further component is added
FURTHEST = 12  # components to each side of the first
SEED = 0  # of draws


@dataclass(frozen=True, eq=False)
class Mixture:
    """A distribution of parameters."""

    weights: FloatArray  # (c,) which sum to one
    parts: tuple[Gaussian, ...]  # (c,)

    def draws(self, count: int) -> FloatArray:
        """(count, p) draws, always the same, of each part by its weight."""
        places = (np.arange(count) + 0.5) / count
        chosen = np.searchsorted(np.cumsum(self.weights), places).clip(max=len(self.parts) - 1)
        rng, out = np.random.default_rng(SEED), []
        for part in chosen.tolist():
            of = self.parts[part]
            out.append(of.mean + of.root @ rng.standard_normal(len(of.mean)))
        return np.array(out)


@dataclass(frozen=True, eq=False)
class Levels:
    """The level of the rate of moves as the prior has it, cut into narrow components."""

    prior: Gaussian
    along: FloatArray  # (p,) parameters to the level

    @property
    def _std(self) -> float:
        return float(np.sqrt(self.along @ self.prior.covariance @ self.along))

    @property
    def step(self) -> float:
        """Between components."""
        return APART * self._std / NARROWER

    def component(self, level: float) -> Gaussian:
        """The prior of parameters whose level is normal about ``level``, a component wide."""
        of, std = self.prior, self._std
        gain = self.gain(of)
        narrower = std**2 * (1.0 - 1.0 / NARROWER**2)
        mean = of.mean + gain * (level - self.along @ of.mean)
        return Gaussian(mean, of.covariance - np.outer(gain, gain) * narrower)

    def gain(self, of: Gaussian) -> FloatArray:
        """(p,) by how much parameters change with the level."""
        towards = of.covariance @ self.along
        return np.asarray(towards / (self.along @ towards))

    def log_weight(self, level: float) -> float:
        """Of a component, but for a constant, such that the mixture of all is the prior."""
        variance = self._std**2 * (1.0 - 1.0 / NARROWER**2)
        return -0.5 * float((level - self.along @ self.prior.mean) ** 2 / variance)


def fit_levels(
    design: Design, calendar: Calendar, looks: RegionLooks, before: Gaussian | None = None
) -> Mixture:
    """The posterior of the parameters after looks, at least one."""
    levels = Levels(before or prior(design), design.level)
    return mixture(evidence_of(design, calendar, looks), levels)


def without(told: Told, after: Gaussian, before: Gaussian) -> Gaussian:
    """What is known ``after`` all looks, but for some that tell this: the cavity of these.

    ``before`` is what is known without any look (Minka 2001, *Expectation propagation for
    approximate Bayesian inference*).
    """
    found = told(after.mean)
    assumed, known = (np.linalg.inv(each.covariance) for each in (before, after))
    root = root_of(known - assumed - found.information, before)
    pull = (known - found.information) @ after.mean - found.score
    covariance = np.linalg.inv(assumed + root.T @ root)
    return Gaussian(covariance @ pull, (covariance + covariance.T) / 2.0)


def mixture(told: Told, levels: Levels) -> Mixture:
    """The posterior by the evidence at any parameters."""
    middle = mode(told, levels.prior).theta
    centre = float(levels.along @ middle)
    found = {0: _component(told, levels, centre, middle)}
    for side in (1, -1):
        at = found[0]
        for k in range(1, FURTHEST + 1):
            start = at[2].theta + side * levels.step * levels.gain(at[1])
            at = _component(told, levels, centre + side * k * levels.step, start)
            found[side * k] = at
            if at[0] < max(each[0] for each in found.values()) + LEAST_LOG:
                break
    ordered = [found[k] for k in sorted(found)]
    log_weights = np.array([each[0] for each in ordered])
    weights = np.exp(log_weights - log_weights.max())
    return Mixture(weights / weights.sum(), tuple(each[1] for each in ordered))


def _component(
    told: Told, levels: Levels, level: float, start: FloatArray
) -> tuple[float, Gaussian, Evidence]:
    """Its log weight after the looks, its posterior, and the evidence at its mode."""
    before = levels.component(level)
    found = mode(told, before, start)
    after = laplace(found, before)
    off = found.theta - before.mean
    height = found.log_likelihood - 0.5 * float(off @ np.linalg.solve(before.covariance, off))
    wider = np.linalg.slogdet(before.covariance)[1] - np.linalg.slogdet(after.covariance)[1]
    return levels.log_weight(level) + height - 0.5 * float(wider), after, found
