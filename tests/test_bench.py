"""What the benchmark compares is the same thing, and what it writes replaces what it wrote."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.speed.objects import Case, Estimate, door_case, u_case
from benchmarks.speed.page import write
from benchmarks.speed.raw import posterior
from objstate.geometry import FloatArray

ALIKE = 0.01  # nats of a whole scan


def by_brute_force(estimate: Estimate) -> FloatArray:
    return estimate.brute_force().log_likelihood(estimate.model)


@pytest.mark.parametrize("case", [door_case(10), door_case(91), u_case(40)])
def test_log_likelihoods_are_those_of_every_triple_cast_with_embree(case: Case) -> None:
    estimate = Estimate(case)
    exact = by_brute_force(estimate)
    assert np.ptp(exact) > 10.0  # the scan tells states apart
    np.testing.assert_allclose(estimate.log_likelihood(), exact, atol=ALIKE)


def test_a_doors_posterior_is_that_of_brute_force() -> None:
    estimate = Estimate(door_case(10))
    prior, exact = estimate.prior.weights.values, by_brute_force(estimate)
    true = posterior(prior, exact, estimate.tempering)
    assert true.max() > 3.0 * prior[true.argmax()]
    np.testing.assert_allclose(estimate.posterior(0.0).weights.values, true, atol=1e-4)


def test_a_page_keeps_what_stands_around_the_part_that_is_written(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n\n<!-- part -->\nold\n<!-- /part -->\n\nafter\n")
    for text in ("first", "second"):
        write(page, "part", text)
        expected = f"before\n\n<!-- part -->\n\n{text}\n\n<!-- /part -->\n\nafter\n"
        assert page.read_text() == expected


@pytest.mark.parametrize("text", ["", "<!-- part -->", "<!-- /part --> <!-- part -->"])
def test_a_page_without_the_part_is_refused(tmp_path: Path, text: str) -> None:
    page = tmp_path / "page.md"
    page.write_text(text)
    with pytest.raises(ValueError, match="once each"):
        write(page, "part", "new")
    assert page.read_text() == text
