"""How certain a success rate is, and how methods compare."""

from collections.abc import Sequence

import numpy as np

from imop.errors import InvalidInput

# scipy.stats takes half a second to import, which every worker and every short command would pay.


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Wilson's 95 % score interval of a success rate, (lower, upper) fractions; (0, 1) without trials.

    Args:
        successes: 0 .. trials.
        trials: how often it was tried.

    Raises:
        InvalidInput: if the counts are negative or there are more successes than trials.

    Source: Wilson, JASA 1927.
    """
    from scipy.stats import binomtest

    if not 0 <= successes <= trials:
        raise InvalidInput("successes", f"{successes} of {trials}", "0 <= successes <= trials")
    if trials == 0:
        return 0.0, 1.0
    low, high = binomtest(successes, trials).proportion_ci(0.95, "wilson")
    return float(low), float(high)


def mcnemar(only_one: int, only_other: int) -> float:
    """Exact two-sided p that two methods are equally good, from the scenes that only one of them solves.

    Args:
        only_one: scenes that only the one solves.
        only_other: scenes that only the other solves.

    Raises:
        InvalidInput: for negative counts.

    Source: McNemar, Psychometrika 1947; exact by the binomial distribution.
    """
    from scipy.stats import binomtest

    if only_one < 0 or only_other < 0:
        raise InvalidInput("scenes", f"{only_one} and {only_other}", "whole numbers from 0 on")
    different = only_one + only_other
    return float(binomtest(only_one, different).pvalue) if different else 1.0


def average_ranks(rates: Sequence[Sequence[float]]) -> list[float]:
    """Mean rank of every method over the tasks, 1 for the highest rate; equal rates share the better rank.

    So the paper's ranks follow from its rates.

    Args:
        rates: for each method the rates of the same tasks.
    """
    from scipy.stats import rankdata

    ranks = rankdata(-np.asarray(rates, dtype=float), method="min", axis=0)
    return [float(mean) for mean in ranks.mean(axis=1)]
