"""Colours that tasks and people have names for (RLBench's values), and random ones."""

import numpy as np

Color = tuple[float, float, float]

NAMED: dict[str, Color] = {
    "red": (1.0, 0.0, 0.0),
    "lime": (0.0, 1.0, 0.0),
    "blue": (0.0, 0.0, 1.0),
    "yellow": (1.0, 1.0, 0.0),
    "cyan": (0.0, 1.0, 1.0),
    "magenta": (1.0, 0.0, 1.0),
    "orange": (1.0, 0.5, 0.0),
    "purple": (0.5, 0.0, 0.5),
    "teal": (0.0, 0.5, 0.5),
    "white": (1.0, 1.0, 1.0),
}


def random_color(rng: np.random.Generator, low: float = 0.1, high: float = 0.95) -> Color:
    """Any colour with channels between `low` and `high`."""
    r, g, b = rng.uniform(low, high, size=3)
    return float(r), float(g), float(b)
