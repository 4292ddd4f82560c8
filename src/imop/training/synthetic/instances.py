"""The same things to do with other things of the same kind: other colours, another shape, or both."""

from collections.abc import Mapping, Sequence
from typing import Literal, get_args

import numpy as np

from imop.errors import InvalidInput
from imop.training.synthetic.families.marked import telling
from imop.training.synthetic.families.redraw import Diverged
from imop.training.synthetic.families.thing import Family
from imop.training.synthetic.plans import Draw, Plan
from imop.training.synthetic.stage import Unreachable

Variation = Literal["same", "color", "shape", "both"]
"""What differs between the things shown and those in the query."""
VARIATIONS: tuple[Variation, ...] = get_args(Variation)
_CHANGED = 0.6
"""How often each of several things is another one; one is always."""
_TOLD = 0.5
"""How often a thing whose colours change is told from others of its kind by a part that keeps its own."""
_ALIKE = 0.5
"""How often things of the same shape that are told by their colours all change it."""


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

    Nobody could say which is meant among things of one kind that all look otherwise than before. So they are
    left out of both plans, or told by colour: by that of the whole thing, if it stays, or by that of one part
    while everything else about all of them changes.

    Raises:
        Unreachable: if nothing can be another: all act beside one of their kind, or have no other shape.
    """
    acting = [draw.family for draw in plan.draws[: plan.acting]]
    alone = [i for i, family in enumerate(acting) if acting.count(family) == 1]
    if not alone:
        raise Unreachable("things of one kind act together")
    changed = {i for i in alone if rng.random() < _CHANGED} or {int(rng.choice(alone))}
    drawn: dict[int, tuple[Draw, Draw] | None] = {k: (draw, draw) for k, draw in enumerate(plan.draws)}
    for i in sorted(changed):
        drawn |= _changes(i, plan, families, variation, rng)
    try:
        # A thing can be in one scene only, so all are drawn again for either.
        shown, asked = (
            Plan(draws, tuple(draw.thing(families) for draw in draws), plan.parts)
            for draws in zip(*(both for both in drawn.values() if both is not None), strict=True)
        )
    except Diverged as error:
        raise Unreachable("a thing has no other shape") from error
    return shown, asked, frozenset(changed)


def _changes(
    i: int, plan: Plan, families: Mapping[str, Family], variation: Variation, rng: np.random.Generator
) -> dict[int, tuple[Draw, Draw] | None]:
    """How thing `i` and those like it are drawn in either plan; None for what is left out."""
    draw = plan.draws[i]
    color, sizes, mark = rng.integers(2**32, size=3).tolist()

    def both(one: Draw) -> tuple[Draw, Draw]:
        other = one if variation == "shape" else one._replace(color=color)
        return one, other if variation == "color" else other._replace(sizes=sizes)

    around = range(plan.acting, len(plan.draws))
    equal = [i, *(k for k in around if plan.draws[k] == draw)]
    rivals = [k for k in around if plan.draws[k].family == draw.family and k not in equal]
    told = variation != "shape" and rng.random() < _TOLD and telling(families[draw.family], draw.shape)
    if told:
        rivals = rivals or [k for k in around if k not in equal][: int(rng.integers(1, 4))]
    marks = rng.integers(2**32, size=len(rivals)).tolist()
    alike = rng.random() < _ALIKE
    found: dict[int, tuple[Draw, Draw] | None] = {
        k: both(draw._replace(mark=mark) if told else draw) for k in equal
    }
    for k, own in zip(rivals, marks, strict=True):
        rival = plan.draws[k]
        if told:
            found[k] = both(draw._replace(mark=own))
        elif variation != "shape" or rival.color == draw.color:
            found[k] = None
        elif alike and rival.shape == draw.shape:
            found[k] = both(rival)
    return found
