"""Intervals against their definition and published values; tests and ranks against counting by hand."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.errors import InvalidInput
from imop.evaluation.statistics import average_ranks, mcnemar, wilson

Z_95 = 1.959963984540054
counts = st.integers(1, 500).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n)))


@given(counts)
def test_bounds_solve_the_equation_that_defines_them(count):
    successes, trials = count
    for bound in wilson(successes, trials):
        assert (successes / trials - bound) ** 2 == pytest.approx(
            Z_95**2 * bound * (1 - bound) / trials, abs=1e-9
        )


@given(counts)
def test_rate_lies_between_the_bounds_and_failures_mirror_successes(count):
    successes, trials = count
    low, high = wilson(successes, trials)
    assert 0 <= low <= successes / trials + 1e-12 and successes / trials - 1e-12 <= high <= 1
    mirrored = wilson(trials - successes, trials)
    assert (low, high) == pytest.approx((1 - mirrored[1], 1 - mirrored[0]), abs=1e-12)


def test_known_values():
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)  # Newcombe 1998, table I
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=1e-4)  # the same table
    assert wilson(0, 0) == (0.0, 1.0)


@pytest.mark.parametrize(("successes", "trials"), [(-1, 3), (4, 3), (0, -1)])
def test_impossible_counts_are_refused(successes, trials):
    with pytest.raises(InvalidInput):
        wilson(successes, trials)


@given(st.integers(0, 60), st.integers(0, 60))
def test_mcnemar_counts_what_is_as_unlikely_under_a_fair_coin(a, b):
    n = a + b
    tail = sum(math.comb(n, k) for k in range(min(a, b) + 1)) / 2**n
    assert mcnemar(a, b) == mcnemar(b, a) == pytest.approx(min(1.0, 2 * tail))


def test_mcnemar_of_known_counts():
    assert mcnemar(0, 0) == 1.0
    assert mcnemar(0, 8) == pytest.approx(2 / 2**8)
    assert mcnemar(25, 8) == pytest.approx(0.0045, abs=1e-4)
    with pytest.raises(InvalidInput):
        mcnemar(-1, 2)


def test_equal_rates_share_the_better_rank():
    # Ranks by task: 1 1 2, 1 2 1, 3 2 2.
    assert average_ranks([[0.9, 0.5, 0.1], [0.9, 0.2, 0.3], [0.0, 0.2, 0.1]]) == pytest.approx(
        [4 / 3, 4 / 3, 7 / 3]
    )
