"""Habits of a simulated building: ``python -m benchmarks.simulated_habits [--seeds A:B] [--figures | --drives]``

*Doors*: offices whose owner comes at some hour of working days, goes for lunch and for many short walks,
shuts the door or not by a habit of his own, and is away on some days; stores that are opened a few times
a day; a corridor's door that is opened in the morning and shut at night. Their days are planned, not
Markov. A robot looks at each a few times a day, at random moments, for four weeks; each model foretells
the door's state in the fifth, given a look so long before. All doors' habits are learnt together.

*Figures*: the share of time that each door is closed and how often it is moved a day, as ``objstate world
habits`` tells them, by the Gaussian posterior that predicts and by the mixture over levels. The truth
is that of all five weeks.

*Drives*: a world takes looks in one a drive. How far the probability of being closed, at each hour of
the next week, is from the one by a fit to all looks, for an office, a store, the corridor's door and
a door that stays shut.

*Furniture*: chairs that are moved among places by day, two of which change places, and a table
that is moved about once a month. Each is looked at as the doors are.

Prints Markdown tables: log-likelihoods (nats), and how often 90 % intervals hold the true rates.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from itertools import pairwise

import numpy as np

from benchmarks.habits import (
    FEW_MODELS,
    MINUTE,
    Predict,
    forecasting,
    score,
)
from objstate.habits.building import DoorHabits, PieceHabits
from objstate.habits.calendar import NANOSECONDS, Calendar
from objstate.habits.forecast import Forecast
from objstate.habits.levels import fit_levels
from objstate.habits.looks import RegionLooks
from objstate.habits.model import prior
from objstate.habits.moves import MoveDesign
from objstate.habits.piece import PieceSite, Places, Sighting, beside, shared
from objstate.habits.site import RESTS, Site, fitted_site
from objstate.habits.summary import week_habit, week_moves
from objstate.world.habitual import DRAWS

BEGIN = 1_767_571_200  # Monday, 5 January 2026
NEXT = date(2026, 2, 9)  # after the last week
DAY = 1440  # minutes
TAUGHT, TESTED = 28, 7  # days
LOOKS_A_DAY = (2, 4, 12)
BOUNDS = (0.17,)  # rad, of a closed door
SO_FAR = (6, 8, 11, 14, 18, 23, 29, 37, 47, 59)  # looks, each as many as may be before a fit
HORIZONS = {"1 h": 60, "1 day": DAY, "no look": 0}
OFFICES, STORES = 14, 4
CHAIRS, PLACES = 6, 3
FIT = np.array([0.03, 0.03, 0.05])  # deviations of a look at furniture
CLEAR = np.log(1e-3)  # the least log-density that is counted, as chances are clipped


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="1:4", help="A:B")
    only = parser.add_mutually_exclusive_group()
    only.add_argument("--figures", action="store_true", help="only those")
    only.add_argument("--drives", action="store_true", help="only those")
    given = parser.parse_args()
    first, last = map(int, given.seeds.split(":"))
    seeds = range(first, last)
    if given.drives:
        table_of_drives(seeds)
        return
    if not given.figures:
        tables(seeds)
    table_of_figures(seeds)


def tables(seeds: range) -> None:
    """Of doors and of furniture."""
    names = [f"{days} a day, {horizon}" for days in LOOKS_A_DAY for horizon in HORIZONS]
    print(f"| doors | {' | '.join(names)} |\n| --- |{' --- |' * len(names)}")
    rows = np.mean([doors(np.random.default_rng(seed)) for seed in seeds], axis=0)
    for name, row in zip(NAMES, rows, strict=True):
        print(f"| {name} | {' | '.join(f'{each:.3f}' for each in row)} |")
    print(
        "\n| furniture | next look: settings | constant rate | habits | true moves a day in 90 % |"
    )
    print("| --- | --- | --- | --- | --- |")
    for looks in LOOKS_A_DAY:
        parts = [furniture(np.random.default_rng(seed), looks) for seed in seeds]
        densities = np.mean([part.densities for part in parts], axis=0)
        held = [each for part in parts for each in part.held]
        cells = [f"{looks} looks a day", *(f"{each:.2f}" for each in densities)]
        print(f"| {' | '.join(cells)} | {sum(held)} of {len(held)} |")


def table_of_figures(seeds: range) -> None:
    """How often intervals of figures hold the truth."""
    print("\n| figures of doors | share closed in 90 % | moves a day in 90 % | upper over lower |")
    print("| --- | --- | --- | --- |")
    for looks in LOOKS_A_DAY:
        parts = [figures(np.random.default_rng(seed), looks) for seed in seeds]
        for name in parts[0]:
            told = np.concatenate([part[name] for part in parts])
            held = [f"{told[:, k].sum():.0f} of {len(told)}" for k in (0, 1)]
            cells = [f"{looks} looks a day, {name}", *held, f"{np.median(told[:, 2]):.1f}"]
            print(f"| {' | '.join(cells)} |")


def table_of_drives(seeds: range) -> None:
    """How far what drives told one after the other is from what all looks tell together."""
    off = np.concatenate([apart(np.random.default_rng(seed)) for seed in seeds])
    print(f"| looks so far | {' | '.join(map(str, SO_FAR))} |\n| --- |{' --- |' * len(SO_FAR)}")
    for name, row in ((f"mean of {len(off)} doors", off.mean(0)), ("the worst door", off.max(0))):
        print(f"| {name} | {' | '.join(f'{each:.3f}' for each in row)} |")


def apart(rng: np.random.Generator) -> np.ndarray:
    """(d, n) mean differences of P(closed) of doors after each of ``SO_FAR`` looks, each a drive."""
    states = building(rng)
    kept_shut = np.zeros_like(states[0])
    chosen, out = (states[0], states[OFFICES], states[-1], kept_shut), []
    for state in chosen:
        at = np.sort(rng.choice(SO_FAR[-1] * DAY // 4, SO_FAR[-1], replace=False))  # 4 a day
        looks = RegionLooks.certain((BEGIN + 60 * at) * NANOSECONDS, state[at], 2)
        site, differences = Site.empty(BOUNDS), []
        for k in range(len(looks)):
            known, rests = looks.part(slice(k + 1)), np.zeros(RESTS)
            site = site.with_looks(Calendar(), looks.part(slice(k, k + 1)), rests)
            if site.due:
                site = fitted_site(BOUNDS, Calendar(), known, rests)
            if len(known) in SO_FAR:
                both = site, fitted_site(BOUNDS, Calendar(), known, rests)
                closed = [closed_by_hour(each, int(known.stamps_ns[-1])) for each in both]
                differences.append(np.abs(closed[1] - closed[0]).mean())
        out.append(differences)
    return np.array(out)


def closed_by_hour(site: Site, after_ns: int) -> np.ndarray:
    """(168,) probability of being closed at each hour of a week from a day after a moment."""
    forecast = site.forecast(Calendar(), site.posterior(prior(site.design)))
    hours = after_ns + (24 + np.arange(7 * 24)) * 60 * MINUTE * NANOSECONDS
    return np.array([forecast.regions(forecast.marginal(hour))[0] for hour in hours.tolist()])


def doors(rng: np.random.Generator) -> np.ndarray:
    """(m, n) scores of each model, at each number of looks and each horizon."""
    minutes = np.arange((TAUGHT + TESTED) * DAY)
    times = BEGIN + MINUTE * minutes
    states = building(rng)
    columns = []
    for looks in LOOKS_A_DAY:
        seen = [np.sort(rng.choice(TAUGHT * DAY, TAUGHT * looks, replace=False)) for _ in states]
        together = habits_of(times, states, seen)
        rows = []
        for name in NAMES:
            scores = []
            for k, state in enumerate(states):
                if name == TOGETHER:
                    predict = forecasting(together.forecast(str(k)))
                else:
                    predict = MODELS[name](times[seen[k]], state[seen[k]])
                scores.append([judged(predict, times, state, h) for h in HORIZONS.values()])
            rows.append(np.mean(scores, axis=0))
        columns.append(np.array(rows))
    return np.concatenate(columns, axis=1)


def two_state(times: np.ndarray, states: np.ndarray) -> Predict:
    """A Markov process at constant rates, by likelihood (Kalbfleisch and Lawless 1985)."""
    shares, rates = (
        np.linspace(0.01, 0.99, 99)[:, None, None],
        np.geomspace(1e-7, 1e-2, 60)[:, None],
    )
    kept = np.exp(-rates * np.diff(times))
    opens = shares + (states[:-1] - shares) * kept
    total = np.log(np.where(states[1:] == 1, opens, 1.0 - opens)).sum(axis=2)
    i, j = np.unravel_index(int(np.argmax(total)), total.shape)
    share, rate = float(shares[i, 0, 0]), float(rates[j, 0])

    def predict(at: np.ndarray, minutes: int, seen: np.ndarray) -> np.ndarray:
        return share + (seen - share) * np.exp(-rate * MINUTE * minutes) * (minutes > 0)

    return predict


def habits_of(
    times: np.ndarray, states: Sequence[np.ndarray], seen: Sequence[np.ndarray]
) -> DoorHabits:
    """Those of all doors, joined."""
    sites: dict[str, Site] = {}
    for k, (state, at) in enumerate(zip(states, seen, strict=True)):
        looks = RegionLooks.certain(times[at] * NANOSECONDS, state[at], 2)
        sites[str(k)] = fitted_site(BOUNDS, Calendar(), looks, np.zeros(RESTS))
    return DoorHabits(Calendar(), sites, dict.fromkeys(sites, "hinged"))


def figures(rng: np.random.Generator, looks: int) -> dict[str, np.ndarray]:
    """By posterior (n, 3) of each door: whether both intervals hold, and how wide that of moves is."""
    times = BEGIN + MINUTE * np.arange((TAUGHT + TESTED) * DAY)
    states = building(rng)
    seen = [np.sort(rng.choice(TAUGHT * DAY, TAUGHT * looks, replace=False)) for _ in states]
    habits, out = habits_of(times, states, seen), dict[str, list[tuple[float, float, float]]]()
    for k, (state, at) in enumerate(zip(states, seen, strict=True)):
        own, design = habits.forecast(str(k)), habits.sites[str(k)].design
        known = RegionLooks.certain(times[at] * NANOSECONDS, state[at], 2)
        before = habits.before(design, "hinged", but=str(k))
        mixture = fit_levels(design, habits.calendar, known, before)
        closed = 1.0 - float(state.mean())
        moves = np.count_nonzero(np.diff(state)) / (TAUGHT + TESTED)
        for name, each in (
            ("Gaussian", own),
            ("mixture", Forecast(design, habits.calendar, mixture, DRAWS)),
        ):
            week = week_habit(each, NEXT)
            share, often = week.shares[0], week.moves_per_day
            held = share.lower <= closed <= share.upper, often.lower <= moves <= often.upper
            out.setdefault(name, []).append((*map(float, held), often.upper / often.lower))
    return {name: np.array(each) for name, each in out.items()}


def judged(predict: Predict, times: np.ndarray, states: np.ndarray, minutes: int) -> float:
    """Log-likelihood in the last week, given a look so many minutes before."""
    at = np.arange(TAUGHT * DAY + 3, len(times), 31)
    return score(predict(times[at], minutes, states[at - minutes]), states[at])


def building(rng: np.random.Generator) -> list[np.ndarray]:
    """Whether each door (n,) is open, by the minute."""
    rooms = [office(rng) for _ in range(OFFICES)] + [store(rng) for _ in range(STORES)]
    return [*rooms, corridor_door(rng)]


def office(rng: np.random.Generator) -> np.ndarray:
    """(n,) whether a door is open, by the minute."""
    out = np.zeros((TAUGHT + TESTED) * DAY, dtype=np.int64)
    comes, stays, likes = rng.normal(8.7, 0.8), rng.normal(8.5, 1.0), rng.beta(1.5, 1.0)
    walks, away = rng.gamma(2.0, 3.0), rng.beta(1.0, 8.0)
    for day in range(TAUGHT + TESTED):
        if day % 7 >= 5 or rng.random() < away:
            continue
        begin, end = comes + rng.normal(0, 0.4), comes + stays + rng.normal(0, 0.7)
        at, state = begin, int(rng.random() < likes)
        while at < end:
            gap = min(rng.exponential((end - begin) / (walks + 1.0)), end - at)
            fill(out, day, at, at + gap, state)
            fill(out, day, at + gap, at + gap + 1 / 60, 1)
            at += gap + rng.gamma(2.0, 0.1)
            state = int(rng.random() < likes)
    return out


def store(rng: np.random.Generator) -> np.ndarray:
    """(n,) a few minutes at a time, a few times a working day."""
    out = np.zeros((TAUGHT + TESTED) * DAY, dtype=np.int64)
    often = rng.gamma(2.0, 2.0)
    for day in range(TAUGHT + TESTED):
        if day % 7 < 5:
            for _ in range(rng.poisson(often)):
                at = rng.uniform(8.0, 17.0)
                fill(out, day, at, at + rng.exponential(0.1), 1)
    return out


def corridor_door(rng: np.random.Generator) -> np.ndarray:
    """(n,) open by day, but for a while now and then."""
    out = np.zeros((TAUGHT + TESTED) * DAY, dtype=np.int64)
    for day in range(TAUGHT + TESTED):
        if day % 7 < 5:
            fill(out, day, rng.normal(6.5, 0.2), rng.normal(19.5, 0.5), 1)
            if rng.random() < 0.3:
                at = rng.uniform(8.0, 17.0)
                fill(out, day, at, at + rng.exponential(0.5), 0)
    return out


def fill(out: np.ndarray, day: int, begin: float, end: float, state: int) -> None:
    """Write a state between hours of a day."""
    out[day * DAY + round(60 * begin) : day * DAY + round(60 * max(begin, end))] = state


@dataclass(frozen=True)
class Scores:
    """Mean log-densities of the next look by settings, a constant rate and habits; intervals held."""

    densities: tuple[float, float, float]
    held: tuple[bool, ...]


def furniture(rng: np.random.Generator, looks: int) -> Scores:
    """Of several chairs and a table."""
    days = TAUGHT + TESTED
    rates = [rng.gamma(2.0, 0.15) for _ in range(CHAIRS)] + [
        1 / 30 / 10.0
    ]  # an hour of a working day
    spots = rng.uniform([0, 0, -3], [8, 6, 3], (CHAIRS * PLACES, 3))
    chairs = [chair(rng, rate, spots, k) for k, rate in enumerate(rates)]
    exchange(rng, chairs)
    settings = elsewhere()
    sites, tested, scores, held = {}, {}, [], []
    for k, path in enumerate(chairs):
        at = np.sort(rng.choice(days * DAY, days * looks, replace=False))
        seen = [
            Sighting(
                (BEGIN + 60 * minute) * NANOSECONDS,
                path[minute] + FIT / 3 * rng.standard_normal(3),
                (FIT / 3) ** 2,
            )
            for minute in at.tolist()
        ]
        taught = at < TAUGHT * DAY
        sites[str(k)] = PieceSite.fitted_to(
            Calendar(),
            [s for s, t in zip(seen, taught, strict=True) if t],
            lambda _: settings,
            same,
        )
        tested[str(k)] = seen[int(taught.sum()) - 1 :]
    forms = {name: "chair" if int(name) < CHAIRS else "table" for name in sites}
    habits = PieceHabits(Calendar(), sites, forms, MoveDesign)
    for name, seen in tested.items():
        moves = habits.forecast(name)
        like, unlike = others_of(sites, forms, name)
        goes = sites[name].next(shared(like, beside(unlike, settings)))
        rate = week_moves(moves, NEXT).moves_per_day
        truth = rates[int(name)] * 10.0 * 5 / 7
        if int(name) > 1:  # the first two are exchanged, too
            held.append(rate.lower <= truth <= rate.upper)
        constant = rate.value / 86400.0
        for before, after in pairwise(seen):
            seconds = (after.stamp_ns - before.stamp_ns) / NANOSECONDS
            stay = [
                np.exp(-seconds / 3600.0),
                np.exp(-constant * seconds),
                moves.stays(before.stamp_ns, after.stamp_ns),
            ]
            places = [settings, sites[name].next(settings), goes]
            scores.append([mixed(s, p, before, after) for s, p in zip(stay, places, strict=True)])
    settings_, constant_, by_habit = np.mean(scores, axis=0).tolist()
    return Scores((settings_, constant_, by_habit), tuple(held))


def others_of(
    sites: dict[str, PieceSite], forms: dict[str, str], name: str
) -> tuple[list[PieceSite], list[PieceSite]]:
    """Those of the same form, and of others."""
    like, unlike = list[PieceSite](), list[PieceSite]()
    for other, site in sites.items():
        if other != name:
            (like if forms[other] == forms[name] else unlike).append(site)
    return like, unlike


def chair(rng: np.random.Generator, rate: float, spots: np.ndarray, k: int) -> np.ndarray:
    """(n, 3) where it stands, by the minute; moved from 8 to 18 h of working days."""
    days = TAUGHT + TESTED
    own = spots[(PLACES * k + np.arange(PLACES)) % len(spots)]
    often = rng.dirichlet(np.array([4.0, 2.0, 1.0]))
    out, state = np.empty((days * DAY, 3)), own[0]
    for minute in range(days * DAY):
        works = (minute // DAY) % 7 < 5 and 8 * 60 <= minute % DAY < 18 * 60
        if works and rng.random() < rate / 60.0:
            state = own[rng.choice(PLACES, p=often)] + rng.normal(0, [0.1, 0.1, 0.15])
        out[minute] = state
    return out


def exchange(rng: np.random.Generator, chairs: list[np.ndarray]) -> None:
    """The first two change places in every second week."""
    for week in range(1, (TAUGHT + TESTED) // 7, 2):
        part = slice(week * 7 * DAY, (week + 1) * 7 * DAY)
        chairs[0][part], chairs[1][part] = chairs[1][part].copy(), chairs[0][part].copy()


def mixed(stays: float, goes: Places, before: Sighting, after: Sighting) -> float:
    """Log-density of a look after another one, relative to one that is certain that nothing was moved."""
    assert before.state is not None
    assert after.state is not None
    variance = (before.variance + after.variance + FIT**2)[None]
    here = Places(np.ones(1), before.state[None], variance, 0.0)
    total = stays * here.density(after, same) + (1.0 - stays) * goes.density(after, same)
    certain = float((2.0 * np.pi) ** -1.5 / np.sqrt(variance.prod()))
    return max(float(np.log(max(total, 1e-300) / certain)), 3 * CLEAR)


def elsewhere() -> Places:
    """By settings of a piece that may be anywhere in a room."""
    middle, spread_ = np.array([[4.0, 3.0, 0.0]]), np.array([[8.0, 5.0, 3.0]])
    return Places(np.ones(1), middle, spread_, 0.0)


def same(states: np.ndarray, yaw: float) -> np.ndarray:
    """States of furniture without symmetry."""
    return states


TOGETHER = "habits"
ALONE = f"{TOGETHER}, each door alone"
# Models that looks hours apart can be given to.
MODELS = {name: model for name, model in FEW_MODELS.items() if name != TOGETHER}
MODELS |= {"two-state Markov": two_state, ALONE: FEW_MODELS[TOGETHER]}
NAMES = (*MODELS, TOGETHER)

if __name__ == "__main__":
    main()
