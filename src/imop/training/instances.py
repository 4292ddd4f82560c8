"""The same things to do with other things of the same kind: other colours, another shape, or both."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal, get_args

import numpy as np

from imop.errors import InvalidInput
from imop.training.families.redraw import Diverged
from imop.training.families.thing import Family
from imop.training.plans import Draw, Plan
from imop.training.stage import Unreachable

Variation = Literal["same", "color", "shape", "both"]
"""What differs between the things shown and those in the query."""
VARIATIONS: tuple[Variation, ...] = get_args(Variation)
_CHANGED = 0.6
"""How often each of several things is another one; one is always."""


def shares(mix: Sequence[float]) -> dict[Variation, float]:
    """How often each variation is wanted, of sum 1.

    Raises:
        InvalidInput: if there is not one number for each, none negative and one positive.
    """
    if len(mix) != len(VARIATIONS) or min(mix) < 0 or not 0 < sum(mix) < np.inf:
        accepted = f"{len(VARIATIONS)} numbers from 0 up, one of them positive: " + ", ".join(VARIATIONS)
        raise InvalidInput("mix", f"{tuple(mix)}", accepted)
    return {variation: share / sum(mix) for variation, share in zip(VARIATIONS, mix, strict=True)}


def other_instances(
    plan: Plan, families: Mapping[str, Family], variation: Variation, rng: np.random.Generator
) -> tuple[Plan, Plan, frozenset[int]]:
    """The plan and the same one with other things, and which of the things something is done with are others.

    What could be confused with the other things is left out of both plans: nobody could say which is meant.

    Raises:
        Unreachable: if nothing can be another: all act beside one of their kind, or have no other shape.
    """
    acting = [draw.family for draw in plan.draws[: plan.acting]]
    alone = [i for i, family in enumerate(acting) if acting.count(family) == 1]
    if not alone:
        raise Unreachable("things of one kind act together")
    changed = {i for i in alone if rng.random() < _CHANGED} or {int(rng.choice(alone))}
    other = {plan.draws[i]: _other(plan.draws[i], variation, rng) for i in sorted(changed)}
    kept = [
        i for i, draw in enumerate(plan.draws) if i < plan.acting or not _confusing(draw, other, variation)
    ]
    shown = Plan(tuple(plan.draws[i] for i in kept), tuple(plan.things[i] for i in kept), plan.parts)
    draws = tuple(other.get(draw, draw) for draw in shown.draws)
    try:
        # A thing can be in one scene only.
        things = tuple(draw.thing(families) for draw in draws)
    except Diverged as error:
        raise Unreachable("a thing has no other shape") from error
    return shown, replace(shown, draws=draws, things=things), frozenset(changed)


def _other(draw: Draw, variation: Variation, rng: np.random.Generator) -> Draw:
    color, sizes = rng.integers(2**32, size=2).tolist()
    if variation != "shape":
        draw = draw._replace(color=color)
    return draw if variation == "color" else draw._replace(sizes=sizes)


def _confusing(draw: Draw, other: Mapping[Draw, Draw], variation: Variation) -> bool:
    """Whether a thing is of the kind of one that changes, not its equal, and of no colour that tells."""
    return draw not in other and any(
        draw.family == before.family and (variation != "shape" or draw.color == before.color)
        for before in other
    )
