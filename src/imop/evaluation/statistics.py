"""How certain a success rate is."""

import math

from imop.errors import InvalidInput

Z_95 = 1.959963984540054


def wilson(successes: int, trials: int, z: float = Z_95) -> tuple[float, float]:
    """Wilson's score interval of a success rate, (lower, upper) fractions; (0, 1) without trials.

    Args:
        successes: 0 .. trials.
        trials: how often it was tried.
        z: quantile of the normal distribution; the default gives 95 %.

    Raises:
        InvalidInput: if the counts are negative or there are more successes than trials.

    Source: Wilson, JASA 1927.
    """
    if not 0 <= successes <= trials:
        raise InvalidInput("successes", f"{successes} of {trials}", "0 <= successes <= trials")
    if trials == 0:
        return 0.0, 1.0
    p = successes / trials
    spread = z * math.sqrt(p * (1 - p) / trials + z**2 / (4 * trials**2))
    center, scale = p + z**2 / (2 * trials), 1 + z**2 / trials
    return max(0.0, (center - spread) / scale), min(1.0, (center + spread) / scale)
