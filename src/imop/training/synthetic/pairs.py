"""Training pairs from procedural scenes: the same things twice, or others of their kind."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations

import numpy as np

from imop.errors import InvalidInput
from imop.training.data.executed import executions
from imop.training.data.pairs import StepPair
from imop.training.synthetic.across import pairs_across
from imop.training.synthetic.families.thing import Family
from imop.training.synthetic.instances import VARIATIONS, Variation, shares
from imop.training.synthetic.scenes import draw_scene
from imop.training.synthetic.stage import Unreachable
from imop.training.synthetic.takes import SyntheticStep, make_pair, take
from imop.types import Observation

TAKES = 2
"""How often a scene's script is demonstrated; every two takes make pairs. New scenes teach more than new
takes of old ones."""
_PATIENCE = 500
"""So many scenes in a row may give no pair."""
SAME_ONLY = (1.0, 0.0, 0.0, 0.0)


def synthetic_pairs(
    seed: int,
    count: int,
    families: Mapping[str, Family],
    mix: Sequence[float] = SAME_ONLY,
    kinds: Sequence[str] = (),
) -> Iterator[StepPair]:
    """`count` pairs, the same for the same seed, families and mix.

    Those that show the same things twice are the first ones of `SAME_ONLY`, whatever the mix.

    Args:
        seed: of everything that is drawn.
        count: how many.
        families: of the things.
        mix: shares of pairs that show the same things, other colours, other shapes, and both.
        kinds: of what is done (`plans.SHARES`); none for all.

    Raises:
        InvalidInput: if the mix is not four shares, or the families cannot give a pair of it.
    """
    wanted = shares(mix)
    streams = {
        variation: (
            example.pair for scene in synthetic_scenes(families, variation, seed, kinds) for example in scene
        )
        for variation in wanted
    }
    made = dict.fromkeys(wanted, 0)
    for number in range(1, count + 1):
        due = max(wanted, key=lambda variation: wanted[variation] * number - made[variation])
        made[due] += 1
        yield next(streams[due])


def synthetic_scenes(
    families: Mapping[str, Family], variation: Variation, seed: int, kinds: Sequence[str] = ()
) -> Iterator[list[SyntheticStep]]:
    """The pairs of scene after scene of one variation, without end; of some kinds of what is done, or all.

    Raises:
        InvalidInput: if the families cannot give a pair of it.
    """
    number = VARIATIONS.index(variation)
    rng = np.random.default_rng((seed, number) if number else seed)
    fruitless = 0
    while fruitless < _PATIENCE:
        try:
            if variation == "same":
                made = _same(families, rng, kinds)
            else:
                made = pairs_across(families, variation, rng, kinds)
        except Unreachable:
            made = []
        if made:
            yield made
        fruitless = 0 if made else fruitless + 1
    raise InvalidInput("mix", f"no pair of {variation} in {_PATIENCE} scenes", "more families, or less of it")


def synthetic_executions(
    families: Mapping[str, Family],
    mix: Sequence[float],
    seed: int,
    rng: np.random.Generator,
    kinds: Sequence[str] = (),
) -> Iterator[tuple[list[SyntheticStep], Observation | None]]:
    """Executions of scenes of a mix, without end: the steps of each demonstration and query, in their order.

    With each comes how an execution with other things begins, as soon as there was one.

    Args:
        families: of the things.
        mix: as in `synthetic_pairs`.
        seed: of the scenes.
        rng: draws which variation comes next.
        kinds: of what is done (`plans.SHARES`); none for all.

    Raises:
        InvalidInput: if the mix is not four shares, or the families cannot give a pair of it.
    """
    wanted = shares(mix)
    streams = {variation: synthetic_scenes(families, variation, seed, kinds) for variation in wanted}
    elsewhere: Observation | None = None
    while True:
        groups = executions(next(streams[rng.choice(list(streams), p=list(wanted.values()))]))
        for group in groups:
            yield group, elsewhere
        elsewhere = groups[0][0].asked.observations[0]


def _same(
    families: Mapping[str, Family], rng: np.random.Generator, kinds: Sequence[str]
) -> list[SyntheticStep]:
    scene = draw_scene(families, rng, kinds=kinds)
    takes = [take(scene, rng) for _ in range(TAKES)]
    found = [
        make_pair(scene, support, query, step)
        for step in range(len(scene.script.steps))
        for support, query in permutations(takes, 2)
    ]
    return [pair for pair in found if pair is not None]
