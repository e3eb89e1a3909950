"""How well habits foretell a real door: ``python benchmarks/habits.py HISTORY [--weeks N]``

HISTORY has lines ``unix_time state``, one a minute, of which the rarer state is taken for "open". Each
of the last weeks is foretold by models trained on all before. Prints a Markdown table: the mean
log-likelihood per minute (nats; probabilities clipped at 0.001), given one look at the door some time
before, or none. With ``--few``, each model sees two looks a day of one week at random minutes, and foretells
the next week, a number of times.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np

from objstate.habits.calendar import NANOSECONDS, Calendar
from objstate.habits.design import Design
from objstate.habits.forecast import Forecast
from objstate.habits.looks import RegionLooks
from objstate.habits.model import fit

WEEK, MINUTE, CLIP = 604800, 60, 1e-3
HORIZONS = {"1 min": 1, "5 min": 5, "10 min": 10, "30 min": 30, "1 h": 60, "2 h": 120}
HORIZONS |= {"4 h": 240, "12 h": 720, "1 day": 1440, "2 days": 2880, "7 days": 10080, "no look": 0}
EVERY = 7  # minutes of a test week of which one is judged
DEFAULT_RATE, DEFAULT_OPEN = 2.0, 0.65  # moves an hour, and the share that such a door fades to
PERIODS = (2, 6, 10)  # of FreMEn
CELLS = 168  # frequencies per week that FreMEn chooses from
FEW_TRIALS, LOOKS_A_WEEK = 30, 14  # of models that see two looks a day for a week
WHOLE_WEEKS = (0, 1, 4, 5, 6, 7, 8)  # of the history, that are followed by another one
FEW = 30.0  # looks that the share of an hour counts for, in a histogram with memory

# A model: from training times (n,) s and states to p(open) at t (m,), given states at t - h, if h > 0.
Predict = Callable[[np.ndarray, int, np.ndarray], np.ndarray]
Model = Callable[[np.ndarray, np.ndarray], Predict]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("history", type=Path)
    parser.add_argument("--weeks", type=int, default=5, help="how many of the last are foretold")
    parser.add_argument("--few", action="store_true", help="learn from two looks a day of a week")
    chosen = parser.parse_args()
    times, states = read(chosen.history)
    if chosen.few:
        few(times, states)
        return
    print(f"| | {' | '.join(HORIZONS)} |\n| --- |{' --- |' * len(HORIZONS)}")
    week = (times - times[0]) // WEEK
    for name, model in MODELS.items():
        scores = [
            judged(model, times, states, week, each)
            for each in range(int(week[-1]) + 1 - chosen.weeks, int(week[-1]) + 1)
        ]
        cells = [f"{score:.3f}" for score in np.mean(scores, axis=0)]
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


def few(times: np.ndarray, states: np.ndarray) -> None:
    """The table of models that saw little."""
    week = (times - times[0]) // WEEK
    scores: dict[str, list[list[float]]] = {}
    for seed in range(FEW_TRIALS):
        rng = np.random.default_rng(seed)
        seen_in = int(rng.choice(WHOLE_WEEKS))
        seen = np.sort(rng.choice(np.flatnonzero(week == seen_in), LOOKS_A_WEEK, replace=False))
        tested = np.flatnonzero(week == seen_in + 1)[:: 4 * EVERY]
        for name, model in FEW_MODELS.items():
            predict, row = model(times[seen], states[seen]), []
            for minutes in (60, 1440, 0):
                looked = np.searchsorted(times, times[tested] - minutes * MINUTE)
                chance = predict(times[tested], minutes, states[looked])
                row.append(score(chance, states[tested]))
            scores.setdefault(name, []).append(row)
    fades = np.array(scores["fade (without habits)"])
    print("| | 1 h | 1 day | no look | trials worse than fade |\n| --- | --- | --- | --- | --- |")
    for name, rows in scores.items():
        cells = [f"{score:.3f}" for score in np.mean(rows, axis=0)]
        worse = int((np.array(rows) < fades).any(axis=1).sum())
        print(f"| {name} | {' | '.join(cells)} | {worse} of {FEW_TRIALS} |")


def read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times in s, and whether the door was open."""
    times, states = np.loadtxt(path, dtype=np.int64).T
    return times, states if states.mean() < 0.5 else 1 - states


def judged(
    model: Model, times: np.ndarray, states: np.ndarray, week: np.ndarray, number: int
) -> list[float]:
    """Log-likelihood per minute of a week, at each horizon."""
    before, tested = week < number, np.flatnonzero(week == number)[::EVERY]
    predict, out = model(times[before], states[before]), []
    for minutes in HORIZONS.values():
        looked = np.searchsorted(times, times[tested] - minutes * MINUTE)
        known = times[looked] == times[tested] - minutes * MINUTE
        at = tested[known]
        out.append(score(predict(times[at], minutes, states[looked[known]]), states[at]))
    return out


def score(chance: np.ndarray, states: np.ndarray) -> float:
    """Mean log-likelihood of states under p(open)."""
    chance = np.clip(chance, CLIP, 1 - CLIP)
    return float(np.mean(np.log(np.where(states == 1, chance, 1 - chance))))


def fade(times: np.ndarray, states: np.ndarray) -> Predict:
    """What objstate believes of an unseen door without habits."""

    def predict(at: np.ndarray, minutes: int, seen: np.ndarray) -> np.ndarray:
        kept = np.exp(-DEFAULT_RATE * minutes / 60.0) * (minutes > 0)
        return DEFAULT_OPEN + (seen - DEFAULT_OPEN) * kept

    return predict


def persistence(times: np.ndarray, states: np.ndarray) -> Predict:
    """The state that was seen persists; survival is exponential, by the mean spell of each state."""
    leaves = leaving(times, states)

    def predict(at: np.ndarray, minutes: int, seen: np.ndarray) -> np.ndarray:
        if minutes == 0:
            return np.full(len(at), states.mean())
        stays = np.exp(-leaves[seen] * minutes)
        return np.where(seen == 1, stays, 1 - stays)

    return predict


def two_state(times: np.ndarray, states: np.ndarray) -> Predict:
    """A Markov process with constant rates."""
    opens, closes = leaving(times, states)
    share = opens / (opens + closes)

    def predict(at: np.ndarray, minutes: int, seen: np.ndarray) -> np.ndarray:
        kept = np.exp(-(opens + closes) * minutes) * (minutes > 0)
        return share + (seen - share) * kept

    return predict


def leaving(times: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Rates per minute out of closed and open."""
    follows = np.diff(times) == MINUTE
    return np.array(
        [(np.diff(states) != 0)[follows & (states[:-1] == each)].mean() for each in (0, 1)]
    )


def hours(times: np.ndarray) -> np.ndarray:
    """Hour of a weekday, or of a day of the weekend."""
    return times // 3600 % 24 + 24 * ((times // 86400 + 3) % 7 >= 5)


def histogram(times: np.ndarray, states: np.ndarray) -> Predict:
    """The share of time open by hour, weekday or weekend."""
    share = shares(times, states)

    def predict(at: np.ndarray, minutes: int, seen: np.ndarray) -> np.ndarray:
        return share[hours(at)]

    return predict


def shares(times: np.ndarray, states: np.ndarray) -> np.ndarray:
    """(48,) of time open."""
    opened = np.bincount(hours(times), weights=states, minlength=48)
    return np.asarray(opened / np.maximum(np.bincount(hours(times), minlength=48), 1))


def remembering(times: np.ndarray, states: np.ndarray) -> Predict:
    """The share open by hour and by the state that was seen so long before: a table per horizon."""
    share = shares(times, states)

    def predict(at: np.ndarray, minutes: int, seen: np.ndarray) -> np.ndarray:
        place = np.searchsorted(times, times - minutes * MINUTE)
        known = times[place] == times - minutes * MINUTE
        pairs = np.zeros((48, 2, 2))
        np.add.at(pairs, (hours(times[known]), states[place[known]], states[known]), 1)
        chance = (pairs[..., 1] + FEW * share[:, None]) / (pairs.sum(axis=2) + FEW)
        return chance[hours(at), seen] if minutes else share[hours(at)]

    return predict


def fremen(periods: int) -> Model:
    """Krajnik et al. 2017, FreMEn: the mean and the strongest periodic components."""

    def model(times: np.ndarray, states: np.ndarray) -> Predict:
        frequencies = np.arange(1, CELLS + 1) / WEEK
        mean = states.mean()
        waves = np.array(
            [np.mean((states - mean) * np.exp(-2j * np.pi * f * times)) for f in frequencies]
        )
        best = np.argsort(-np.abs(waves))[:periods]

        def predict(at: np.ndarray, minutes: int, seen: np.ndarray) -> np.ndarray:
            phases = np.exp(2j * np.pi * frequencies[best][:, None] * at)
            return mean + 2 * np.real(waves[best] @ phases)

        return predict

    return model


def habits(times: np.ndarray, states: np.ndarray) -> Predict:
    """objstate.habits."""
    looks = RegionLooks.certain(times * NANOSECONDS, states, 2)
    return forecasting(Forecast(Design(2), Calendar(), fit(Design(2), Calendar(), looks)[0]))


def forecasting(forecast: Forecast) -> Predict:
    """Predictions of habits that are known."""

    def predict(at: np.ndarray, minutes: int, seen: np.ndarray) -> np.ndarray:
        out = np.empty(len(at))
        for i, (now, state) in enumerate(zip(at.tolist(), seen.tolist(), strict=True)):
            begin = (now - minutes * MINUTE) * NANOSECONDS
            belief = forecast.marginal(begin)
            if minutes:
                belief = forecast.given(belief, np.eye(2)[state])
                belief = forecast.later(belief, begin, now * NANOSECONDS)
            out[i] = forecast.regions(belief)[1]
        return out

    return predict


MODELS: dict[str, Model] = {
    "fade (without habits)": fade,
    "persistence": persistence,
    "two-state Markov": two_state,
    **{f"FreMEn, {periods} periods": fremen(periods) for periods in PERIODS},
    "hour, weekday or weekend": histogram,
    "the same with memory": remembering,
    "habits": habits,
}

FEW_MODELS = {name: MODELS[name] for name in MODELS if name.startswith(("fade", "FreMEn", "h"))}

if __name__ == "__main__":
    main()
