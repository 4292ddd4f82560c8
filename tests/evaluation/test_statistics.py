"""Wilson's interval against its definition and against published values."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.errors import InvalidInput
from imop.evaluation.statistics import Z_95, wilson

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
