"""Sums of logs, added up, tell what all estimates together tell."""

from dataclasses import asdict

import numpy as np
import polars as pl
import pytest

from objstate.evaluation.breakdown import ALL, parts_of
from objstate.evaluation.calibration import RESAMPLED, SEED, calibrations
from objstate.evaluation.summary import summarize_states
from objstate.evaluation.sums import FINAL, Totals, packed, sums_of, unpacked

RNG = np.random.default_rng(0)


def judged(count: int, logs: int) -> pl.DataFrame:
    errors = RNG.standard_normal(count) * np.exp(RNG.uniform(-9, 1, count))
    return pl.DataFrame(
        {
            "log": [f"log_{n}" for n in RNG.integers(logs, size=count)],
            "object": [f"door_{n}" for n in RNG.integers(3, size=count)],
            "coordinate": [("angle", "x")[n] for n in RNG.integers(2, size=count)],
            "observed": RNG.random(count) < 0.7,
            "final": RNG.random(count) < 0.1,
            "error": errors,
            "inside": RNG.random(count) < 0.9,
            "std": np.abs(errors) * RNG.uniform(0.3, 3.0, count),
            "lower": errors - 1,
            "upper": errors + 1,
            "period": RNG.integers(3, size=count),
            "distance": RNG.uniform(0, 9, count),
        }
    )


def totals_of(frame: pl.DataFrame) -> Totals:
    """Log by log, each through its bytes."""
    totals = Totals()
    for (log,), part in sorted(frame.partition_by("log", as_dict=True).items()):
        sums = sums_of(parts_of(part), part, ("a note",))
        totals.add(str(log), unpacked(packed(sums), str(log)))
    return totals


@pytest.mark.parametrize("count", [3, 40, 5000])
def test_sums_over_logs_give_the_figures_of_all_errors(count: int) -> None:
    frame = judged(count, logs=7)
    found = dict(totals_of(frame).errors())
    assert found.keys() == parts_of(frame).keys()
    for (condition, label, coordinate), part in parts_of(frame).items():
        errors = part["error"].to_numpy()
        expected = summarize_states(coordinate, errors, part["inside"].to_numpy())
        told = asdict(found[condition, label, coordinate])
        for name, value in asdict(expected).items():
            close = 0.005 if name in ("median", "p90") else 1e-9
            assert told[name] == pytest.approx(value, rel=close, abs=1e-12)
    assert any(condition == ALL for condition, _, _ in found)


def test_final_estimates_are_kept_as_they_are() -> None:
    frame, columns = judged(300, logs=5), ["log", "object", "coordinate", *FINAL]
    expected = frame.filter("final").select(columns).sort(columns)
    found = totals_of(frame).finals().select(columns).sort(columns)
    assert found.rows() == expected.rows()


def test_a_log_without_a_judged_estimate_adds_its_notes_alone() -> None:
    totals = Totals()
    totals.add("empty", sums_of({}, pl.DataFrame(), ("no building",)))
    assert totals.notes == ["empty: no building"]
    assert totals.finals().is_empty()


def test_levels_are_those_of_logs_drawn_anew() -> None:
    frame = judged(400, logs=9).with_columns(final=pl.lit(True)).filter(coordinate="x")
    (found,) = calibrations(frame)
    _, logs = np.unique(frame["log"].to_numpy(), return_inverse=True)
    held, counts = np.bincount(logs, weights=frame["inside"].to_numpy()), np.bincount(logs)
    drawn = np.random.default_rng(SEED).integers(len(counts), size=(RESAMPLED, len(counts)))
    shares = held[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    bounds = np.quantile(shares, [0.05, 0.95])
    assert (found.recorded.lower, found.recorded.upper) == pytest.approx(bounds)
