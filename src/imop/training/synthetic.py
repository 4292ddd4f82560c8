"""Training pairs from procedural scenes: the same things twice, or others of their kind."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations

import numpy as np

from imop.training.across import pairs_across
from imop.training.families.thing import Family
from imop.training.instances import Variation, shares
from imop.training.pairs import StepPair
from imop.training.scenes import draw_scene
from imop.training.stage import Unreachable
from imop.training.takes import make_pair, take

TAKES = 2
"""How often a scene's recipe is demonstrated; every two takes make pairs. New scenes teach more than new
takes of old ones."""
SAME_ONLY = (1.0, 0.0, 0.0, 0.0)


def synthetic_pairs(
    seed: int, count: int, families: Mapping[str, Family], mix: Sequence[float] = SAME_ONLY
) -> Iterator[StepPair]:
    """`count` pairs, the same for the same seed, families and mix.

    Args:
        seed: of everything that is drawn.
        count: how many.
        families: of the things.
        mix: shares of pairs that show the same things, other colours, other shapes, and both.

    Raises:
        InvalidInput: if the mix is not four shares.
    """
    wanted = shares(mix)
    rng = np.random.default_rng(seed)
    made = dict.fromkeys(wanted, 0)
    while True:
        # What lags most behind its share comes next.
        total = sum(made.values())
        variation = max(wanted, key=lambda name: wanted[name] * (total + 1) - made[name])
        for pair in _scene_pairs(families, variation, rng):
            if sum(made.values()) == count:
                return
            made[variation] += 1
            yield pair


def _scene_pairs(
    families: Mapping[str, Family], variation: Variation, rng: np.random.Generator
) -> list[StepPair]:
    try:
        return _same(families, rng) if variation == "same" else pairs_across(families, variation, rng)
    except Unreachable:
        return []


def _same(families: Mapping[str, Family], rng: np.random.Generator) -> list[StepPair]:
    scene = draw_scene(families, rng)
    takes = [take(scene, rng) for _ in range(TAKES)]
    found = [
        make_pair(scene, support, query, step)
        for step in range(len(scene.recipe.steps))
        for support, query in permutations(takes, 2)
    ]
    return [pair for pair in found if pair is not None]
